//! View: cloud, camera pose and uncertainty of the pose.

use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

/// Cloud with the pose of the camera that measured it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Time of the view, nanoseconds in the clock of the recording.
    pub stamp_ns: i64,
    /// Cloud in the camera's optical frame (x right, y down, z forward), metres.
    pub cloud: Cloud,
    /// Camera intrinsics, if known; they allow free space to be told from unobserved space.
    pub intrinsics: Option<Intrinsics>,
    /// Pose of the camera as stated by localisation, metres.
    pub world_from_camera: Isometry3<f64>,
    /// Standard deviation of the camera's position along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of the camera's orientation about each axis, radians.
    pub pose_sigma_rad: f64,
}

impl View {
    /// Creates a view of a bare cloud, with the world frame as the camera's optical frame.
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
