//! Keyframes: selection of sufficiently different views, and their registration (section IV-C).
//!
//! The paper tracks the camera from frame to frame and adjusts all keyframes in the end. Here all keyframes are aligned
//! together, with each other and with the localised poses, as [`crate::merge`] does; one that contradicts the others is
//! left out with a reason. Then texture aligns what surfaces leave undetermined, and surfaces are aligned once more
//! from there.

use super::error::LearningError;
use super::photometric;
use crate::merge::{self, MergeOptions};
use crate::view::View;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

/// Registered pose of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct Keyframe {
    /// Corrected pose of the camera, metres.
    pub world_from_camera: Isometry3<f64>,
    /// False if the view does not fit the others.
    pub used: bool,
    /// Reason why the view was used or left out.
    pub why: String,
}

/// Indices of the keyframes: the first view, and each whose direction from `centre` (world, metres)
/// differs by more than `step_rad` from all earlier keyframes (paper: 15 degrees).
pub fn keyframes(poses: &[Isometry3<f64>], centre: &Point3<f64>, step_rad: f64) -> Vec<usize> {
    let direction = |i: usize| poses[i].translation.vector - centre.coords;
    let mut kept: Vec<usize> = Vec::new();
    for i in 0..poses.len() {
        if kept.iter().all(|&k| direction(i).angle(&direction(k)) > step_rad) {
            kept.push(i);
        }
    }
    kept
}

/// Registers views. `up`: up direction in the world; `range_m`: maximum range of the points used, metres.
///
/// # Errors
/// If there is no view, no usable point, or a pose that is not finite.
pub fn register(
    views: &[View],
    up: Option<Unit<Vector3<f64>>>,
    range_m: f64,
) -> Result<Vec<Keyframe>, LearningError> {
    let options = MergeOptions { up, range_m, ..MergeOptions::default() };
    let fits = merge::align_views(views, &options)?;
    let poses: Vec<Isometry3<f64>> = fits.iter().map(|f| f.world_from_camera).collect();
    let used: Vec<bool> = fits.iter().map(|f| f.used).collect();
    let by_texture = photometric::refined(views, &poses, &used, range_m);
    // Surfaces have the last word where they say anything; where they let looks slide, these stay as texture has them.
    let stated = |(view, pose): (&View, &Isometry3<f64>)| View { world_from_camera: *pose, ..view.clone() };
    let again: Vec<View> = views.iter().zip(&by_texture).map(stated).collect();
    let settled = merge::align_views(&again, &options)?;
    let poses = settled.iter().zip(&by_texture).map(|(s, p)| if s.used { s.world_from_camera } else { *p });
    let keyframe = |(fit, world_from_camera): (merge::ViewFit, Isometry3<f64>)| Keyframe {
        world_from_camera,
        used: fit.used,
        why: fit.why,
    };
    Ok(fits.into_iter().zip(poses).map(keyframe).collect())
}
