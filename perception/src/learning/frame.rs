//! Prepared view: the points near the object in the world frame, with normals.

use super::mask::Mask;
use crate::cloud::{Cloud, Grid, is_finite};
use crate::normals::{self, OrganisedOptions};
use crate::view::View;
use crate::visibility::DepthMap;
use nalgebra::{Isometry3, Point3, Vector3};

/// View of the object, prepared for learning.
pub(super) struct Frame {
    pub map: DepthMap,
    pub grid: Grid,
    /// Points in the world frame, row by row; NaN where no point near the object was measured.
    pub points: Vec<Point3<f32>>,
    /// Unit normals in the world frame, towards the camera.
    pub normals: Vec<Vector3<f32>>,
    pub colours: Option<Vec<[u8; 3]>>,
    /// Pixels with a point and a normal near the object.
    pub near: Vec<u32>,
}

/// Window options of the normals, wide because single measurements are noisy.
const WIDE: OrganisedOptions =
    OrganisedOptions { reach: 3, depth_step_share: 0.015, base_m: 0.006, least: 12 };

/// Maximum half width of a pixel neighbourhood, pixels; more would mean an object too near to measure.
const WIDEST_PX: f64 = 32.0;

impl Frame {
    /// Prepares the pixels of a view within `reach_m` of `centre` (world, metres); `None` without a depth image.
    pub fn new(
        view: &View,
        world_from_camera: &Isometry3<f64>,
        centre: &Point3<f64>,
        reach_m: f64,
    ) -> Option<Frame> {
        let grid = view.cloud.grid?;
        let map = DepthMap::from_view(view, world_from_camera)?;
        let in_camera = world_from_camera.inverse() * centre;
        let (middle, reach_sq) = (in_camera.cast::<f32>(), (reach_m * reach_m) as f32);
        let none = Point3::new(f32::NAN, f32::NAN, f32::NAN);
        let close = |p: &Point3<f32>| is_finite(p) && (p - middle).norm_squared() <= reach_sq;
        let near = Cloud {
            points: view.cloud.points.iter().map(|p| if close(p) { *p } else { none }).collect(),
            grid: Some(grid),
            ..Cloud::default()
        };
        let normals = normals::organised(&near, &WIDE)?.normals;
        let world = Cloud { normals: Some(normals), ..near }.transformed(world_from_camera);
        let normals = world.normals?;
        let near = (0..world.points.len())
            .filter(|&i| is_finite(&world.points[i]) && normals[i].x.is_finite())
            .map(|i| i as u32)
            .collect();
        let colours = view.cloud.colours.clone();
        Some(Frame { map, grid, points: world.points, normals, colours, near })
    }

    /// Depth of a pixel along the optical axis, metres.
    pub fn depth_m(&self, pixel: usize) -> f64 {
        f64::from(self.map.depths_m[pixel])
    }

    /// Angle between the surface normal at a pixel and the direction to the camera, radians, 0 to π/2.
    pub fn angle_rad(&self, pixel: usize) -> f64 {
        let ray = self.map.viewpoint() - self.points[pixel].cast::<f64>();
        let cosine = self.normals[pixel].cast::<f64>().dot(&ray.normalize());
        cosine.clamp(0.0, 1.0).acos()
    }

    /// Pixels of a mask as a cloud in the world frame, with normals and colours.
    pub fn cloud(&self, mask: &Mask) -> Cloud {
        Cloud {
            points: mask.pixels().map(|i| self.points[i]).collect(),
            normals: Some(mask.pixels().map(|i| self.normals[i]).collect()),
            colours: self.colours.as_ref().map(|c| mask.pixels().map(|i| c[i]).collect()),
            ..Cloud::default()
        }
    }

    /// Calls `found` with each pixel of a square around the given one that contains all points within `radius_m`; the
    /// square reaches at most [`WIDEST_PX`] to each side.
    pub fn around(&self, pixel: usize, radius_m: f32, mut found: impl FnMut(usize)) {
        let Grid { width, height } = self.grid;
        let (u, v) = (pixel % width, pixel / width);
        let half = (f64::from(radius_m) * self.map.intrinsics.fx / self.depth_m(pixel)).ceil();
        let half = half.clamp(1.0, WIDEST_PX) as usize;
        for row in v.saturating_sub(half)..(v + half + 1).min(height) {
            for column in u.saturating_sub(half)..(u + half + 1).min(width) {
                found(row * width + column);
            }
        }
    }
}
