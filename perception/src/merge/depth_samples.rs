//! Selection of a view's returns for fusion, with their normals and level planes.

use super::options::MergeOptions;
use super::parts::{self, Plane};
use super::prepare::{Prepared, Within, coarser};
use crate::cloud::{Cloud, Grid};
use crate::noise::frontal_sigma_m;
use crate::normals::{OrganisedOptions, organised_where};
use crate::pool;
use crate::surface::BAND;
use crate::view::View;
use nalgebra::{Isometry3, Point3, Vector3};
use std::borrow::Cow;
use std::ops::Range;

/// Depth difference to both neighbours, one nearer and one farther, from which a return is a mixed
/// pixel, as a share of its depth. From: chosen.
const FLYING_SHARE: f32 = 0.02;
/// Maximum distance of a return from its plane: this many standard deviations plus [`PLANE_M`].
/// From: derived, as far as a plane is taken to be measured where it is sought.
const PLANE_SPREADS: f32 = BAND.0 as f32;
/// Maximum distance of a return from its plane, metres, beyond [`PLANE_SPREADS`] standard
/// deviations. From: derived, as far as a plane is taken to be measured where it is sought.
const PLANE_M: f32 = BAND.1 as f32;
/// Minimum cosine between a return's normal and its plane's. From: derived, as where the planes are
/// told from what stands on them.
const PLANE_FACING: f32 = parts::PLANE_FACING as f32;
/// Number of image columns from which normals of objects are computed. From: chosen.
const COLUMNS: usize = 320;
/// Normal estimation for objects, from small windows because they are finer than planes.
/// From: chosen.
const FINE: OrganisedOptions = OrganisedOptions { reach: 1, depth_step_share: 0.02, base_m: 0.006, least: 5 };

/// Number of returns processed together in a cloud without rows. From: work.
const ROW: usize = 512;
/// Number of pixels processed together (SIMD lanes). From: work.
const LANES: usize = 16;

/// Mark, in place of a plane number, of a return that is not fused. From: mark.
const DROPPED: u32 = u32::MAX;
/// Mark, in place of a plane number, of a return off the planes. From: mark.
const THING: u32 = u32::MAX - 1;

/// Depth measurement of a pixel, to be fused into the merged cloud.
#[derive(Clone, Copy)]
pub(super) struct DepthSample {
    /// Position in the camera frame, metres.
    pub at: Vector3<f32>,
    /// Normal in the camera frame; non-finite if unknown.
    pub normal: Vector3<f32>,
    /// Inverse variance, per square metre.
    pub weight: f32,
    /// Index of the return's pixel in the view.
    pub pixel: u32,
}

/// Fused returns of a view, by groups of rows: those off the planes, then those on each plane.
pub(super) struct Looked(Vec<Vec<Vec<DepthSample>>>);

impl Looked {
    /// Returns of a view at its corrected pose, assigned to `planes`.
    pub fn at(
        view: &View,
        prepared: &Prepared,
        world_from_camera: &Isometry3<f64>,
        planes: &[Plane],
        options: &MergeOptions,
    ) -> Looked {
        /// Number of rows per thread. From: work.
        const ROWS: usize = 16;
        let returns = DepthSamples::of(view, prepared, world_from_camera, planes, options);
        let rows = returns.view.cloud.len().div_ceil(returns.width);
        let look = |first: usize| {
            let mut found = vec![Vec::new(); 1 + planes.len()];
            returns.visit(first..rows.min(first + ROWS), |grid, of_grid| found[grid].push(of_grid));
            found
        };
        Looked(pool::each(rows.div_ceil(ROWS), 1, |n| look(n * ROWS)))
    }

    /// True if the returns were assigned to as many planes as given.
    pub fn is_with(&self, planes: &[Plane]) -> bool {
        self.0.iter().all(|found| found.len() == 1 + planes.len())
    }

    /// Returns off the planes (0), or on the plane with this number, from 1.
    pub fn of_grid(&self, grid: usize) -> impl Iterator<Item = &[DepthSample]> {
        self.0.iter().map(move |found| found[grid].as_slice())
    }
}

