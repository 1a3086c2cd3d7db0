//! Step 5: one cloud, sharper than any view, of bounded size.
//!
//! Returns at depth edges that hang between two surfaces are dropped. The rest are averaged in voxels, each weighted by the spread of its
//! range; then every voxel is moved along its normal onto the weighted mean of the like-facing voxels beside it. What lies on a level
//! plane is averaged in columns that stand on it instead: the table is one sheet. What a single view claims and another looked through
//! is left out.

use super::MergeOptions;
use super::bricks::{Bricks, Grid};
use super::parts::Plane;
use super::prepare::Prepared;
use super::returns::{Return, Returns, sigma_m};
use crate::cloud::{Cloud, is_finite};
use crate::view::View;
use crate::visibility::Visibility;
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;

/// How far along its normal a voxel may be moved by its neighbours, in spreads of its own.
const TUBE_SPREADS: f32 = 2.5;
/// The spread of a voxel: that of a point at arm's length, metres. A voxel of many points is no narrower a tube.
const VOXEL_SPREAD_M: f32 = 0.003;
/// Looks through a place this far off the surface say that nothing is there, metres.
const CARVE_M: f64 = 0.03;

/// What is known of a voxel: running sums, weighted, while it is gathered; then means.
#[derive(Clone, Copy)]
struct Cell {
    weight: f32,
    /// Voxels from the grid's lowest corner.
    at: Vector3<f32>,
    /// Unit length or zero in the end.
    normal: Vector3<f32>,
    /// Views that measured it, and the last of them.
    views: u16,
    last: u16,
}

impl Cell {
    const EMPTY: Cell = Cell {
        weight: 0.0,
        at: Vector3::new(0.0, 0.0, 0.0),
        normal: Vector3::new(0.0, 0.0, 0.0),
        views: 0,
        last: u16::MAX,
    };

    #[inline(always)]
    fn add(&mut self, r: &Measured, view: u16) {
        self.weight += r.weight;
        self.at += r.at * r.weight;
        self.normal += r.normal * r.weight;
        self.views += u16::from(self.last != view);
        self.last = view;
    }

    fn mean(&self) -> Cell {
        let normal = self.normal.try_normalize(1e-6).unwrap_or_else(Vector3::zeros);
        Cell { at: self.at / self.weight, normal, ..*self }
    }
}

/// A return in its grid.
struct Measured {
    /// Voxels from the grid's lowest corner.
    at: Vector3<f32>,
    weight: f32,
    /// Zero if unknown.
    normal: Vector3<f32>,
    pixel: u32,
    /// Number of the voxel's cell.
    cell: u32,
}

/// Occupied voxels, or columns on a plane.
struct Gathered {
    grid: Grid,
    /// The grid's axes: those of the world, or z away from a plane.
    axes_from_world: UnitQuaternion<f64>,
    /// True if the voxels are columns along z.
    flat: bool,
    bricks: Bricks<Cell>,
    /// Weighted sums of the colours of each cell, if there are any.
    colours: Vec<Vector3<f32>>,
    returns: usize,
}

pub(super) struct Fused {
    pub cloud: Cloud,
    pub views_per_point: Vec<u16>,
    pub returns: usize,
    pub voxel_m: f64,
}

/// Fuses the used views at their corrected poses, with a sheet for each of the level `planes`.
pub(super) fn fuse(
    views: &[View],
    prepared: &[Prepared],
    used: &[bool],
    poses: &[Isometry3<f64>],
    planes: &[Plane],
    seen: &Visibility,
    options: &MergeOptions,
) -> Fused {
    let _span = tracing::debug_span!("fuse", views = views.len()).entered();
    let used: Vec<usize> = (0..views.len()).filter(|&i| used[i]).collect();
    let of = |&i: &usize| Returns::of(&views[i], &prepared[i], &poses[i], planes, options);
    let of: Vec<Returns> = used.par_iter().map(of).collect();
    let coloured = of.iter().all(|returns| returns.view.cloud.colours.is_some());
    let mut voxel_m = options.fuse_voxel_m;
    loop {
        let things = Gathered::over(&of, None, voxel_m, options);
        let sheets = planes.iter().map(|plane| Gathered::over(&of, Some(plane), voxel_m, options));
        let mut all: Vec<Gathered> = std::iter::once(things).chain(sheets).collect();
        (0..).zip(&of).for_each(|(number, returns)| take(&mut all, returns, number, coloured));
        let cells: usize = all.iter().map(|gathered| gathered.bricks.cells.len()).sum();
        if cells > options.most_points {
            // Surfaces: points fall with the square of the side.
            voxel_m = all[0].grid.voxel_m * (cells as f64 / options.most_points as f64).sqrt().max(1.2);
            continue;
        }
        return settle(all, seen);
    }
}

