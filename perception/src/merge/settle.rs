//! Step 5, second half: the voxels moved onto their common surface.
//!
//! Every voxel is moved along its normal onto the weighted mean of the like-facing voxels beside it, every column of a sheet along the sheet's
//! normal onto that of the columns beside it. What a single view claims and another looked through is left out. What no view has touched
//! since it was settled stays as it is.

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

/// What is known of gathered cells since they were settled last, by their numbers.
#[derive(Default)]
pub(super) struct Settled {
    means: Vec<Cell>,
    /// Where they belong, world frame, metres.
    at: Vec<Point3<f32>>,
    /// Which of them a camera looked through while a single view claimed them ...
    through: Vec<bool>,
    /// ... and which none did, of the first so many.
    alone: Vec<u32>,
    asked: usize,
}

/// One cloud of what was gathered.
pub(super) fn settle(all: &mut [Gathered], seen: &Visibility) -> Fused {
    let gazes = seen.gazes();
    all.iter_mut().for_each(|gathered| gathered.settle(&gazes));
    let most = all.iter().map(|gathered| gathered.bricks.cells.len()).sum();
    let coloured = all.iter().all(|gathered| gathered.colours.len() == gathered.bricks.cells.len());
    let mut fused = Fused {
        cloud: Cloud::from_points(Vec::with_capacity(most)),
        views_per_point: Vec::with_capacity(most),
        returns: all.iter().map(|gathered| gathered.returns).sum(),
        voxel_m: all[0].grid.voxel_m,
    };
    let mut normals = Vec::with_capacity(most);
    let mut colours = Vec::with_capacity(if coloured { most } else { 0 });
    for gathered in all.iter() {
        let turn = gathered.axes_from_world.inverse().to_rotation_matrix().cast::<f32>();
        let Settled { means, at, through, .. } = &gathered.settled;
        for number in (0..gathered.bricks.len()).flat_map(|brick| gathered.bricks.of(brick)) {
            let (cell, at) = (&means[number], at[number]);
            if (cell.views < 2 && through[number]) || !is_finite(&at) {
                continue;
            }
            fused.cloud.points.push(at);
            let none = cell.normal == Vector3::zeros();
            normals.push(if none { Vector3::repeat(f32::NAN) } else { turn * cell.normal });
            fused.views_per_point.push(cell.views);
            if coloured {
                // Half up by cutting off: rounding is a call on some processors.
                let mean = (gathered.colours[number] / cell.weight).map(|c| (c + 0.5) as u8);
                colours.push(<[u8; 3]>::from(mean));
            }
        }
    }
    fused.cloud.normals = Some(normals);
    fused.cloud.colours = coloured.then_some(colours);
    fused
}

impl Gathered {
    /// Settles what was touched since the last time.
    fn settle(&mut self, gazes: &[Gaze]) {
        /// Bricks that one thread settles in a row, and such rows at a time: what they fill is used again. From: work.
        const TOGETHER: usize = 64;
        const ROWS: usize = 32;
        let first_new = self.settled.means.len();
        let changed = self.take_means();
        self.look_through(gazes, first_new);
        let Gathered { grid, axes_from_world, flat, bricks, settled, .. } = self;
        let Settled { means, at, .. } = settled;
        let world_from_axes = axes_from_world.inverse().to_rotation_matrix();
        let stale: Vec<usize> = (0..bricks.len()).filter(|&brick| bricks.is_near_touched(brick)).collect();
        let mut rows: Vec<Vec<(usize, Point3<f32>)>> = vec![Vec::new(); ROWS];
        for some in stale.chunks(TOGETHER * ROWS) {
            rows.par_iter_mut().zip(some.par_chunks(TOGETHER)).for_each(|(row, some)| {
                row.clear();
                let mut keep = |number: usize, at: Vector3<f32>| {
                    let at = world_from_axes * Point3::from(grid.origin_m + at.cast::<f64>() * grid.voxel_m);
                    row.push((number, at.cast()));
                };
                for &brick in some {
                    match *flat {
                        true => level(bricks, means, brick, &mut keep),
                        false => bricks.visit(brick, |number, around| {
                            if around.iter().any(|&near| changed[near as usize]) {
                                keep(number, smoothed(&means[number], around, means, grid.voxel_m as f32));
                            }
                        }),
                    }
                }
            });
            let rows = &rows[..some.len().div_ceil(TOGETHER)];
            rows.iter().flatten().for_each(|&(number, settled)| at[number] = settled);
        }
        bricks.rest();
    }

