//! Which returns of a view are fused, how they face, and which of them lie on a level plane.

use super::MergeOptions;
use super::parts::Plane;
use super::prepare::{Prepared, Within, coarser};
use crate::cloud::{Cloud, Grid};
use crate::normals::{OrganisedOptions, organised_where};
use crate::surface::range_sigma_m;
use crate::view::View;
use nalgebra::{Isometry3, Point3, Vector3};
use std::borrow::Cow;

/// A return between two neighbours this far before and behind it belongs to neither, as a share of its depth.
const FLYING_SHARE: f32 = 0.02;
/// A return lies on a plane within this many spreads of its own and this distance, metres ...
const PLANE_SPREADS: f32 = 3.0;
const PLANE_M: f32 = 0.004;
/// ... if it faces nearly the same way: the cosine of the angle between.
const PLANE_FACING: f32 = 0.8;
/// Columns of the image in which normals of things are sought.
const COLUMNS: usize = 320;
/// Things are finer than planes: their normals are those of few pixels.
const FINE: OrganisedOptions = OrganisedOptions { reach: 1, depth_step_share: 0.02, base_m: 0.006, least: 5 };

/// Returns that are taken together of a cloud without rows.
const ROW: usize = 512;

/// A return that is fused.
pub(super) struct Return<'a> {
    /// Camera frame, metres.
    pub at: &'a Point3<f32>,
    /// Camera frame; not finite if unknown.
    pub normal: &'a Vector3<f32>,
    pub pixel: usize,
    /// Number of the plane that it lies on.
    pub plane: Option<usize>,
}

/// The returns of a view from its corrected pose.
pub(super) struct Returns<'a> {
    pub view: &'a View,
    pub world_from_camera: Isometry3<f64>,
    within: Within,
    /// Pixels a row.
    width: usize,
    /// What each pixel of the coarser copy lies on, and how it faces.
    planes: Vec<On>,
    coarse: Facing<'a>,
    things: Facing<'a>,
}

/// A plane (camera frame) that something lies on, and how far from it what does so may be, metres.
#[derive(Clone, Copy)]
struct On {
    normal: Vector3<f32>,
    along_m: f32,
    reach_m: f32,
    number: usize,
}

impl On {
    /// Nothing is as near as this.
    const NONE: On = On { normal: Vector3::new(0.0, 0.0, 0.0), along_m: 0.0, reach_m: -1.0, number: 0 };

    fn is_some(&self) -> bool {
        self.reach_m > 0.0
    }

    /// True if the return is as near to the plane as what lies on it.
    #[inline(always)]
    fn holds(&self, p: &Point3<f32>) -> bool {
        (self.normal.dot(&p.coords) - self.along_m).abs() < self.reach_m
    }
}

/// Normals (camera frame) of some of a view's pixels: of every nth row and column.
struct Facing<'a> {
    normals: Cow<'a, [Vector3<f32>]>,
    /// Normals a row.
    width: usize,
    stride: usize,
}

impl Facing<'_> {
    /// Number of the normal of a pixel. Pixels that are too few for one more go with the last.
    #[inline(always)]
    fn index(&self, row: usize, column: usize) -> usize {
        let last = self.normals.len().div_ceil(self.width).saturating_sub(1);
        (row / self.stride).min(last) * self.width + (column / self.stride).min(self.width - 1)
    }
}

impl<'a> Returns<'a> {
    pub fn of(
        view: &'a View,
        prepared: &'a Prepared,
        world_from_camera: &Isometry3<f64>,
        planes: &[Plane],
        options: &MergeOptions,
    ) -> Returns<'a> {
        let within = Within::of(world_from_camera, options, 0.0);
        let cloud = prepared.coarse.as_ref().unwrap_or(&view.cloud);
        let coarse = Facing::of(view, cloud);
        let planes = lying_on(cloud, &coarse, &within, planes, world_from_camera);
        let things = things(view, &within, &coarse, &planes);
        Returns {
            view,
            world_from_camera: *world_from_camera,
            within,
            width: view.cloud.grid.map_or(ROW, |g| g.width).max(1),
            planes,
            coarse,
            things,
        }
    }

    /// Rows of pixels, or of as many points.
    pub fn rows(&self) -> usize {
        self.view.cloud.len().div_ceil(self.width)
    }

    /// Calls `found` for those of a row that are in range and band and do not fly.
    #[inline(always)]
    pub fn row(&self, row: usize, mut found: impl FnMut(Return)) {
        const NONE: Vector3<f32> = Vector3::new(f32::NAN, f32::NAN, f32::NAN);
        let cloud = &self.view.cloud;
        let line = &cloud.points[row * self.width..cloud.len().min((row + 1) * self.width)];
        let stride = self.coarse.stride;
        let first = self.coarse.index(row, 0);
        for (column, some) in line.chunks(stride).enumerate() {
            let coarse = first + column.min(self.coarse.width - 1);
            let on = &self.planes[coarse];
            for (p, column) in some.iter().zip(column * stride..) {
                if !self.within.holds(p) || is_flying(cloud, row, column) {
                    continue;
                }
                let plane = on.holds(p).then_some(on.number);
                let normal = match plane {
                    Some(_) => self.coarse.normals.get(coarse),
                    None => self.things.normals.get(self.things.index(row, column)),
                };
                let pixel = row * self.width + column;
                found(Return { at: p, normal: normal.unwrap_or(&NONE), pixel, plane });
            }
        }
    }
}