/// Selector of a view's returns at its corrected pose.
struct DepthSamples<'a> {
    view: &'a View,
    within: Within,
    organised: bool,
    /// Number of pixels per row.
    width: usize,
    planes: Vec<InCamera>,
    /// Plane number of each pixel of the coarser copy, or [`THING`].
    on: Vec<u32>,
    /// Normals for returns on planes.
    coarse: Facing<'a>,
    /// Normals for returns off the planes.
    things: Facing<'a>,
}

/// A plane in the camera's frame, metres.
struct InCamera {
    normal: Vector3<f32>,
    /// Distance of the plane from the camera along the normal, metres.
    along_m: f32,
}

impl InCamera {
    /// True if a measurement with this standard deviation lies on the plane.
    #[inline(always)]
    fn holds(&self, [x, y, z]: [f32; 3], sigma_m: f32) -> bool {
        let height_m = self.normal.x * x + self.normal.y * y + self.normal.z * z - self.along_m;
        height_m.abs() < PLANE_SPREADS * sigma_m + PLANE_M
    }
}

/// Normals (camera frame) of some of a view's pixels: of every nth row and column.
struct Facing<'a> {
    normals: Cow<'a, [Vector3<f32>]>,
    /// Index in `normals` of the first normal for each row of pixels.
    rows: Vec<usize>,
    /// Offset in a row of normals for each column of pixels.
    columns: Vec<usize>,
}

impl<'a> Facing<'a> {
    /// The normals from a copy of the view's cloud with every nth row and column.
    fn of(view: &View, copy: Option<Grid>, normals: Cow<'a, [Vector3<f32>]>) -> Facing<'a> {
        let width = view.cloud.grid.map_or(ROW, |g| g.width).max(1);
        let size = copy.map_or(width, |g| g.width).max(1);
        // Pixels that are too few for one more go with the last.
        let (stride, last) = (width / size, normals.len().div_ceil(size).saturating_sub(1));
        let rows = view.cloud.len().div_ceil(width);
        Facing {
            normals,
            rows: (0..rows).map(|row| (row / stride).min(last) * size).collect(),
            columns: (0..width).map(|column| (column / stride).min(size - 1)).collect(),
        }
    }

    #[inline(always)]
    fn normal(&self, row: usize, column: usize) -> Vector3<f32> {
        /// Mark of a point without a normal. From: mark.
        const NONE: Vector3<f32> = Vector3::new(f32::NAN, f32::NAN, f32::NAN);
        self.normals.get(self.rows[row] + self.columns[column]).copied().unwrap_or(NONE)
    }
}

impl<'a> DepthSamples<'a> {
    fn of(
        view: &'a View,
        prepared: &'a Prepared,
        world_from_camera: &Isometry3<f64>,
        planes: &[Plane],
        options: &MergeOptions,
    ) -> DepthSamples<'a> {
        let within = Within::of_fused(world_from_camera, options);
        let cloud = prepared.coarse.as_ref().unwrap_or(&view.cloud);
        let normals = Cow::Borrowed(cloud.normals.as_deref().unwrap_or_default());
        let coarse = Facing::of(view, cloud.grid, normals);
        let in_camera = |(normal, offset_m): &Plane| InCamera {
            along_m: (offset_m - normal.dot(&world_from_camera.translation.vector)) as f32,
            normal: (world_from_camera.rotation.inverse() * normal).cast(),
        };
        let planes: Vec<InCamera> = planes.iter().map(in_camera).collect();
        let on = lying_on(cloud, &coarse.normals, &within, &planes);
        let things = things(view, &within, &coarse, &on);
        DepthSamples {
            view,
            within,
            organised: view.cloud.grid.is_some(),
            width: view.cloud.grid.map_or(ROW, |g| g.width).max(1),
            planes,
            on,
            coarse,
            things,
        }
    }

