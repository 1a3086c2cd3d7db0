//! Steps 1 and 2: each view into points with normals, thinned to voxels, in its own camera frame.

use super::MergeOptions;
use crate::cloud::{Cloud, Grid, is_finite};
use crate::neighbours::Neighbours;
use crate::normals;
use crate::surface::range_sigma_m;
use crate::view::View;
use crate::voxel;
use nalgebra::{Isometry3, Point3, Vector3};

/// Columns of the image in which points for the alignment are sought; more tells no more at a voxel of 1 cm.
const COLUMNS: usize = 216;

/// A view as the alignment sees it.
pub(super) struct Prepared {
    /// Thinned points, camera frame, metres.
    pub points: Vec<Point3<f64>>,
    /// Their unit normals, towards the camera.
    pub normals: Vec<Vector3<f64>>,
    /// Spread of each measurement, metres.
    pub sigmas_m: Vec<f64>,
    /// The points as a search tree; none if there are more than it can hold.
    pub tree: Option<Neighbours>,
    /// Where localisation has the camera.
    pub prior: Isometry3<f64>,
    /// Spread of that position, metres.
    pub sigma_m: f64,
    /// Spread of that orientation, radians.
    pub sigma_rad: f64,
}

/// True if the return (camera frame) is one, and in range.
#[inline(always)]
pub(super) fn in_range(p: &Point3<f32>, options: &MergeOptions) -> bool {
    is_finite(p) && f64::from(p.coords.norm()) <= options.range_m
}

/// True if the place (world frame) lies in the height band widened by `slack_m`, or there is none.
#[inline(always)]
pub(super) fn in_band(p: &Vector3<f64>, options: &MergeOptions, slack_m: f64) -> bool {
    match (options.up, options.height_band_m) {
        (Some(up), Some((low, high))) => {
            let height = up.dot(p);
            height >= low - slack_m && height <= high + slack_m
        }
        _ => true,
    }
}

/// Filters and thins one view. A view without usable points gives an empty one.
pub(super) fn prepare(view: &View, options: &MergeOptions) -> Prepared {
    // What localisation does not state is taken as the paper's robot: a few centimetres and degrees.
    let sigma_m = if view.pose_sigma_m > 0.0 { view.pose_sigma_m } else { 0.03 };
    let sigma_rad = if view.pose_sigma_rad > 0.0 { view.pose_sigma_rad } else { 0.035 };
    let slack_m = 3.0 * sigma_m + 0.05;
    let (cloud, normals) = with_normals(view, options, slack_m);
    let mut points = Vec::new();
    let mut kept_normals = Vec::new();
    let mut seen = rustc_hash::FxHashSet::default();
    for (p, n) in cloud.points.iter().zip(&normals) {
        if !n.x.is_finite() {
            continue;
        }
        let key = [p.x, p.y, p.z].map(|c| (f64::from(c) / options.align_voxel_m).floor() as i32);
        if seen.insert(key) {
            points.push(p.cast::<f64>());
            kept_normals.push(n.cast::<f64>());
        }
    }
    let single: Vec<Point3<f32>> = points.iter().map(|p| p.cast()).collect();
    let tree = Neighbours::new(&single).ok();
    Prepared {
        sigmas_m: points.iter().map(|p| range_sigma_m(p.coords.norm()).min(0.03)).collect(),
        points,
        normals: kept_normals,
        tree,
        prior: view.world_from_camera,
        sigma_m,
        sigma_rad,
    }
}

/// A coarser copy of what is to be merged with its normals: from the grid if it has one, else from the nearest points of a thinned cloud.
fn with_normals(view: &View, options: &MergeOptions, slack_m: f64) -> (Cloud, Vec<Vector3<f32>>) {
    let pose = &view.world_from_camera;
    if let Some(coarse) = coarser(view, pose, options, slack_m) {
        let wide = normals::OrganisedOptions { reach: 2, depth_step_share: 0.025, base_m: 0.008, least: 8 };
        if let Some(found) = normals::organised(&coarse, &wide) {
            return (coarse, found.normals);
        }
    }
    let kept = view
        .cloud
        .filter(|p| in_range(p, options) && in_band(&(pose * p.cast::<f64>()).coords, options, slack_m));
    let thin = voxel::downsample(&kept, options.align_voxel_m as f32).unwrap_or(kept);
    match Neighbours::new(&thin.points) {
        Ok(tree) => {
            let found = normals::estimate(&tree, 15, &Point3::origin());
            (thin, found.normals)
        }
        Err(_) => (Cloud::default(), Vec::new()),
    }
}

/// Every nth row and column of an organised cloud; what is out of range, or out of the band widened by `slack_m`, is no return.
pub(super) fn coarser(
    view: &View,
    pose: &Isometry3<f64>,
    options: &MergeOptions,
    slack_m: f64,
) -> Option<Cloud> {
    let Grid { width, height } = view.cloud.grid?;
    let stride = (width / COLUMNS).max(1);
    let (columns, rows) = (width / stride, height / stride);
    let pixels = (0..rows).flat_map(|r| (0..columns).map(move |c| r * stride * width + c * stride));
    let turn = pose.rotation.to_rotation_matrix();
    let point = |i: usize| {
        let p = view.cloud.points[i];
        let keeps = || in_band(&(turn * p.coords.cast::<f64>() + pose.translation.vector), options, slack_m);
        if in_range(&p, options) && keeps() { p } else { Point3::new(f32::NAN, f32::NAN, f32::NAN) }
    };
    Some(Cloud {
        points: pixels.map(point).collect(),
        grid: Some(Grid { width: columns, height: rows }),
        ..Cloud::default()
    })
}