    /// The means of the cells that views have been added to; tells which these are.
    fn take_means(&mut self) -> Vec<bool> {
        let Gathered { bricks, settled: Settled { means, at, through, .. }, .. } = self;
        let cells = &bricks.cells;
        means.resize(cells.len(), Cell::EMPTY);
        at.resize(cells.len(), Point3::origin());
        through.resize(cells.len(), false);
        let renew = |(mean, cell): (&mut Cell, &Cell)| {
            let changed = mean.views != cell.views;
            if changed {
                *mean = cell.mean();
            }
            changed
        };
        means.iter_mut().zip(cells).map(renew).collect()
    }

    /// One view's word against another's look through the place: of each place each look is asked once.
    fn look_through(&mut self, gazes: &[Gaze], first_new: usize) {
        /// Places that one thread asks about at a time. From: work.
        const SOME: usize = 1024;
        let Gathered { grid, axes_from_world, settled, .. } = self;
        let Settled { means, through, alone, asked, .. } = settled;
        let world_from_axes = axes_from_world.inverse().to_rotation_matrix();
        let place = |&number: &u32| -> Point3<f32> {
            let at = means[number as usize].at.cast::<f64>();
            (world_from_axes * Point3::from(grid.origin_m + at * grid.voxel_m)).cast()
        };
        let is_alone = |number: &u32| means[*number as usize].views < 2;
        alone.retain(is_alone);
        let new: Vec<u32> = (first_new as u32..means.len() as u32).filter(is_alone).collect();
        // A look is not asked about itself alone.
        let gazes = if gazes.len() > 1 { gazes } else { &[] };
        for (numbers, gazes) in [(std::mem::take(alone), &gazes[*asked..]), (new, gazes)] {
            let mut found = vec![false; numbers.len()];
            numbers.par_chunks(SOME).zip(found.par_chunks_mut(SOME)).for_each(|(some, found)| {
                let places: Vec<Point3<f32>> = some.iter().map(place).collect();
                gazes.iter().for_each(|gaze| gaze.pass(&places, CARVE_M, found));
            });
            numbers.iter().zip(&found).for_each(|(number, found)| through[*number as usize] = *found);
            alone.extend(numbers.iter().zip(found).filter(|(_, found)| !found).map(|(number, _)| number));
        }
        *asked = gazes.len();
    }
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

/// Calls `found` for each column of a brick with its number and its mean, moved along z onto the mean of the columns around it.
fn level(bricks: &Bricks<Cell>, cells: &[Cell], brick: usize, mut found: impl FnMut(usize, Vector3<f32>)) {
    let numbers = bricks.layer(brick, 1);
    // Weight and weighted height: of the columns, then of three beside each other.
    let mut sums = [[[0.0_f32; WIDE]; WIDE]; 2];
    for (y, row) in numbers.iter().enumerate() {
        for (x, &number) in row.iter().enumerate().filter(|(_, number)| **number != NONE) {
            let cell = &cells[number as usize];
            sums[0][y][x] = cell.weight;
            sums[1][y][x] = cell.weight * cell.at.z;
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
                let own = cells[number as usize].at;
                found(number as usize, Vector3::new(own.x, own.y, heights[x] / weights[x]));
            }
        }
    }
}
