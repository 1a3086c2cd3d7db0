//! View of a scene, prepared for recognition.

use super::error::KnowError;
use super::surfels::{STEP_M, Surfels};
use crate::cloud::{Cloud, is_finite};
use crate::draw::Draws;
use crate::neighbours::Neighbours;
use crate::normals::{self, OrganisedOptions};
use crate::plane::{self, PlaneOptions};
use crate::register::Prepared;
use crate::view::View;
use crate::visibility::DepthMap;
use nalgebra::{Isometry3, Point3};

/// View of a scene in the camera frame, as surfels.
pub struct SceneView {
    pub surfels: Surfels,
    /// For each surfel, true if it lies on a plane wider than any model.
    pub wide: Vec<bool>,
    /// The surfels, prepared as the target of registration.
    pub target: Prepared,
    map: DepthMap,
}

const NORMALS: OrganisedOptions =
    OrganisedOptions { reach: 3, depth_step_share: 0.015, base_m: 0.006, least: 12 };
/// Number of neighbours from which normals are estimated, for unorganised clouds and for registration.
const NEIGHBOURS: usize = 20;
/// Maximum number of wide planes.
const PLANES: usize = 6;
/// Maximum distance of a point from its wide plane, metres.
const PLANE_M: f32 = 0.012;
/// Minimum cosine between the normals of a point and of its wide plane.
const LEVEL: f32 = 0.85;

impl SceneView {
    /// Prepares the points within `range_m` of the camera; planes of more than `widest_m2` square metres belong to no
    /// object.
    pub fn new(view: &View, range_m: f64, widest_m2: f64) -> Result<SceneView, KnowError> {
        let map = DepthMap::from_view(view, &Isometry3::identity()).ok_or(KnowError::NoCamera)?;
        let near = |p: &Point3<f32>| is_finite(p) && f64::from(p.z) <= range_m;
        let cloud = match view.cloud.grid {
            Some(_) => normals::organised(&view.cloud, &NORMALS).map(|n| n.normals),
            None => {
                let tree = Neighbours::new(&view.cloud.points)?;
                Some(normals::estimate(&tree, NEIGHBOURS, &Point3::origin()).normals)
            }
        };
        let surfels = Surfels::of(&Cloud { normals: cloud, ..view.cloud.clone() }.filter(near))?;
        let target = Prepared::with_normals(&surfels.points, NEIGHBOURS)?;
        let wide = wide(&surfels, widest_m2);
        Ok(SceneView { surfels, wide, target, map })
    }

    /// Depth at the pixel of a camera-frame point, and minimum depth around that pixel, metres; `None` outside the
    /// image or where nothing was measured.
    pub fn around(&self, p: &Point3<f64>) -> Option<(f32, f32)> {
        let (u, v) = self.map.intrinsics.project(p)?;
        let pixel = self.map.intrinsics.pixel(u, v)?;
        let nearest = self.map.nearest_around(pixel);
        if !nearest.is_finite() {
            return None;
        }
        let here = self.map.depths_m[pixel];
        Some((if here.is_nan() { nearest } else { here }, nearest))
    }
}

fn wide(surfels: &Surfels, widest_m2: f64) -> Vec<bool> {
    let mut wide = vec![false; surfels.points.len()];
    let least = (widest_m2 / f64::from(STEP_M * STEP_M)) as usize;
    let mut draws = Draws::new(0);
    for _ in 0..PLANES {
        let open: Vec<usize> = (0..wide.len()).filter(|&i| !wide[i]).collect();
        if open.len() < least.max(3) {
            break;
        }
        let points: Vec<Point3<f32>> = open.iter().map(|&i| surfels.points[i]).collect();
        let options =
            PlaneOptions { tolerance_m: PLANE_M, rounds: 300, seed: draws.next(), ..PlaneOptions::default() };
        let Ok(fit) = plane::find(&points, &options) else { break };
        let normal = fit.plane.facing(&Point3::origin()).normal.cast::<f32>();
        let on: Vec<usize> = fit
            .inliers
            .iter()
            .map(|&i| open[i as usize])
            .filter(|&i| surfels.normals[i].dot(&normal) > LEVEL)
            .collect();
        if on.len() < least.max(3) {
            break;
        }
        on.into_iter().for_each(|i| wide[i] = true);
    }
    wide
}