/// Sorts the returns of a view into voxels and sheets.
fn take(all: &mut [Gathered], of: &Returns, view: u16, coloured: bool) {
    let colours = of.view.cloud.colours.as_deref().filter(|_| coloured);
    let mut kept: Vec<(Scale, Vec<Measured>)> =
        all.iter().map(|gathered| (Scale::of(&of.world_from_camera, gathered), Vec::new())).collect();
    for row in 0..of.rows() {
        of.row(row, |found| {
            let (scale, kept) = &mut kept[found.plane.map_or(0, |plane| plane + 1)];
            kept.push(scale.measured(&found));
        });
        for (gathered, (_, kept)) in all.iter_mut().zip(&mut kept) {
            gathered.add(kept, view, colours);
        }
    }
}

/// Camera to grid.
struct Scale {
    /// Voxels a metre.
    turn: Matrix3<f32>,
    shift: Vector3<f32>,
    /// The same turn for directions.
    axes: Matrix3<f32>,
}

impl Scale {
    fn of(world_from_camera: &Isometry3<f64>, gathered: &Gathered) -> Scale {
        let Gathered { grid, axes_from_world, .. } = gathered;
        let axes = (axes_from_world * world_from_camera.rotation).to_rotation_matrix().into_inner();
        let shift = axes_from_world * world_from_camera.translation.vector - grid.origin_m;
        Scale { turn: (axes / grid.voxel_m).cast(), shift: (shift / grid.voxel_m).cast(), axes: axes.cast() }
    }

    #[inline(always)]
    fn measured(&self, of: &Return) -> Measured {
        let sigma_m = sigma_m(of.at);
        let (at, weight) = (self.turn * of.at.coords + self.shift, 1.0 / (sigma_m * sigma_m));
        let normal = if of.normal.x.is_finite() { self.axes * of.normal } else { Vector3::zeros() };
        Measured { at, weight, normal, pixel: of.pixel as u32, cell: 0 }
    }
}

impl Gathered {
    /// Nothing yet, over all that is in range of a camera.
    fn over(of: &[Returns], on: Option<&Plane>, voxel_m: f64, options: &MergeOptions) -> Gathered {
        let axes_from_world = on.map_or_else(UnitQuaternion::identity, |(normal, _)| {
            let turn = UnitQuaternion::rotation_between(normal, &Vector3::z());
            turn.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
        });
        let places = of
            .iter()
            .map(|returns| Point3::from(axes_from_world * returns.world_from_camera.translation.vector));
        let around = places.map(|p| (p, p)).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let (low, high) = around.unwrap_or_default();
        let reach = Vector3::repeat(options.range_m + voxel_m);
        let grid = Grid::over(&(low - reach), &(high + reach), voxel_m);
        let flat = on.is_some();
        Gathered { grid, axes_from_world, flat, bricks: Bricks::new(flat), colours: Vec::new(), returns: 0 }
    }

    /// Adds returns, and takes them out of the list. A pass for each thing that is waited for: what comes from far memory is asked for many
    /// times at once.
    fn add(&mut self, kept: &mut Vec<Measured>, view: u16, colours: Option<&[[u8; 3]]>) {
        for r in kept.iter_mut() {
            r.cell = self.bricks.cell(r.at.as_ref(), Cell::EMPTY);
        }
        for r in kept.iter() {
            self.bricks.cells[r.cell as usize].add(r, view);
        }
        if let Some(colours) = colours {
            self.colours.resize(self.bricks.cells.len(), Vector3::zeros());
            for r in kept.iter() {
                if let Some(colour) = colours.get(r.pixel as usize) {
                    self.colours[r.cell as usize] += Vector3::from(colour.map(f32::from)) * r.weight;
                }
            }
        }
        self.returns += kept.len();
        kept.clear();
    }
}

/// Position, normal, colour and number of views of a fused point.
type Settled = (Point3<f32>, Vector3<f32>, [u8; 3], u16);

