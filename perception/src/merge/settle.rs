//! Step 5, second half: the voxels moved onto their common surface.
//!
//! Every voxel is moved along its normal onto the weighted mean of the like-facing voxels beside it, every column of a sheet along the sheet's
//! normal onto that of the columns beside it. What a single view claims and another looked through is left out.

use super::bricks::{Bricks, NONE, SIDE, WIDE};
use super::check;
use super::fuse::{Cell, Fused, Gathered};
use crate::cloud::{Cloud, is_finite};
use crate::visibility::{Gaze, Visibility};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// How far along its normal a voxel may be moved by its neighbours, in spreads of its own. From: chosen.
const TUBE_SPREADS: f32 = 2.5;
/// The spread of a voxel: that of a point at arm's length, metres. A voxel of many points is no narrower a tube.
/// From: chosen, the sensor at .3 to 1.4 m has .0012 to .0031.
const VOXEL_SPREAD_M: f32 = 0.003;
/// Looks through a place this far off the surface say that nothing is there, metres.
/// From: derived, as where views are held against each other.
const CARVE_M: f64 = check::CLEAR_M;

/// Rows of bricks that are settled at a time: what they fill is used again. From: work.
const ROWS: usize = 16;

/// A fused point, world frame.
#[derive(Clone)]
struct Settled {
    at: Point3<f32>,
    normal: Vector3<f32>,
    colour: [u8; 3],
    views: u16,
}

/// One cloud of what was gathered.
pub(super) fn settle(all: &[Gathered], seen: &Visibility) -> Fused {
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
    let mut rows: Vec<Vec<Settled>> = vec![Vec::new(); ROWS];
    for gathered in all {
        gathered.settle(seen, &mut rows, |kept| {
            fused.cloud.points.extend(kept.iter().map(|settled| settled.at));
            normals.extend(kept.iter().map(|settled| settled.normal));
            fused.views_per_point.extend(kept.iter().map(|settled| settled.views));
            if let Some(colours) = &mut colours {
                colours.extend(kept.iter().map(|settled| settled.colour));
            }
        });
    }
    fused.cloud.normals = Some(normals);
    fused.cloud.colours = colours;
    fused
}

impl Gathered {
    /// Gives what is left of the cells, some rows at a time.
    fn settle(&self, seen: &Visibility, rows: &mut [Vec<Settled>], mut give: impl FnMut(&[Settled])) {
        /// Bricks that one thread settles in a row. From: work.
        const TOGETHER: usize = 64;
        /// Cells that one thread takes in a row. From: work.
        const SOME: usize = 4096;
        let Gathered { grid, axes_from_world, flat, bricks, colours: sums, .. } = self;
        let world_from_axes = axes_from_world.inverse().to_rotation_matrix();
        let turn = world_from_axes.cast::<f32>();
        let colour = |number: usize, cell: &Cell| {
            // Half up by cutting off: rounding is a call on some processors.
            let mean = sums.get(number).map(|sum| (sum / cell.weight).map(|c| (c + 0.5) as u8));
            mean.map(<[u8; 3]>::from).unwrap_or_default()
        };
        // That of a voxel is asked for by all around it, that of a column by few.
        let voxels = if *flat { &[][..] } else { &bricks.cells };
        let means: Vec<Cell> = voxels.par_iter().with_min_len(SOME).map(Cell::mean).collect();
        let gazes = seen.gazes();
        let settle_row = |row: usize, kept: &mut Vec<Settled>| {
            kept.clear();
            let mut keep = |number: usize, cell: &Cell, at: Vector3<f32>| {
                let at = world_from_axes * Point3::from(grid.origin_m + at.cast::<f64>() * grid.voxel_m);
                let none = cell.normal == Vector3::zeros();
                let normal = if none { Vector3::repeat(f32::NAN) } else { turn * cell.normal };
                kept.push(Settled { at: at.cast(), normal, colour: colour(number, cell), views: cell.views });
            };
            for brick in (row * TOGETHER..bricks.len()).take(TOGETHER) {
                match flat {
                    true => level(bricks, brick, &mut keep),
                    false => bricks.visit(brick, |number, around| {
                        let mean = &means[number];
                        keep(number, mean, smoothed(mean, around, &means, grid.voxel_m as f32));
                    }),
                }
            }
            drop_looked_through(kept, &gazes);
        };
        let all = bricks.len().div_ceil(TOGETHER);
        for first in (0..all).step_by(ROWS) {
            let rows = &mut rows[..ROWS.min(all - first)];
            rows.par_iter_mut().enumerate().for_each(|(row, kept)| settle_row(first + row, kept));
            rows.iter().for_each(|kept| give(kept));
        }
    }
}

/// One view's word against another's look through the place.
fn drop_looked_through(kept: &mut Vec<Settled>, gazes: &[Gaze]) {
    let mut alone: Vec<Point3<f32>> = Vec::new();
    if gazes.len() > 1 {
        alone.reserve(kept.len());
        alone.extend(kept.iter().filter(|settled| settled.views < 2).map(|settled| settled.at));
    }
    let mut through = vec![false; alone.len()];
    gazes.iter().for_each(|gaze| gaze.pass(&alone, CARVE_M, &mut through));
    let mut through = through.into_iter();
    kept.retain(|settled| {
        let through = settled.views < 2 && through.next().unwrap_or(false);
        !through && is_finite(&settled.at)
    });
}

/// The voxel's mean, moved along its normal onto the mean of the like-facing voxels around it.
#[inline(always)]
fn smoothed(own: &Cell, around: &[u32], cells: &[Cell], voxel_m: f32) -> Vector3<f32> {
    /// Voxels face alike if the cosine of the angle between their normals is more. From: chosen, about 46°.
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

/// Calls `found` for each column of a brick with its number, its mean, and where that lies once moved along z onto the mean of the columns
/// around it.
fn level(bricks: &Bricks<Cell>, brick: usize, mut found: impl FnMut(usize, &Cell, Vector3<f32>)) {
    let numbers = bricks.wide_columns(brick);
    // Weight and weighted height: of the columns, then of three beside each other.
    let mut sums = [[[0.0_f32; WIDE]; WIDE]; 2];
    for (y, row) in numbers.iter().enumerate() {
        for (x, &number) in row.iter().enumerate().filter(|(_, number)| **number != NONE) {
            let cell = &bricks.cells[number as usize];
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
                let own = bricks.cells[number as usize].mean();
                found(number as usize, &own, Vector3::new(own.at.x, own.at.y, heights[x] / weights[x]));
            }
        }
    }
}
