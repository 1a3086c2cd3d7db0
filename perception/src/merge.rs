//! Clouds of several views in one (paper 004, section V, "Point Cloud Merging and Alignment").

use crate::cloud::Cloud;
use crate::visibility::Visibility;
use nalgebra::{Isometry3, Unit, Vector3};
use serde::{Deserialize, Serialize};

/// How to merge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MergeOptions {
    /// Up in the world, if known.
    pub up: Option<Unit<Vector3<f64>>>,
    /// Least and greatest height along `up` of what is merged, metres; outside it points are dropped.
    pub height_band_m: Option<(f64, f64)>,
    /// Returns farther from their camera than this are dropped, metres.
    pub range_m: f64,
    /// Side of the voxels in which clouds are aligned, metres (paper: 1 cm).
    pub align_voxel_m: f64,
    /// Side of the voxels in which points are fused, metres: the resolution of the merged cloud.
    pub fuse_voxel_m: f64,
    /// Most points of the merged cloud; beyond it the fusing voxels grow.
    pub most_points: usize,
}

impl Default for MergeOptions {
    fn default() -> Self {
        MergeOptions {
            up: None,
            height_band_m: None,
            range_m: 4.0,
            align_voxel_m: 0.01,
            fuse_voxel_m: 0.002,
            most_points: 2_000_000,
        }
    }
}

/// How one view was brought into the common frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewFit {
    /// The corrected pose.
    pub world_from_camera: Isometry3<f64>,
    /// How far the camera moved from where localisation had it, metres.
    pub moved_m: f64,
    /// How far it turned, radians.
    pub moved_rad: f64,
    /// Downsampled points with a partner in another view.
    pub matched: usize,
    /// Root mean square distance of those from the partners' planes, metres.
    pub residual_m: f64,
    /// True if the correction settled.
    pub converged: bool,
    /// False if the view was left out of the merged cloud.
    pub used: bool,
    /// Why it converged, or was left out, in words.
    pub why: String,
}

/// What one of the five steps did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Its name.
    pub name: String,
    /// Points after it.
    pub points: usize,
    /// What it found, in words.
    pub result: String,
}

/// The merged cloud and how it came about.
#[derive(Clone, Debug)]
pub struct Merged {
    /// All used views in one cloud, world frame, without grid; normals face a camera that saw them.
    pub cloud: Cloud,
    /// A point's number of views that measured it.
    pub views_per_point: Vec<u16>,
    /// What the used views saw, with corrected poses.
    pub visibility: Visibility,
    /// One fit a view, in the order given.
    pub fits: Vec<ViewFit>,
    /// The steps, in order.
    pub steps: Vec<Step>,
}

/// Views that cannot be merged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MergeError {
    /// There was no view.
    #[error("no view to merge: give at least one")]
    NoViews,
    /// Options that mean nothing.
    #[error("merge option `{field}` is {value}: expected {expected}")]
    Option {
        /// The option.
        field: &'static str,
        /// What was given.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
    /// A pose that is not finite.
    #[error("the pose of view {view} is not finite: leave the view out or mend its transform")]
    Pose {
        /// Index of the view.
        view: usize,
    },
    /// No view has a point that can be used.
    #[error(
        "none of the {views} views has a point within {range_m} m{band}: check range, height band and units"
    )]
    Empty {
        /// Number of views.
        views: usize,
        /// The range limit, metres.
        range_m: f64,
        /// Words about the height band, or nothing.
        band: String,
    },
}