/// Moves the voxels onto their common surface and drops what was looked through.
fn settle(all: Vec<Gathered>, seen: &Visibility) -> Fused {
    let most = all.iter().map(|gathered| gathered.bricks.cells.len()).sum();
    let coloured = all.iter().all(|gathered| gathered.colours.len() == gathered.bricks.cells.len());
    let mut fused = Fused {
        cloud: Cloud::from_points(Vec::with_capacity(most)),
        views_per_point: Vec::with_capacity(most),
        returns: all.iter().map(|gathered| gathered.returns).sum(),
        voxel_m: all[0].grid.voxel_m,
    };
    let mut normals = Vec::with_capacity(most);
    let mut colours = coloured.then(|| Vec::with_capacity(most));
    for gathered in all {
        gathered.settle(seen, |kept| {
            fused.cloud.points.extend(kept.iter().map(|settled| settled.0));
            normals.extend(kept.iter().map(|settled| settled.1));
            fused.views_per_point.extend(kept.iter().map(|settled| settled.3));
            if let Some(colours) = &mut colours {
                colours.extend(kept.iter().map(|settled| settled.2));
            }
        });
    }
    fused.cloud.normals = Some(normals);
    fused.cloud.colours = colours;
    fused
}

impl Gathered {
    /// Gives what is left of the cells, some at a time.
    fn settle(self, seen: &Visibility, mut give: impl FnMut(&[Settled])) {
        /// Bricks that one thread settles in a row, and such rows at a time: what they fill is used again.
        const TOGETHER: usize = 64;
        const ROWS: usize = 32;
        let Gathered { grid, axes_from_world, flat, bricks, colours: sums, .. } = self;
        let world_from_axes = axes_from_world.inverse().to_rotation_matrix();
        let turn = world_from_axes.cast::<f32>();
        let mut colours: Vec<[u8; 3]> = Vec::with_capacity(sums.len());
        let bricks = bricks.in_order(|cell, number| {
            let colour = |sum: &Vector3<f32>| <[u8; 3]>::from((sum / cell.weight).map(|c| c.round() as u8));
            colours.extend(sums.get(number).map(colour));
            cell.mean()
        });
        let gazes = seen.gazes();
        let settle_row = |row: usize, kept: &mut Vec<Settled>| {
            kept.clear();
            for brick in (row * TOGETHER..bricks.len()).take(TOGETHER) {
                bricks.visit(brick, |number, around| {
                    let cell = &bricks.cells[number];
                    let at = match flat {
                        true => levelled(cell, around, &bricks.cells),
                        false => smoothed(cell, around, &bricks.cells, grid.voxel_m as f32),
                    };
                    let at = world_from_axes * Point3::from(grid.origin_m + at.cast::<f64>() * grid.voxel_m);
                    // One view's word against another's look through the place.
                    let alone = cell.views < 2 && gazes.len() > 1;
                    let through = alone && gazes.iter().any(|gaze| gaze.passes(&at, CARVE_M));
                    let at = at.cast::<f32>();
                    if through || !is_finite(&at) {
                        return;
                    }
                    let none = cell.normal == Vector3::zeros();
                    let normal = if none { Vector3::repeat(f32::NAN) } else { turn * cell.normal };
                    kept.push((at, normal, colours.get(number).copied().unwrap_or_default(), cell.views));
                });
            }
        };
        let mut rows: Vec<Vec<Settled>> = vec![Vec::new(); ROWS];
        let all = bricks.len().div_ceil(TOGETHER);
        for first in (0..all).step_by(ROWS) {
            let rows = &mut rows[..ROWS.min(all - first)];
            rows.par_iter_mut().enumerate().for_each(|(row, kept)| settle_row(first + row, kept));
            rows.iter().for_each(|kept| give(kept));
        }
    }
}

/// The voxel's mean, moved along its normal onto the mean of the like-facing voxels around it.
#[inline(always)]
fn smoothed(own: &Cell, around: &[u32], cells: &[Cell], voxel_m: f32) -> Vector3<f32> {
    let tube = TUBE_SPREADS * VOXEL_SPREAD_M / voxel_m;
    let (mut weight, mut offset) = (0.0, 0.0);
    for &number in around {
        let near = &cells[number as usize];
        let gap = own.normal.dot(&(near.at - own.at));
        let counts = gap.abs() < tube && near.normal.dot(&own.normal) > 0.7;
        let share = if counts { near.weight } else { 0.0 };
        weight += share;
        offset += share * gap;
    }
    if weight > 0.0 { own.at + own.normal * (offset / weight) } else { own.at }
}

/// The column's mean, moved along z onto the mean of the columns around it.
#[inline(always)]
fn levelled(own: &Cell, around: &[u32], cells: &[Cell]) -> Vector3<f32> {
    let (weight, sum) = around.iter().fold((0.0, 0.0), |(weight, sum), &number| {
        let near = &cells[number as usize];
        (weight + near.weight, sum + near.weight * near.at.z)
    });
    Vector3::new(own.at.x, own.at.y, sum / weight)
}
