//! Steps 1 and 2: each view into points with normals, thinned to voxels, in its own camera frame.

use super::MergeOptions;
use crate::cloud::{Cloud, Grid};
use crate::neighbours::Neighbours;
use crate::normals;
use crate::surface::range_sigma_m;
use crate::view::View;
use crate::voxel;
use nalgebra::{Isometry3, Point3, Vector3};

/// Columns of the image in which points for the alignment are sought; more tells no more at a voxel of 1 cm.
const COLUMNS: usize = 216;

/// Normals for the alignment: of many pixels, since one measurement is vague.
const WIDE: normals::OrganisedOptions =
    normals::OrganisedOptions { reach: 2, depth_step_share: 0.025, base_m: 0.008, least: 8 };

/// A view as the alignment sees it.
pub(super) struct Prepared {
    /// Thinned points, camera frame, metres, in the order of the tree.
    pub points: Vec<Point3<f64>>,
    /// Their unit normals, towards the camera.
    pub normals: Vec<Vector3<f64>>,
    /// Spread of each measurement, metres.
    pub sigmas_m: Vec<f64>,
    /// The points as a search tree; none, and no points, if there are more than it can hold.
    pub tree: Option<Neighbours>,
    /// What is to be merged of an organised cloud, coarser, with normals in the camera frame.
    pub coarse: Option<Cloud>,
    /// Where localisation has the camera.
    pub prior: Isometry3<f64>,
    /// Spread of that position, metres.
    pub sigma_m: f64,
    /// Spread of that orientation, radians.
    pub sigma_rad: f64,
}

/// What of a camera's returns is merged, told in its own frame.
pub(super) struct Within {
    /// Height is this along the point, and between these, metres.
    up: Vector3<f32>,
    heights_m: (f32, f32),
    range_sq: f32,
}

impl Within {
    /// In range and in the height band, widened by `slack_m`, of a camera at a pose.
    pub fn of(world_from_camera: &Isometry3<f64>, options: &MergeOptions, slack_m: f64) -> Within {
        let (up, heights_m) = match (options.up, options.height_band_m) {
            (Some(up), Some((low, high))) => {
                let camera = up.dot(&world_from_camera.translation.vector);
                let up = world_from_camera.rotation.inverse() * up.into_inner();
                (up, (low - slack_m - camera, high + slack_m - camera))
            }
            _ => (Vector3::zeros(), (f64::NEG_INFINITY, f64::INFINITY)),
        };
        Within {
            up: up.cast(),
            heights_m: (heights_m.0 as f32, heights_m.1 as f32),
            range_sq: (options.range_m * options.range_m) as f32,
        }
    }

    /// False also for what is no return.
    #[inline(always)]
    pub fn holds(&self, [x, y, z]: [f32; 3]) -> bool {
        let height = self.up.x * x + self.up.y * y + self.up.z * z;
        (x * x + y * y + z * z <= self.range_sq) & (height >= self.heights_m.0) & (height <= self.heights_m.1)
    }
}

/// Filters and thins one view. A view without usable points gives an empty one.
pub(super) fn prepare(view: &View, options: &MergeOptions) -> Prepared {
    // What localisation does not state is taken as the paper's robot: a few centimetres and degrees.
    let sigma_m = if view.pose_sigma_m > 0.0 { view.pose_sigma_m } else { 0.03 };
    let sigma_rad = if view.pose_sigma_rad > 0.0 { view.pose_sigma_rad } else { 0.035 };
    let slack_m = 3.0 * sigma_m + 0.05;
    let within = Within::of(&view.world_from_camera, options, slack_m);
    let coarse = coarser(view, &within, COLUMNS).and_then(|coarse| {
        let normals = Some(normals::organised(&coarse, &WIDE)?.normals);
        Some(Cloud { normals, ..coarse })
    });
    let cloud = coarse.unwrap_or_else(|| thinned(view, &within, options));
    let kept = firsts(&cloud, options.align_voxel_m as f32);
    let tree = Neighbours::new(&kept.points).ok();
    // What is near each other in space is so in memory then, and a slot of the tree is the number of its point.
    let kept = tree.as_ref().map_or_else(Cloud::default, |tree| kept.select(tree.indices()));
    let points: Vec<Point3<f64>> = kept.points.iter().map(|p| p.cast()).collect();
    let normals = kept.normals.iter().flatten().map(|n| n.cast()).collect();
    let coarse = cloud.grid.is_some().then_some(cloud);
    let sigmas_m = points.iter().map(|p| range_sigma_m(p.coords.norm()).min(0.03)).collect();
    Prepared { points, normals, sigmas_m, tree, coarse, prior: view.world_from_camera, sigma_m, sigma_rad }
}

/// The first point of each voxel that has a normal.
fn firsts(cloud: &Cloud, voxel_m: f32) -> Cloud {
    let normals = cloud.normals.iter().flatten();
    let known: Vec<u32> = (0..).zip(normals).filter(|(_, n)| n.x.is_finite()).map(|(k, _)| k).collect();
    let known = cloud.select(&known);
    let Ok(assigned) = voxel::assign(&known.points, voxel_m) else { return known };
    let mut next = 0;
    let mut firsts = Vec::with_capacity(assigned.voxels);
    for (k, voxel) in (0..).zip(assigned.voxel) {
        if voxel == next {
            firsts.push(k);
            next += 1;
        }
    }
    known.select(&firsts)
}

/// What is to be merged of a cloud, thinned, with normals from the nearest points.
fn thinned(view: &View, within: &Within, options: &MergeOptions) -> Cloud {
    let kept = view.cloud.filter(|p| within.holds([p.x, p.y, p.z]));
    let thin = voxel::downsample(&kept, options.align_voxel_m as f32).unwrap_or(kept);
    match Neighbours::new(&thin.points) {
        Ok(tree) => {
            let normals = normals::estimate(&tree, 15, &Point3::origin()).normals;
            Cloud { normals: Some(normals), ..thin }
        }
        Err(_) => Cloud::default(),
    }
}

/// Every nth row and column of an organised cloud, so that about as many columns are left; what is not to be merged is no return.
pub(super) fn coarser(view: &View, within: &Within, about: usize) -> Option<Cloud> {
    const NONE: Point3<f32> = Point3::new(f32::NAN, f32::NAN, f32::NAN);
    let Grid { width, height } = view.cloud.grid?;
    let stride = (width / about).max(1);
    let (columns, rows) = (width / stride, height / stride);
    let mut points = Vec::with_capacity(columns * rows);
    for row in view.cloud.points.chunks_exact(width.max(1)).step_by(stride).take(rows) {
        let pixels = row.iter().step_by(stride).take(columns);
        points.extend(pixels.map(|p| if within.holds([p.x, p.y, p.z]) { *p } else { NONE }));
    }
    Some(Cloud { points, grid: Some(Grid { width: columns, height: rows }), ..Cloud::default() })
}