    /// Points of a row of pixels, or a chunk of [`ROW`] points of a cloud without rows; empty after
    /// the last.
    fn line(&self, row: usize) -> &[Point3<f32>] {
        let points = &self.view.cloud.points;
        &points[points.len().min(row * self.width)..points.len().min((row + 1) * self.width)]
    }

    /// Calls `found` for the returns of some rows in range, height band and region, without mixed
    /// pixels, each with its plane number plus one, or 0 off the planes.
    fn visit(&self, rows: Range<usize>, mut found: impl FnMut(usize, DepthSample)) {
        let mut lines: [Line; 3] = std::array::from_fn(|_| Line::of(self.width));
        if let Some(before) = rows.start.checked_sub(1) {
            lines[1].fill(self.line(before));
        }
        lines[2].fill(self.line(rows.start));
        for row in rows {
            lines.rotate_left(1);
            lines[2].fill(self.line(row + 1));
            for first in (0..self.width).step_by(LANES) {
                let Some(block) = self.block(&lines, row, first) else { continue };
                for (lane, &on) in block.on.iter().enumerate().filter(|(_, on)| **on != DROPPED) {
                    let column = first + lane;
                    let thing = on == THING;
                    let found_one = DepthSample {
                        at: Vector3::from(block.at.map(|axis| axis[lane])),
                        normal: if thing { &self.things } else { &self.coarse }.normal(row, column),
                        weight: block.weight[lane],
                        pixel: (row * self.width + column) as u32,
                    };
                    found(if thing { 0 } else { on as usize + 1 }, found_one);
                }
            }
        }
    }

    /// Block of pixels of the middle of three rows; `None` if none is fused.
    fn block(&self, lines: &[Line; 3], row: usize, column: usize) -> Option<Block> {
        let [x, y, z] = [0, 1, 2].map(|axis| some(&lines[1].0[axis], column + 1));
        let mut block = Block { at: [*x, *y, *z], weight: [0.0; LANES], on: [DROPPED; LANES] };
        for i in 0..LANES {
            block.on[i] = if self.within.holds([x[i], y[i], z[i]]) { THING } else { DROPPED };
        }
        for (inward, least_m) in &self.within.edges {
            for i in 0..LANES {
                let inside = inward.x * x[i] + inward.y * y[i] + inward.z * z[i] >= *least_m;
                block.on[i] = if inside { block.on[i] } else { DROPPED };
            }
        }
        if block.on == [DROPPED; LANES] {
            return None;
        }
        let [left, right] = [0, 2].map(|aside| some(&lines[1].0[2], column + aside));
        let [above, below] = [0, 2].map(|line: usize| some(&lines[line].0[2], column + 1));
        for i in 0..LANES {
            // In the air: before one neighbour and behind the opposite one.
            let step = FLYING_SHARE * z[i];
            let (near, far) = (z[i] - step, z[i] + step);
            let across = ((left[i] > far) & (right[i] < near)) | ((left[i] < near) & (right[i] > far));
            let down = ((above[i] > far) & (below[i] < near)) | ((above[i] < near) & (below[i] > far));
            let flies = (across | down) & self.organised;
            block.on[i] = if flies { DROPPED } else { block.on[i] };
        }
        let mut sigmas_m = [0.0; LANES];
        for i in 0..LANES {
            sigmas_m[i] = sigma_m(z[i], x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
            block.weight[i] = 1.0 / (sigmas_m[i] * sigmas_m[i]);
        }
        let around = self.around(row, column);
        for (number, plane) in (0..).zip(&self.planes).filter(|(number, _)| around.contains(number)) {
            for i in 0..LANES {
                let holds = plane.holds([x[i], y[i], z[i]], sigmas_m[i]);
                let counts = holds & (around[i] == number) & (block.on[i] == THING);
                block.on[i] = if counts { number } else { block.on[i] };
            }
        }
        Some(block)
    }

    /// Plane on which each pixel of a block may lie by the coarser copy, or [`THING`].
    fn around(&self, row: usize, column: usize) -> [u32; LANES] {
        let mut around = [THING; LANES];
        for (on, column) in around.iter_mut().zip(&self.coarse.columns[column..]) {
            *on = self.on.get(self.coarse.rows[row] + column).copied().unwrap_or(THING);
        }
        around
    }
}

/// Block of `LANES` neighbouring pixels, processed together (SIMD).
struct Block {
    /// Coordinates x, y and z in the camera frame, metres.
    at: [[f32; LANES]; 3],
    /// Inverse variance, per square metre.
    weight: [f32; LANES],
    /// Plane number, [`THING`] or [`DROPPED`].
    on: [u32; LANES],
}

/// Row of pixels in structure-of-arrays form, padded with missing returns.
struct Line([Vec<f32>; 3]);

impl Line {
    fn of(width: usize) -> Line {
        Line(std::array::from_fn(|_| vec![f32::NAN; width.next_multiple_of(LANES) + 2]))
    }

