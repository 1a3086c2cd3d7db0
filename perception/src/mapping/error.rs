//! Errors of mapping.

use nalgebra::Isometry2;

/// Reason why options or poses cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MappingError {
    /// Option out of range.
    #[error("{name} is {value}: give a number from {least} to {most}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Given value.
        value: f64,
        /// Smallest permitted value.
        least: f64,
        /// Greatest permitted value.
        most: f64,
    },
    /// Pose that is not finite, not normalised or too far out.
    #[error(
        "the pose of {what} {index} is not finite, or farther out than {FARTHEST_M} m: mend the localisation that it came from"
    )]
    Pose {
        /// Owner of the pose: `station` or `start`.
        what: &'static str,
        /// Index of the station; 0 for a start.
        index: usize,
    },
}

/// Maximum coordinate of a pose, metres.
pub(super) const FARTHEST_M: f64 = 1e5;

/// Checks options, given as name, value, least and greatest permitted value.
pub(super) fn check(options: &[(&'static str, f64, f64, f64)]) -> Result<(), MappingError> {
    for &(name, value, least, most) in options {
        if !(value >= least && value <= most) {
            return Err(MappingError::Option { name, value, least, most });
        }
    }
    Ok(())
}

/// Checks that a pose is finite, normalised and not too far out.
pub(super) fn check_pose(
    what: &'static str,
    index: usize,
    pose: &Isometry2<f64>,
) -> Result<(), MappingError> {
    let near = pose.translation.vector.iter().all(|c| c.abs() <= FARTHEST_M);
    let turn = pose.rotation.complex().norm();
    if near && (turn - 1.0).abs() < 1e-6 { Ok(()) } else { Err(MappingError::Pose { what, index }) }
}