impl<'a> Facing<'a> {
    /// Of all points of a cloud that is every nth row and column of a view's.
    fn of(view: &View, cloud: &'a Cloud) -> Facing<'a> {
        let width = cloud.grid.map_or(ROW, |g| g.width).max(1);
        let stride = view.cloud.grid.map_or(1, |g| g.width / width);
        Facing { normals: Cow::Borrowed(cloud.normals.as_deref().unwrap_or_default()), width, stride }
    }
}

/// What each point of the coarser copy lies on.
fn lying_on(
    cloud: &Cloud,
    facing: &Facing,
    within: &Within,
    planes: &[Plane],
    world_from_camera: &Isometry3<f64>,
) -> Vec<On> {
    let in_camera = |(number, (normal, offset_m)): (usize, &Plane)| {
        let along_m = offset_m - normal.dot(&world_from_camera.translation.vector);
        let normal = (world_from_camera.rotation.inverse() * normal).cast();
        On { normal, along_m: along_m as f32, reach_m: 0.0, number }
    };
    let planes: Vec<On> = planes.iter().enumerate().map(in_camera).collect();
    let on = |(k, p): (usize, &Point3<f32>)| {
        let Some(normal) = facing.normals.get(k).filter(|_| within.holds(p)) else { return On::NONE };
        let reach_m = PLANE_SPREADS * sigma_m(p) + PLANE_M;
        let faces = planes.iter().filter(|plane| normal.dot(&plane.normal).abs() > PLANE_FACING);
        faces.map(|plane| On { reach_m, ..*plane }).find(|on| on.holds(p)).unwrap_or(On::NONE)
    };
    cloud.points.iter().enumerate().map(on).collect()
}

/// Normals of what lies on no plane: a finer copy's of an organised cloud, else the cloud's own.
fn things<'a>(view: &'a View, within: &Within, coarse: &Facing, planes: &[On]) -> Facing<'a> {
    let fine = coarser(view, within, COLUMNS);
    let Some((cloud, Grid { width, .. })) = fine.zip(view.cloud.grid) else {
        return Facing::of(view, &view.cloud);
    };
    let size = cloud.grid.map_or(width, |g| g.width).max(1);
    let stride = width / size;
    let columns: Vec<usize> = (0..size).map(|column| coarse.index(0, column * stride)).collect();
    let mut wanted = Vec::with_capacity(cloud.len());
    for row in 0..cloud.len() / size {
        let first = coarse.index(row * stride, 0);
        wanted.extend(columns.iter().map(|column| !planes[first + column].is_some()));
    }
    let found = organised_where(&cloud, &FINE, |k| wanted[k]);
    let normals = found.map_or(Vec::new(), |found| found.normals);
    Facing { normals: Cow::Owned(normals), width: size, stride }
}

/// Spread of a return (camera frame), metres.
#[inline(always)]
pub(super) fn sigma_m(p: &Point3<f32>) -> f32 {
    // Depth, but for what is seen far aside.
    let (depth, half_sq) = (p.z.abs(), 0.25 * p.coords.norm_squared());
    let depth = if depth * depth >= half_sq { depth } else { half_sq.sqrt() };
    range_sigma_m(f64::from(depth)) as f32
}

/// True if the pixel hangs in the air: before one neighbour and behind the opposite one.
#[inline(always)]
fn is_flying(cloud: &Cloud, row: usize, column: usize) -> bool {
    let Some(Grid { width, height }) = cloud.grid else { return false };
    let i = row * width + column;
    let depth = cloud.points[i].z;
    let step = FLYING_SHARE * depth;
    let beyond = |j: usize| cloud.points[j].z - depth;
    let between = |a: f32, b: f32| (a > step && b < -step) || (a < -step && b > step);
    let across = column > 0 && column + 1 < width && between(beyond(i - 1), beyond(i + 1));
    let down = row > 0 && row + 1 < height && between(beyond(i - width), beyond(i + width));
    across || down
}
