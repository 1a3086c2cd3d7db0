//! A surface with the objects on it, and the options of segmentation.

use crate::quantile::{POINT_ENDS, end};
use crate::surface::{Surface, SurfaceOptions, TALLEST_M};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// The options of the segmentation of a scene into objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneOptions {
    /// The options of the search for the surface.
    pub surface: SurfaceOptions,
    /// Minimum height above the surface of an object's point, metres; rough surfaces raise it.
    /// From: chosen.
    pub clearance_m: f64,
    /// Maximum height above the surface of a point that belongs to an object, metres.
    pub tallest_m: f64,
    /// Side of the voxels, metres. Objects that stand twice as far apart are always separate. From: chosen.
    pub voxel_m: f64,
    /// Minimum number of points of an object. From: chosen.
    pub fewest_points: usize,
    /// Minimum height of an object's top above its support, metres. From: chosen.
    pub least_height_m: f64,
    /// True if touching objects are separated at concave creases.
    pub part_touching: bool,
}

impl Default for SceneOptions {
    fn default() -> Self {
        SceneOptions {
            surface: SurfaceOptions::default(),
            clearance_m: 0.008,
            tallest_m: TALLEST_M,
            voxel_m: 0.008,
            fewest_points: 60,
            least_height_m: 0.025,
            part_touching: true,
        }
    }
}

/// One object: points that belong together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Indices into the cloud that was segmented, ascending.
    pub indices: Vec<u32>,
    /// Points in the surface's frame (z is the height above the surface), metres, in the order of `indices`.
    #[serde(skip)]
    pub points: Vec<Point3<f64>>,
    /// Height of the object's support above the surface, metres: 0 on the surface itself, more on
    /// another object.
    pub base_m: f64,
    /// Standard deviation of `base_m`, metres; large for an object inside another, whose foot is
    /// invisible.
    #[serde(default)]
    pub base_sigma_m: f64,
}

impl Segment {
    /// Union with another segment, in order of the indices, on the support of the lower one.
    pub(crate) fn with(&self, other: &Segment) -> Segment {
        let count = self.indices.len() + other.indices.len();
        let lower = if other.base_m < self.base_m { other } else { self };
        let mut both = Segment {
            indices: Vec::with_capacity(count),
            points: Vec::with_capacity(count),
            base_m: lower.base_m,
            base_sigma_m: lower.base_sigma_m,
        };
        let (mut i, mut j) = (0, 0);
        while i < self.indices.len() || j < other.indices.len() {
            let is_own =
                other.indices.get(j).is_none_or(|next| self.indices.get(i).is_some_and(|own| own <= next));
            let (from, at) = if is_own { (self, &mut i) } else { (other, &mut j) };
            both.indices.push(from.indices[*at]);
            both.points.push(from.points[*at]);
            *at += 1;
        }
        both
    }
}

/// Surface with the objects on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Surface that the objects stand on.
    pub surface: Surface,
    /// The objects, most points first.
    pub segments: Vec<Segment>,
}

/// Height of a segment's top above the surface, metres: high quantile that excludes noise.
pub fn top_m(segment: &Segment) -> f64 {
    let heights: Vec<f64> = segment.points.iter().map(|p| p.z).collect();
    end(&heights, POINT_ENDS.1)
}
