//! Steps 1 and 2: each view becomes points with normals, thinned to voxels, in its own camera
//! frame.

use super::error::MergeError;
use super::merged::Step;
use super::options::MergeOptions;
use crate::cloud::{Cloud, Grid};
use crate::neighbours::Neighbours;
use crate::noise::frontal_sigma_m;
use crate::normals;
use crate::pool;
use crate::surface::floor;
use crate::view::View;
use crate::visibility::DepthMap;
use crate::voxel;
use nalgebra::{Isometry3, Point3, Vector3};
use rustc_hash::FxHashSet;

/// Number of image columns from which alignment points are taken; more add nothing at voxels of 1
/// cm. From: chosen.
const COLUMNS: usize = 216;

/// Normal estimation for alignment, from many pixels because single measurements are noisy.
/// From: chosen.
const WIDE: normals::OrganisedOptions =
    normals::OrganisedOptions { reach: 2, depth_step_share: 0.025, base_m: 0.008, least: 8 };

/// View prepared for alignment.
pub(super) struct Prepared {
    /// Thinned points in the order of the tree.
    pub points: Vec<Surfel>,
    /// Search tree of the points; `None`, and no points, if there are more than the tree can hold.
    pub tree: Option<Neighbours>,
    /// Coarser copy of an organised cloud, with normals in the camera frame; `None` for other
    /// clouds.
    pub coarse: Option<Cloud>,
    /// Localised pose of the camera in the world.
    pub prior: Isometry3<f64>,
    /// Standard deviation of the localised position, metres.
    pub sigma_m: f64,
    /// Standard deviation of the localised orientation, radians.
    pub sigma_rad: f64,
}

/// Surface point with its normal, camera frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surfel {
    /// Position, metres.
    pub at: Point3<f32>,
    /// Unit normal, towards the camera.
    pub normal: Vector3<f32>,
    /// Standard deviation of the measurement, metres.
    pub sigma_m: f32,
}

impl Surfel {
    pub fn at(&self) -> Point3<f64> {
        self.at.cast()
    }

    pub fn normal(&self) -> Vector3<f64> {
        self.normal.cast()
    }
}

/// Bounds of the returns that are merged, in the camera frame.
pub(super) struct Within {
    /// Up direction in the camera frame; zero without height limits.
    up: Vector3<f32>,
    /// Minimum and maximum height along `up`, relative to the camera, metres.
    heights_m: (f32, f32),
    /// Square of the maximum range, square metres.
    range_sq: f32,
    /// Horizontal directions into the region, with the distance at which the region begins along
    /// each, metres.
    pub edges: Vec<(Vector3<f32>, f32)>,
}

impl Within {
    /// Range and height limits, widened by `slack_m`, for a camera at a pose.
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
            edges: Vec::new(),
        }
    }

    /// Limits of the fused returns: those of the merge, and the region.
    pub fn of_fused(world_from_camera: &Isometry3<f64>, options: &MergeOptions) -> Within {
        let within = Within::of(world_from_camera, options, 0.0);
        let (Some(up), Some(region)) = (options.up, &options.region) else { return within };
        let camera = &world_from_camera.translation.vector;
        let in_camera = |(inward, edge_m): (Vector3<f64>, f64)| {
            let least_m = edge_m - region.margin_m - inward.dot(camera);
            ((world_from_camera.rotation.inverse() * inward).cast(), least_m as f32)
        };
        Within { edges: region.edges(&up).into_iter().map(in_camera).collect(), ..within }
    }

    /// True if a point is within range and height limits; false for a missing return.
    #[inline(always)]
    pub fn holds(&self, [x, y, z]: [f32; 3]) -> bool {
        let height = self.up.x * x + self.up.y * y + self.up.z * z;
        (x * x + y * y + z * z <= self.range_sq) & (height >= self.heights_m.0) & (height <= self.heights_m.1)
    }
}

/// Filters and thins one view; without usable points the result is empty.
pub(super) fn prepare(view: &View, options: &MergeOptions) -> Prepared {
    /// Standard deviation of the position of a view that states none, metres. From: chosen, as for
    /// the paper's robot.
    const SIGMA_M: f64 = 0.03;
    /// Standard deviation of the orientation of a view that states none, radians. From: chosen, as
    /// for the paper's robot.
    const SIGMA_RAD: f64 = 0.035;
    /// Margin beyond the height band: standard deviations of localisation, plus metres.
    /// From: chosen.
    const SLACK: (f64, f64) = (3.0, 0.05);
    /// Maximum standard deviation of a measurement, however far away, metres. From: chosen.
    const WORST_SIGMA_M: f32 = 0.03;
    let sigma_m = if view.pose_sigma_m > 0.0 { view.pose_sigma_m } else { SIGMA_M };
    let sigma_rad = if view.pose_sigma_rad > 0.0 { view.pose_sigma_rad } else { SIGMA_RAD };
    let slack_m = SLACK.0 * sigma_m + SLACK.1;
    let within = Within::of(&view.world_from_camera, options, slack_m);
    let coarse = coarser(view, &within, COLUMNS).and_then(|coarse| {
        let normals = Some(normals::organised(&coarse, &WIDE)?.normals);
        Some(Cloud { normals, ..coarse })
    });
    let cloud = coarse.unwrap_or_else(|| thinned(view, &within, options));
    let kept = firsts(&cloud, options.align_voxel_m);
    let tree = Neighbours::new(&kept.points).ok();
    // What is near each other in space is so in memory then, and a slot of the tree is the number of its point.
    let kept = tree.as_ref().map_or_else(Cloud::default, |tree| kept.select(tree.indices()));
    let facing = kept.points.iter().zip(kept.normals.iter().flatten());
    let surfel = |(&at, &normal): (&Point3<f32>, &Vector3<f32>)| Surfel {
        at,
        normal,
        sigma_m: frontal_sigma_m(at.coords.norm()).min(WORST_SIGMA_M),
    };
    let points = facing.map(surfel).collect();
    let coarse = cloud.grid.is_some().then_some(cloud);
    Prepared { points, tree, coarse, prior: view.world_from_camera, sigma_m, sigma_rad }
}

