//! Sweep of a planar laser.

use nalgebra::{Isometry2, Point2, Vector2};
use serde::{Deserialize, Serialize};

/// Sweep of a planar laser: ranges at angles, with the stated pose of the laser.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scan {
    /// Angles, ascending anticlockwise from the laser's x axis, within a full turn, radians.
    pub angles_rad: Vec<f64>,
    /// Range at each angle, metres. Infinite: nothing within reach (serialised as null). NaN, zero
    /// or negative: no reading, no information (serialised as 0).
    #[serde(with = "ranges")]
    pub ranges_m: Vec<f64>,
    /// Stated pose of the laser in the map, metres.
    pub map_from_laser: Isometry2<f64>,
}

/// Reason why a scan cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScanError {
    /// The numbers of angles and ranges differ.
    #[error("{ranges} ranges for {angles} angles: give one range an angle")]
    Lengths {
        /// Number of angles.
        angles: usize,
        /// Number of ranges.
        ranges: usize,
    },
    /// The angles do not ascend, are not finite, or exceed a full turn.
    #[error(
        "angle {index} is {angle_rad} rad: give finite angles that ascend, over no more than a full turn (6.283 rad)"
    )]
    Angle {
        /// Index of the first faulty angle.
        index: usize,
        /// Value of that angle, radians.
        angle_rad: f64,
    },
    /// The pose is not finite, or its rotation is invalid.
    #[error("the pose of the laser is not finite: give metres and radians")]
    Pose,
}

impl Scan {
    /// Checks that angles, ranges and pose are consistent.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(&self) -> Result<(), ScanError> {
        let (angles, ranges) = (self.angles_rad.len(), self.ranges_m.len());
        if angles != ranges {
            return Err(ScanError::Lengths { angles, ranges });
        }
        let first = self.angles_rad.first().copied().unwrap_or(0.0);
        let mut before = f64::NEG_INFINITY;
        for (index, &angle_rad) in self.angles_rad.iter().enumerate() {
            let within = angle_rad - first < std::f64::consts::TAU + 1e-9;
            if !(angle_rad.is_finite() && angle_rad > before && within) {
                return Err(ScanError::Angle { index, angle_rad });
            }
            before = angle_rad;
        }
        if !is_pose(&self.map_from_laser) {
            return Err(ScanError::Pose);
        }
        Ok(())
    }

    /// End point of a reading in the laser frame, metres; `None` if the laser measured nothing there.
    pub fn endpoint(&self, index: usize) -> Option<Point2<f64>> {
        let (angle, range) = (*self.angles_rad.get(index)?, *self.ranges_m.get(index)?);
        (range > 0.0 && range.is_finite()).then(|| Point2::from(direction(angle) * range))
    }
}

/// Serialisation of ranges, with infinity as null, which JSON lacks.
mod ranges {
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(ranges_m: &[f64], to: S) -> Result<S::Ok, S::Error> {
        let written = |r: &f64| match *r {
            r if r.is_nan() => Some(0.0),
            r => r.is_finite().then_some(r),
        };
        to.collect_seq(ranges_m.iter().map(written))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        let written: Vec<Option<f64>> = Vec::deserialize(from)?;
        Ok(written.into_iter().map(|r| r.unwrap_or(f64::INFINITY)).collect())
    }
}

/// True if a pose is finite and its rotation a unit complex number.
pub(super) fn is_pose(pose: &Isometry2<f64>) -> bool {
    let turn = pose.rotation.complex();
    let finite = pose.translation.vector.iter().all(|c| c.is_finite());
    finite && (turn.re * turn.re + turn.im * turn.im - 1.0).abs() < 1e-6
}

/// Unit vector at an angle, anticlockwise from the x axis.
pub(super) fn direction(angle_rad: f64) -> Vector2<f64> {
    Vector2::new(angle_rad.cos(), angle_rad.sin())
}

/// Position of the laser at a pose.
pub(super) fn origin(pose: &Isometry2<f64>) -> Point2<f64> {
    pose.translation.vector.into()
}
