//! View: cloud, camera pose and its uncertainty.

use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

/// View: cloud and camera pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Time of the view, nanoseconds in the clock of the recording.
    pub stamp_ns: i64,
    /// The cloud in the camera's optical frame (x right, y down, z forward), metres.
    pub cloud: Cloud,
    /// Camera, if known; enables the distinction of free and unobserved space.
    pub intrinsics: Option<Intrinsics>,
    /// Pose of the camera as stated by localisation.
    pub world_from_camera: Isometry3<f64>,
    /// Standard deviation of the camera's position along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of the camera's orientation about each axis, radians.
    pub pose_sigma_rad: f64,
}

impl View {
    /// View of a bare cloud, with the world as the camera's frame.
    pub fn alone(cloud: Cloud) -> View {
        View {
            stamp_ns: 0,
            cloud,
            intrinsics: None,
            world_from_camera: Isometry3::identity(),
            pose_sigma_m: 0.0,
            pose_sigma_rad: 0.0,
        }
    }
}