/// First point with a normal in each voxel.
fn firsts(cloud: &Cloud, voxel_m: f64) -> Cloud {
    /// Bits of a voxel along an axis. From: derived, three axes in 64 bits.
    const BITS: u32 = 21;
    /// Mask of the bits of one axis. From: derived, three axes in 64 bits.
    const FULL: u64 = (1 << BITS) - 1;
    let (mut firsts, mut last) = (Vec::new(), None);
    let mut taken = FxHashSet::default();
    let per_m = 1.0 / voxel_m;
    for (k, (p, normal)) in (0..).zip(cloud.points.iter().zip(cloud.normals.iter().flatten())) {
        if !normal.x.is_finite() {
            continue;
        }
        let voxel = [p.x, p.y, p.z].map(|c| floor(f64::from(c) * per_m) as u64 & FULL);
        let voxel = voxel.iter().fold(0, |all, along| all << BITS | along);
        // Most are in the voxel of the point before.
        if last.replace(voxel) != Some(voxel) && taken.insert(voxel) {
            firsts.push(k);
        }
    }
    cloud.select(&firsts)
}

/// Points of a cloud that are merged, thinned, with normals from the nearest points.
fn thinned(view: &View, within: &Within, options: &MergeOptions) -> Cloud {
    /// Number of points for a normal. From: chosen.
    const NEAREST: usize = 15;
    let kept = view.cloud.filter(|p| within.holds([p.x, p.y, p.z]));
    let thin = voxel::downsample(&kept, options.align_voxel_m as f32).unwrap_or(kept);
    match Neighbours::new(&thin.points) {
        Ok(tree) => {
            let normals = normals::estimate(&tree, NEAREST, &Point3::origin()).normals;
            Cloud { normals: Some(normals), ..thin }
        }
        Err(_) => Cloud::default(),
    }
}

/// Organised cloud subsampled to about `about` columns, with excluded pixels as missing returns;
/// `None` for other clouds.
pub(super) fn coarser(view: &View, within: &Within, about: usize) -> Option<Cloud> {
    /// Mark of a pixel without a return. From: mark.
    const NONE: Point3<f32> = Point3::new(f32::NAN, f32::NAN, f32::NAN);
    let Grid { width, height } = view.cloud.grid?;
    let stride = (width / about).max(1);
    let (columns, rows) = (width / stride, height / stride);
    let mut points = Vec::with_capacity(columns * rows);
    for line in view.cloud.points.chunks_exact(width.max(1)).step_by(stride).take(rows) {
        let before = points.len();
        points.resize(before + columns, NONE);
        // Chunks are not empty: the first of each is there.
        for (point, p) in points[before..].iter_mut().zip(line.chunks(stride)) {
            *point = if within.holds([p[0].x, p[0].y, p[0].z]) { p[0] } else { NONE };
        }
    }
    Some(Cloud { points, grid: Some(Grid { width: columns, height: rows }), ..Cloud::default() })
}

/// Data of each view that depend on no other view.
pub(super) struct Ready {
    pub prepared: Vec<Prepared>,
    pub maps: Vec<Option<DepthMap>>,
}

impl Ready {
    pub fn of(views: &[View], options: &MergeOptions) -> Ready {
        let (prepared, maps) = pool::map(views, 1, |view| Ready::of_view(view, options)).into_iter().unzip();
        Ready { prepared, maps }
    }

    pub fn of_view(view: &View, options: &MergeOptions) -> (Prepared, Option<DepthMap>) {
        pool::join(|| prepare(view, options), || DepthMap::from_view(view, &view.world_from_camera))
    }
}

/// Carries out steps 1 and 2 of the paper: transforms the views by their poses into the world, filters them
/// by height and range, and thins them.
pub(super) fn filter_and_thin(
    views: &[View],
    prepared: &[Prepared],
    options: &MergeOptions,
) -> Result<Vec<Step>, MergeError> {
    let given = pool::map(views, 1, |view| view.cloud.count_finite()).into_iter().sum();
    let points = prepared.iter().map(|p| p.points.len()).sum();
    if points == 0 {
        let band = options
            .height_band_m
            .map_or(String::new(), |(low, high)| format!(" and {low:.2} to {high:.2} m high"));
        return Err(MergeError::Empty { views: views.len(), range_m: options.range_m, band });
    }
    let step = |name: &str, points, result: String| Step { name: name.to_owned(), points, result };
    let thinned = format!("within {} m, voxels of {:.0} mm", options.range_m, 1e3 * options.align_voxel_m);
    Ok(vec![
        step("initial alignment", given, format!("{} views by their stated poses", views.len())),
        step("filter and thin", points, thinned),
    ])
}

/// Rotation (scaled axis) and shift of the camera from its localised pose.
pub(super) fn departure(pose: &Isometry3<f64>, prior: &Isometry3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let turn = (pose.rotation * prior.rotation.inverse()).scaled_axis();
    (turn, pose.translation.vector - prior.translation.vector)
}

/// Points of a view in the world frame.
pub(super) fn in_world(view: &Prepared, pose: &Isometry3<f64>) -> Vec<Point3<f64>> {
    view.points.iter().map(|p| pose * p.at()).collect()
}
