//! Options of a merge, and the check of its input.

use super::error::MergeError;
use crate::surface::Region;
use crate::view::View;
use nalgebra::{Unit, Vector3};
use serde::{Deserialize, Serialize};

/// Options of a merge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MergeOptions {
    /// Up direction in the world, if known.
    pub up: Option<Unit<Vector3<f64>>>,
    /// Height range along `up` of the merged points, metres; points outside are dropped.
    pub height_band_m: Option<(f64, f64)>,
    /// Region, seen along `up`, to which the merged cloud is limited; views are aligned by all
    /// their points.
    pub region: Option<Region>,
    /// Returns farther from their camera than this are dropped, metres. From: chosen.
    pub range_m: f64,
    /// Side of the voxels in which clouds are aligned, metres. From: paper, 004, section V, step 2.
    pub align_voxel_m: f64,
    /// Side of the voxels in which points are fused, metres: the resolution of the merged cloud. From: chosen.
    pub fuse_voxel_m: f64,
    /// Maximum number of points of the merged cloud; above it, the fusing voxels grow. From:
    /// chosen.
    pub most_points: usize,
}

impl Default for MergeOptions {
    fn default() -> Self {
        MergeOptions {
            up: None,
            height_band_m: None,
            region: None,
            range_m: 3.5,
            align_voxel_m: 0.01,
            fuse_voxel_m: 0.003,
            most_points: 2_000_000,
        }
    }
}

impl MergeOptions {
    /// Checks the options and the poses of the views.
    pub(super) fn check(&self, views: &[View]) -> Result<(), MergeError> {
        if views.is_empty() {
            return Err(MergeError::NoViews);
        }
        let positive = [
            ("range_m", self.range_m),
            ("align_voxel_m", self.align_voxel_m),
            ("fuse_voxel_m", self.fuse_voxel_m),
            ("most_points", self.most_points as f64),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(MergeError::Option { field, value, expected: "a positive number" });
            }
        }
        let finite = |v: &View| v.world_from_camera.to_homogeneous().iter().all(|x| x.is_finite());
        match views.iter().position(|v| !finite(v)) {
            Some(view) => Err(MergeError::Pose { view }),
            None => Ok(()),
        }
    }
}
