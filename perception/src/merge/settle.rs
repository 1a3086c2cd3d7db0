//! Step 5, second half: smoothing of the voxels onto their common surface.
//!
//! Every voxel is moved along its normal onto the weighted mean of the neighbouring voxels with
//! similar normals, every column of a sheet along the sheet's normal onto the mean of the
//! neighbouring columns. Voxels that only one view shows and another looked through are dropped.
//! After a further view, only touched cells are settled again; the others are tested against the
//! new view alone.

use super::check;
use super::fuse::{Cell, Fused, Gathered};
use super::merged::{Merged, Step, ViewFit};
use super::voxel_blocks::{Beside, Mask, NONE, SIDE, VoxelBlocks, WIDE, is_in};
use crate::cloud::{Cloud, is_finite};
use crate::pool;
use crate::visibility::{Gaze, Visibility};
use bytemuck::Zeroable;
use nalgebra::{Point3, Vector3};
use std::iter::Peekable;
use std::slice::Iter;

/// Maximum smoothing shift of a voxel along its normal, in its standard deviations. From: chosen.
const TUBE_SPREADS: f32 = 2.5;
/// Standard deviation of a point at arm's length, used for a voxel's smoothing tube whatever its
/// number of points, metres. From: chosen, the sensor at .3 to 1.4 m has .0012 to .0031.
const VOXEL_SPREAD_M: f32 = 0.003;
/// Minimum distance of a ray from the surface that proves free space there, metres. From: derived,
/// as where views are held against each other.
const CARVE_M: f64 = check::CLEAR_M;

/// Number of successive blocks that one thread settles. From: work.
const TOGETHER: usize = 64;

/// A fused point, world frame.
#[derive(Clone, Copy)]
struct Settled {
    at: Point3<f32>,
    normal: Vector3<f32>,
    colour: [u8; 3],
    views: u16,
    /// Index of the cell.
    cell: u32,
    /// True if settled since the last view was added; false if unchanged.
    anew: bool,
}

/// Settled state of voxels or columns, kept for cells that further views do not touch.
#[derive(Default)]
pub(super) struct Before {
    /// Means of the voxels; empty for columns.
    means: Vec<Cell>,
    /// Settled cells of each group of successive blocks, in order.
    rows: Vec<Vec<Settled>>,
    /// Number of views that the state was checked against.
    gazes: usize,
}

/// One cloud of all settled cells.
fn fused(all: &[Gathered]) -> Fused {
    let coloured = all.iter().all(|gathered| gathered.colours.len() == gathered.blocks.cells.len());
    let rows: Vec<&[Settled]> =
        all.iter().flat_map(|gathered| gathered.before.rows.iter().map(Vec::as_slice)).collect();
    let ((points, normals), (views_per_point, colours)) = pool::join(
        || (of_all(&rows, |settled| settled.at), of_all(&rows, |settled| settled.normal)),
        || {
            let colours = coloured.then(|| of_all(&rows, |settled| settled.colour));
            (of_all(&rows, |settled| settled.views), colours)
        },
    );
    Fused {
        cloud: Cloud { normals: Some(normals), colours, ..Cloud::from_points(points) },
        views_per_point,
        returns: all.iter().map(|gathered| gathered.returns).sum(),
        voxel_m: all[0].grid.voxel_m,
    }
}

/// Collects a value of every settled cell, row by row.
fn of_all<T: Zeroable + Send>(rows: &[&[Settled]], of: impl Fn(&Settled) -> T + Sync) -> Vec<T> {
    let mut all = bytemuck::zeroed_vec(rows.iter().map(|row| row.len()).sum());
    let mut rest = &mut all[..];
    let mut parts = Vec::with_capacity(rows.len());
    for row in rows {
        let (part, after) = rest.split_at_mut(row.len());
        parts.push((part, row));
        rest = after;
    }
    pool::for_each(
        &mut parts,
        1,
        || (),
        |(), _, (part, row): &mut (&mut [T], &&[Settled])| {
            part.iter_mut().zip(**row).for_each(|(one, settled)| *one = of(settled));
        },
    );
    all
}

