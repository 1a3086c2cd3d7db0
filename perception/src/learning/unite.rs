//! Extension of a model by a later encounter (the paper's future work): the new model is registered
//! to the known one, and both are fused.

use super::error::LearningError;
use super::fuse::Measured;
use crate::cloud::Cloud;
use crate::register::{Method, Prepared, RegisterOptions, align};
use nalgebra::Isometry3;

/// Number of neighbours from which a normal is estimated for registration.
const NEIGHBOURS: usize = 20;
/// Maximum correspondence distances of the registration, coarse to fine, metres.
const WITHIN_M: [f32; 2] = [0.02, 0.006];
/// Maximum correction of a recognised pose, metres and radians; beyond it, the recognition was
/// wrong.
const MOST_MOVED: (f64, f64) = (0.03, 0.3);
/// Minimum overlapping share of the smaller model.
const LEAST_SHARED: f64 = 0.35;
/// Maximum root mean square distance in the overlap, metres; models are accurate to two millimetres.
const MOST_OFF_M: f64 = 0.003;

/// Union of two models of one object.
#[derive(Clone, Debug, PartialEq)]
pub struct United {
    /// Points with normals, and with colours if both models had them, in the known model's frame,
    /// metres.
    pub cloud: Cloud,
    /// Pose of the new model in the frame of the known one.
    pub known_from_more: Isometry3<f64>,
    /// Overlapping share of the smaller model.
    pub shared: f64,
    /// Root mean square distance in the overlap, metres.
    pub off_m: f64,
}

/// Registers the model `more` of a later encounter, from the initial pose `known_from_more`, to the `known` model of
/// `meetings` encounters, and fuses both in cubes of `cube_m` metres, each encounter with equal weight.
///
/// # Errors
/// [`LearningError::Disagree`] if the overlap is too small or inexact, or the pose moved too far; errors of
/// registration and fusion.
pub fn united(
    known: &Cloud,
    meetings: u32,
    more: &Cloud,
    known_from_more: &Isometry3<f64>,
    cube_m: f32,
) -> Result<United, LearningError> {
    LearningError::positive("cube_m", f64::from(cube_m))?;
    let target = Prepared::with_normals(&known.points, NEIGHBOURS)?;
    let source = Prepared::new(&more.points)?;
    let mut pose = *known_from_more;
    let mut last = None;
    for within_m in WITHIN_M {
        let options = RegisterOptions {
            method: Method::PointToPlane,
            start_target_from_source: pose,
            within_m,
            rounds: 30,
            robust_m: Some(0.003),
            ..RegisterOptions::default()
        };
        let fit = align(&source, &target, &options)?;
        pose = fit.target_from_source;
        last = Some(fit);
    }
    let matched = last.as_ref().map_or(0, |fit| fit.matched);
    let off_m = last.as_ref().map_or(f64::INFINITY, |fit| fit.residual_m);
    let shared = (matched as f64 / more.len().min(known.len()).max(1) as f64).min(1.0);
    let moved = known_from_more.inverse() * pose;
    let (moved_m, moved_rad) = (moved.translation.vector.norm(), moved.rotation.angle());
    let fits = shared >= LEAST_SHARED && off_m <= MOST_OFF_M;
    if !fits || moved_m > MOST_MOVED.0 || moved_rad > MOST_MOVED.1 {
        return Err(LearningError::Disagree { shared, off_m, moved_m });
    }
    let mut measured = Measured::default();
    measured.carry(known, meetings.max(1));
    measured.carry(&more.transformed(&pose), 1);
    Ok(United { cloud: measured.fused(cube_m, true)?, known_from_more: pose, shared, off_m })
}