    /// Copies a row of points, which may be shorter than this line.
    fn fill(&mut self, row: &[Point3<f32>]) {
        for (axis, line) in self.0.iter_mut().enumerate() {
            line[1..].iter_mut().zip(row).for_each(|(c, p)| *c = p[axis]);
            line[1 + row.len()..].fill(f32::NAN);
        }
    }
}

#[inline(always)]
fn some(line: &[f32], from: usize) -> &[f32; LANES] {
    line[from..].first_chunk().unwrap_or(&[f32::NAN; LANES])
}

/// Standard deviation of a return, metres.
#[inline(always)]
fn sigma_m(depth: f32, range_sq: f32) -> f32 {
    /// Minimum squared ratio of depth to range; rays are at most 60° off axis. From: chosen.
    const HALF_SQ: f32 = 0.25;
    // Depth, but for what is seen far aside.
    let (depth_sq, half_sq) = (depth * depth, HALF_SQ * range_sq);
    frontal_sigma_m(if depth_sq > half_sq { depth_sq } else { half_sq }.sqrt())
}

/// Plane number of each point of the coarser copy, or [`THING`].
fn lying_on(cloud: &Cloud, normals: &[Vector3<f32>], within: &Within, planes: &[InCamera]) -> Vec<u32> {
    let on = |(p, normal): (&Point3<f32>, &Vector3<f32>)| {
        let at = [p.x, p.y, p.z];
        if !within.holds(at) {
            return THING;
        }
        let sigma_m = sigma_m(p.z, p.coords.norm_squared());
        let on = |(_, plane): &(u32, &InCamera)| {
            normal.dot(&plane.normal).abs() > PLANE_FACING && plane.holds(at, sigma_m)
        };
        (0..).zip(planes).find(on).map_or(THING, |(number, _)| number)
    };
    cloud.points.iter().zip(normals).map(on).collect()
}

/// Normals of points off the planes: from a finer copy of an organised cloud, else the cloud's own.
fn things<'a>(view: &'a View, within: &Within, coarse: &Facing, on: &[u32]) -> Facing<'a> {
    let Some((cloud, Grid { width, .. })) = coarser(view, within, COLUMNS).zip(view.cloud.grid) else {
        let normals = Cow::Borrowed(view.cloud.normals.as_deref().unwrap_or_default());
        return Facing::of(view, view.cloud.grid, normals);
    };
    let size = cloud.grid.map_or(width, |g| g.width).max(1);
    let stride = width / size;
    let mut wanted = Vec::with_capacity(cloud.len());
    for first in coarse.rows.iter().step_by(stride).take(cloud.len() / size) {
        let columns = coarse.columns.iter().step_by(stride).take(size);
        wanted.extend(columns.map(|column| on.get(first + column).is_none_or(|on| *on == THING)));
    }
    let found = organised_where(&cloud, &FINE, |k| wanted[k]);
    let normals = found.map_or(Vec::new(), |found| found.normals);
    Facing::of(view, cloud.grid, Cow::Owned(normals))
}