impl Gathered {
    /// Settles the cells touched since the last time, and keeps the state for further views.
    pub(super) fn settle(&mut self, gazes: &[Gaze]) {
        let Before { means, mut rows, gazes: known } = std::mem::take(&mut self.before);
        let is_first = rows.is_empty();
        let means = self.means(means);
        rows.resize_with(self.blocks.len().div_ceil(TOGETHER), Vec::new);
        let settle_row = |row: &mut Vec<Settled>, number: usize, before: &mut Vec<Settled>| {
            row.clear();
            let mut known_cells = before.iter().peekable();
            for block in (number * TOGETHER..self.blocks.len()).take(TOGETHER) {
                let mask = if is_first { [u64::MAX; SIDE] } else { self.blocks.touched[block] };
                if mask == Mask::default() {
                    row.extend(self.blocks.cells_of(block).filter_map(|cell| stays(&mut known_cells, cell)));
                } else {
                    self.settle_block(block, &mask, &means, &mut known_cells, row);
                }
            }
            drop_looked_through(row, gazes, known);
            // The memory of what was there before is the next row's.
            std::mem::swap(row, before);
        };
        pool::for_each(&mut rows, 1, Vec::new, settle_row);
        self.before = Before { means, rows, gazes: gazes.len() };
        self.blocks.touched.fill(Mask::default());
    }

    /// Means of all voxels, reusing earlier ones; empty for columns, whose means are computed when
    /// needed.
    fn means(&self, before: Vec<Cell>) -> Vec<Cell> {
        /// Number of cells per thread. From: work.
        const SOME: usize = 4096;
        let cells = if self.flat { &[][..] } else { &self.blocks.cells };
        let mut means = before;
        if means.is_empty() {
            // With room for those of further looks.
            means.reserve(cells.len() + cells.len() / 2);
            means.extend(pool::map(cells, SOME, Cell::mean));
        } else {
            means.extend_from_slice(&cells[means.len()..]);
            self.blocks.visit_touched(|number| means[number] = cells[number].mean());
        }
        means
    }

    /// Adds the settled state of a block's cells: new for cells in the mask, unchanged for the
    /// others.
    fn settle_block(
        &self,
        block: usize,
        mask: &Mask,
        means: &[Cell],
        before: &mut Peekable<Iter<Settled>>,
        settled: &mut Vec<Settled>,
    ) {
        let Gathered { grid, axes_from_world, flat, blocks, colours: sums, .. } = self;
        let beside = &blocks.beside(block);
        let world_from_axes = axes_from_world.inverse().to_rotation_matrix();
        let turn = world_from_axes.cast::<f32>();
        let colour = |number: usize, cell: &Cell| {
            // Half up by cutting off: rounding is a call on some processors.
            let mean = sums.get(number).map(|sum| (sum / cell.weight).map(|c| (c + 0.5) as u8));
            mean.map(<[u8; 3]>::from).unwrap_or_default()
        };
        let mut keep = |number: usize, anew: Option<(&Cell, Vector3<f32>)>| {
            let stays = stays(before, number);
            let Some((cell, at)) = anew else { return settled.extend(stays) };
            let at = world_from_axes * Point3::from(grid.origin_m + at.cast::<f64>() * grid.voxel_m);
            let none = cell.normal == Vector3::zeros();
            let normal = if none { Vector3::repeat(f32::NAN) } else { turn * cell.normal };
            let (colour, views) = (colour(number, cell), cell.views);
            settled.push(Settled { at: at.cast(), normal, colour, views, cell: number as u32, anew: true });
        };
        match flat {
            true => level(blocks, beside, mask, |number, anew| {
                keep(number, anew.as_ref().map(|(cell, at)| (cell, *at)));
            }),
            false => blocks.visit(beside, mask, |number, around| {
                let mean = &means[number];
                let smoothed = |around: &[u32]| smoothed(mean, around, means, grid.voxel_m as f32);
                keep(number, around.map(|around| (mean, smoothed(around))));
            }),
        }
    }
}

/// Earlier settled state of a cell, if any; cells must be asked for in order.
fn stays(before: &mut Peekable<Iter<Settled>>, cell: usize) -> Option<Settled> {
    before.next_if(|settled| settled.cell as usize == cell).map(|settled| Settled { anew: false, ..*settled })
}

