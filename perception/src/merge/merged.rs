//! Result of a merge: the cloud, the fit of each view, and the steps.

use crate::cloud::Cloud;
use crate::visibility::Visibility;
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

/// Alignment of one view with the common frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewFit {
    /// Corrected pose of the camera in the world.
    pub world_from_camera: Isometry3<f64>,
    /// Shift of the camera from its localised pose, metres.
    pub moved_m: f64,
    /// Rotation of the camera from its localised pose, radians.
    pub moved_rad: f64,
    /// Number of correspondences of thinned points with other views.
    pub matched: usize,
    /// Root mean square point-to-plane distance of the correspondences, metres.
    pub residual_m: f64,
    /// True if the alignment converged, or the view had nothing to align with.
    pub converged: bool,
    /// False if the view was left out of the merged cloud.
    pub used: bool,
    /// True if the view was left out because it contradicts the others.
    #[serde(default)]
    pub is_at_odds: bool,
    /// Result of the alignment, or the reason why the view was left out, in words.
    pub why: String,
}

/// Report of one step of a merge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Name of the step.
    pub name: String,
    /// Number of points after the step.
    pub points: usize,
    /// Result of the step, in words.
    pub result: String,
}

/// Merged cloud with diagnostics.
#[derive(Clone, Debug)]
pub struct Merged {
    /// All used views in one cloud, world frame, without grid; normals face an observing camera.
    pub cloud: Cloud,
    /// Number of views that measured each point.
    pub views_per_point: Vec<u16>,
    /// Visibility of the used views, with corrected poses.
    pub visibility: Visibility,
    /// One fit per view, in the order given.
    pub fits: Vec<ViewFit>,
    /// Reports of the steps, in order.
    pub steps: Vec<Step>,
}

impl Merged {
    /// Result in another frame: cloud, poses and visibility.
    pub fn moved(mut self, there_from_world: &Isometry3<f64>) -> Merged {
        self.cloud = self.cloud.transformed(there_from_world);
        for fit in &mut self.fits {
            fit.world_from_camera = there_from_world * fit.world_from_camera;
        }
        let world_from_there = there_from_world.inverse();
        for map in &mut self.visibility.maps {
            map.camera_from_world *= world_from_there;
        }
        self
    }
}
