//! Step 5: one cloud, sharper than any view, of bounded size.
//!
//! Returns at depth edges that hang between two surfaces are dropped. The rest are averaged in voxels, each weighted by the spread of its
//! range. What lies on a level plane is averaged in columns that stand on it instead: the table is one sheet.

use super::MergeOptions;
use super::bricks::{Bricks, Grid};
use super::parts::Plane;
use super::prepare::Prepared;
use super::returns::{Return, Returns};
use super::settle::Before;
use crate::cloud::Cloud;
use crate::view::View;
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use std::ops::Range;

/// What is known of a voxel: running sums, weighted, while it is gathered; then means.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub weight: f32,
    /// Voxels from the grid's lowest corner.
    pub at: Vector3<f32>,
    /// Unit length or zero in the end.
    pub normal: Vector3<f32>,
    /// Views that measured it, and the last of them.
    pub views: u16,
    last: u16,
}

impl Cell {
    /// Measured by no view. From: mark.
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

    pub fn mean(&self) -> Cell {
        /// Normals that add up to less cancel out. From: rounding.
        const CANCELLED: f32 = 1e-6;
        let normal = self.normal.try_normalize(CANCELLED).unwrap_or_else(Vector3::zeros);
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
pub(super) struct Gathered {
    pub grid: Grid,
    /// The grid's axes: those of the world, or z away from a plane.
    pub axes_from_world: UnitQuaternion<f64>,
    /// True if the voxels are columns along z.
    pub flat: bool,
    pub bricks: Bricks<Cell>,
    /// Weighted sums of the colours of each cell, if there are any.
    pub colours: Vec<Vector3<f32>>,
    pub returns: usize,
    pub before: Before,
}

pub(super) struct Fused {
    pub cloud: Cloud,
    pub views_per_point: Vec<u16>,
    pub returns: usize,
    pub voxel_m: f64,
}

/// Gathers the used views at their corrected poses, with a sheet for each of the level `planes`.
pub(super) fn gather(
    views: &[View],
    prepared: &[Prepared],
    used: &[bool],
    poses: &[Isometry3<f64>],
    planes: &[Plane],
    options: &MergeOptions,
) -> Vec<Gathered> {
    /// If there are too many voxels, they grow at least by this. From: chosen.
    const GROWTH: f64 = 1.2;
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
            voxel_m = all[0].grid.voxel_m * (cells as f64 / options.most_points as f64).sqrt().max(GROWTH);
            continue;
        }
        all.par_iter_mut().for_each(Gathered::sort);
        return all;
    }
}

/// Adds a further view to what was gathered with `planes`, as the view of that number. False, and nothing is added, if it does not go with
/// it: it lies beyond its voxels, has no colours where that has, or makes it too large.
pub(super) fn gather_further(
    all: &mut [Gathered],
    number: usize,
    (view, prepared): (&View, &Prepared),
    pose: &Isometry3<f64>,
    planes: &[Plane],
    options: &MergeOptions,
) -> bool {
    let returns = Returns::of(view, prepared, pose, planes, options);
    let cells: usize = all.iter().map(|gathered| gathered.bricks.cells.len()).sum();
    let coloured = !all[0].colours.is_empty();
    let fits = all.iter().all(|gathered| gathered.holds(&returns, options));
    let Ok(number) = u16::try_from(number) else { return false };
    if !fits || cells + view.cloud.len() > options.most_points || coloured != view.cloud.colours.is_some() {
        return false;
    }
    take(all, &returns, number, coloured);
    true
}

/// Sorts the returns of a view into voxels and sheets: some rows are looked through while those before them are added.
fn take(all: &mut [Gathered], of: &Returns, view: u16, coloured: bool) {
    /// Rows that are looked through together, and how many of them beside the adding, which takes less long. From: work.
    const ROWS: usize = 12;
    const BESIDE: usize = 4;
    let colours = of.view.cloud.colours.as_deref().filter(|_| coloured);
    let scales: Vec<Scale> = all.iter().map(|gathered| Scale::of(&of.world_from_camera, gathered)).collect();
    let look = |rows: Range<usize>, kept: &mut Lists| {
        of.visit(rows.start.min(of.rows())..rows.end.min(of.rows()), |found| {
            let number = found.plane.map_or(0, |plane| plane + 1);
            kept[number].push(scales[number].measured(&found));
        });
    };
    let lists = || -> [Lists; 2] { [(); 2].map(|()| all.iter().map(|_| Vec::new()).collect()) };
    let (mut kept, mut next) = (lists(), lists());
    for first in (0..of.rows() + ROWS).step_by(ROWS) {
        let [early, late] = &mut next;
        let mut add_and_look = || {
            for kept in &mut kept {
                all.iter_mut().zip(kept).for_each(|(gathered, kept)| gathered.add(kept, view, colours));
            }
            look(first..first + BESIDE, early);
        };
        match first < of.rows() {
            true => drop(rayon::join(add_and_look, || look(first + BESIDE..first + ROWS, late))),
            false => add_and_look(),
        }
        std::mem::swap(&mut kept, &mut next);
    }
}

/// Returns for each voxel grid or sheet.
type Lists = Vec<Vec<Measured>>;

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
        let normal = if of.normal.x.is_finite() { self.axes * of.normal } else { Vector3::zeros() };
        let at = self.turn * of.at + self.shift;
        Measured { at, weight: of.weight, normal, pixel: of.pixel as u32, cell: 0 }
    }
}

impl Gathered {
    /// Puts the cells in the order of their bricks.
    fn sort(&mut self) {
        let former = self.bricks.sort();
        if !self.colours.is_empty() {
            self.colours = former.iter().map(|&number| self.colours[number as usize]).collect();
        }
    }

    /// True if no return of a view lies below the lowest voxel or so far off that it could not be told from another.
    fn holds(&self, returns: &Returns, options: &MergeOptions) -> bool {
        let most = f64::from(1 << 19) * self.grid.voxel_m;
        let scale = Scale::of(&returns.world_from_camera, self);
        let camera = self.axes_from_world * returns.world_from_camera.translation.vector - self.grid.origin_m;
        if camera.amin() > options.range_m + self.grid.voxel_m && camera.amax() + options.range_m < most {
            return true;
        }
        let in_range =
            |p: &&Point3<f32>| p.coords.norm_squared() <= (options.range_m * options.range_m) as f32;
        let inside = |p: &Point3<f32>| {
            let at = scale.turn * p.coords + scale.shift;
            at.min() > 1.0 && f64::from(at.max()) * self.grid.voxel_m < most
        };
        returns.view.cloud.points.iter().filter(in_range).all(inside)
    }

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
        let (bricks, before) = (Bricks::new(flat), Before::default());
        Gathered { grid, axes_from_world, flat, bricks, colours: Vec::new(), returns: 0, before }
    }

    /// Adds returns, and takes them out of the list. A pass for each thing that is waited for: what comes from far memory is asked for many
    /// times at once.
    fn add(&mut self, kept: &mut Vec<Measured>, view: u16, colours: Option<&[[u8; 3]]>) {
        /// Returns that are added together. From: work.
        const SOME: usize = 512;
        for kept in kept.chunks_mut(SOME) {
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
        }
        self.returns += kept.len();
        kept.clear();
    }
}