/// Drops cells that only one view shows and another looked through; unchanged cells were already
/// checked against the first `known` views.
fn drop_looked_through(row: &mut Vec<Settled>, gazes: &[Gaze], known: usize) {
    let mut looked = [(false, known), (true, 0)].map(|(anew, known)| {
        let mut alone: Vec<Point3<f32>> = Vec::new();
        if gazes.len() > 1 {
            alone.reserve(row.len());
            let of = |settled: &&Settled| settled.views < 2 && settled.anew == anew;
            alone.extend(row.iter().filter(of).map(|settled| settled.at));
        }
        let mut through = vec![false; alone.len()];
        gazes[known..].iter().for_each(|gaze| gaze.pass(&alone, CARVE_M, &mut through));
        through.into_iter()
    });
    row.retain(|settled| {
        let through = settled.views < 2 && looked[usize::from(settled.anew)].next().unwrap_or(false);
        !through && is_finite(&settled.at)
    });
}

/// Mean of a voxel, moved along its normal onto the mean of the surrounding voxels with similar
/// normals.
#[inline(always)]
fn smoothed(own: &Cell, around: &[u32], cells: &[Cell], voxel_m: f32) -> Vector3<f32> {
    /// Minimum cosine between normals of voxels that are smoothed together. From: chosen, about
    /// 46°.
    const ALIKE: f32 = 0.7;
    let tube = TUBE_SPREADS * VOXEL_SPREAD_M / voxel_m;
    let (mut weight, mut offset) = (0.0, 0.0);
    for &number in around {
        let near = &cells[number as usize];
        let gap = own.normal.dot(&(near.at - own.at));
        let counts = gap.abs() < tube && near.normal.dot(&own.normal) > ALIKE;
        let share = if counts { near.weight } else { 0.0 };
        weight += share;
        offset += share * gap;
    }
    if weight > 0.0 { own.at + own.normal * (offset / weight) } else { own.at }
}

/// Calls `found` for each column of the middle block with its number and, if the mask holds it, its
/// mean and the same point moved along z to the mean of the surrounding columns.
fn level(
    blocks: &VoxelBlocks<Cell>,
    beside: &Beside,
    mask: &Mask,
    mut found: impl FnMut(usize, Option<(Cell, Vector3<f32>)>),
) {
    let numbers = blocks.wide_columns(beside);
    // Weight and weighted height: of the columns, then of three beside each other.
    let mut sums = [[[0.0_f32; WIDE]; WIDE]; 2];
    for (y, row) in numbers.iter().enumerate() {
        for (x, &number) in row.iter().enumerate().filter(|(_, number)| **number != NONE) {
            let cell = &blocks.cells[number as usize];
            sums[0][y][x] = cell.weight;
            sums[1][y][x] = cell.weight * (cell.at.z / cell.weight);
        }
    }
    let across = sums.map(|sums| {
        sums.map(|row| -> [f32; SIDE] { std::array::from_fn(|x| row[x] + row[x + 1] + row[x + 2]) })
    });
    for y in 0..SIDE {
        let [weights, heights] = across.each_ref().map(|rows| -> [f32; SIDE] {
            std::array::from_fn(|x| rows[y][x] + rows[y + 1][x] + rows[y + 2][x])
        });
        for x in 0..SIDE {
            let number = numbers[y + 1][x + 1];
            if number != NONE {
                let anew = is_in(mask, [x + 1, y + 1, 1]).then(|| {
                    let own = blocks.cells[number as usize].mean();
                    (own, Vector3::new(own.at.x, own.at.y, heights[x] / weights[x]))
                });
                found(number as usize, anew);
            }
        }
    }
}

/// Merged cloud of the gathered voxels, with its diagnostics.
pub(super) fn merged(
    gathered: &[Gathered],
    seen: Visibility,
    fits: Vec<ViewFit>,
    mut steps: Vec<Step>,
) -> Merged {
    let fused = fused(gathered);
    steps.push(Step {
        name: "fuse".to_owned(),
        points: fused.cloud.len(),
        result: format!("{} returns in voxels of {:.1} mm", fused.returns, 1e3 * fused.voxel_m),
    });
    Merged { cloud: fused.cloud, views_per_point: fused.views_per_point, visibility: seen, fits, steps }
}
