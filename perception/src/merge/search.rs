//! Step 4, first half: exhaustive search for the pose of a view's objects on those of the other
//! views, before point distances can be trusted.
//!
//! With the table level, localisation leaves open a shift along the table and a rotation about the
//! vertical. Small objects far apart give many local minima to a local method, so these few degrees
//! of freedom are searched on a grid, coarse to fine.

use super::parts::FEWEST;
use crate::pool;
use crate::surface::floor;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use rustc_hash::FxHashSet;

/// Surface point with its unit normal.
pub(super) type Oriented = (Point3<f64>, Vector3<f64>);

/// Number of the view's points used in the search. From: chosen.
const TRIED: usize = 220;
/// Maximum distance of surfaces from a view's centre, along the table and in height, that take
/// part, metres. From: chosen.
const FARTHEST_M: [f64; 2] = [3.0, 1.5];
/// Side of the coarse and fine cells, metres. From: chosen.
const CELLS_M: [f64; 2] = [0.03, 0.012];
/// Minimum share of points that must match the others' surfaces. From: chosen.
pub(super) const SURE_SHARE: f64 = 0.25;
/// Minimum matching share for a view that would otherwise be left out: views from opposite sides
/// share little. From: chosen, so that of 40 pairs of views from opposite sides none is left out,
/// in place of 16.
pub(super) const PERHAPS_SHARE: f64 = 0.0;

/// Cost of a correction at the edge of the window (three spreads of localisation), as a share of the points.
/// From: chosen.
const PRIOR: f64 = 0.15;

/// Score of a point in an occupied cell of the same facing. From: chosen.
const HIT: u8 = 20;
/// Score of a point in a cell next to an occupied one of the same facing. From: chosen.
const BESIDE: u8 = 7;

/// Score grid of the aligned surfaces: for each of six facings (±x, ±y, ±z), the score of a point
/// in each cell.
struct Cells {
    /// Side of a cell, metres.
    side_m: f64,
    /// Lowest cell.
    low: [i32; 3],
    /// Number of cells along x, y and z.
    size: [usize; 3],
    /// Scores of cells for six facings, in the order z, x, y, so that shifts along y are
    /// contiguous.
    worth: Vec<u8>,
}

/// Sides that a normal faces by more than `least`: 0 to 5 for +x, −x, +y, −y, +z, −z.
fn sides(normal: &Vector3<f64>, least: f64) -> impl Iterator<Item = usize> {
    (0..6)
        .filter(move |side| if side % 2 == 0 { normal[side / 2] > least } else { normal[side / 2] < -least })
}

impl Cells {
    /// Cells around points, with room for `reach` cells to each side.
    fn new(points: &[Oriented], side_m: f64, reach: i32) -> Cells {
        /// Minimum component of a normal along a side for a surface to face that side.
        /// From: chosen.
        const FACES: f64 = 0.3;
        let key = |p: &Point3<f64>| [p.x, p.y, p.z].map(|c| floor(c / side_m));
        let keys: Vec<[i32; 3]> = points.iter().map(|(p, _)| key(p)).collect();
        let (low, high) = keys.iter().fold(([i32::MAX; 3], [i32::MIN; 3]), |(low, high), k| {
            (std::array::from_fn(|c| low[c].min(k[c])), std::array::from_fn(|c| high[c].max(k[c])))
        });
        let margin = [reach + 1, reach + 1, 1];
        let low: [i32; 3] = std::array::from_fn(|c| low[c] - margin[c]);
        let size: [usize; 3] = std::array::from_fn(|c| (high[c] + margin[c] - low[c]) as usize + 1);
        let mut cells = Cells { side_m, low, size, worth: vec![0; 6 * size.iter().product::<usize>()] };
        for ((_, normal), key) in points.iter().zip(&keys) {
            let Some(at) = cells.index(*key) else { continue };
            for side in sides(normal, FACES) {
                cells.mark(side, at);
            }
        }
        cells
    }

    /// Index of a cell; `None` outside.
    fn index(&self, key: [i32; 3]) -> Option<usize> {
        let at: [usize; 3] = std::array::from_fn(|c| key[c].wrapping_sub(self.low[c]) as usize);
        (0..3).all(|c| at[c] < self.size[c]).then(|| (at[2] * self.size[0] + at[0]) * self.size[1] + at[1])
    }

    /// Marks a cell as occupied by a surface that faces `side`, and the cells around as beside one.
    fn mark(&mut self, side: usize, at: usize) {
        let (row, plane) = (self.size[1], self.size[0] * self.size[1]);
        let table = side * plane * self.size[2];
        if self.worth[table + at] == HIT {
            return;
        }
        for z in [at - plane, at, at + plane] {
            for x in [z - row, z, z + row] {
                for worth in &mut self.worth[table + x - 1..table + x + 2] {
                    *worth = (*worth).max(BESIDE);
                }
            }
        }
        self.worth[table + at] = HIT;
    }

    /// Mean score (1 for a hit) of the points for all shifts of up to `reach` cells along x and y,
    /// row by row of x.
    fn scores(&self, points: &[(Point3<f64>, usize)], reach: i32) -> Vec<f64> {
        /// Number of shifts along y that are summed at once (SIMD lanes). From: work.
        const LANES: usize = 8;
        let across = (2 * reach + 1) as usize;
        let wide = across.next_multiple_of(LANES);
        let mut sums = vec![0_u32; across * wide];
        let table = self.size.iter().product::<usize>();
        for (p, side) in points {
            let key = [p.x, p.y, p.z].map(|c| floor(c / self.side_m));
            let worth = &self.worth[side * table..(side + 1) * table];
            for (i, sums) in (-reach..=reach).zip(sums.chunks_exact_mut(wide)) {
                // A row that sticks out of the cells on one side is met shift by shift.
                let shifted =
                    |j: i32| self.index([key[0].saturating_add(i), key[1].saturating_add(j), key[2]]);
                let row =
                    shifted(-reach).zip(shifted(reach)).and_then(|(from, _)| worth.get(from..from + wide));
                if let Some(row) = row {
                    let (sums, row) = (sums.as_chunks_mut::<LANES>().0, row.as_chunks::<LANES>().0);
                    for (sums, row) in sums.iter_mut().zip(row) {
                        sums.iter_mut().zip(row).for_each(|(sum, &worth)| *sum += u32::from(worth));
                    }
                } else {
                    for (j, sum) in (-reach..=reach).zip(sums) {
                        *sum += shifted(j).map_or(0, |at| u32::from(worth[at]));
                    }
                }
            }
        }
        let whole = f64::from(HIT) * points.len().max(1) as f64;
        let rows = sums.chunks_exact(wide).flat_map(|row| &row[..across]);
        rows.map(|&sum| f64::from(sum) / whole).collect()
    }
}

/// Maximum error of a view along the table and about the vertical.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub shift_m: f64,
    pub turn_rad: f64,
}

/// Best placement of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// Rigid motion in the world that corrects the view's pose.
    pub correction: Isometry3<f64>,
    /// Share of the view's points that match at the found pose.
    pub share: f64,
}

/// Share of the view's points that match the placed surfaces at the current pose; 0 without points.
pub(super) fn fits(view: &[Oriented], placed: &[Oriented], up: &Unit<Vector3<f64>>) -> f64 {
    let Some(Levelled { tried, placed, .. }) = levelled(view, placed, &frame(up)) else { return 0.0 };
    Cells::new(&placed, CELLS_M[1], 0).scores(&turned(&tried, 0.0), 0)[0]
}

/// Points of a view with a placed point within the maximum shift; the others cannot match.
fn within_reach(view: &[Oriented], placed: &[Oriented], shift_m: f64) -> Vec<Oriented> {
    let cell = |p: &Point3<f64>| [p.x, p.y, p.z].map(|c| floor(c / shift_m));
    let taken: FxHashSet<[i32; 3]> = placed.iter().map(|(p, _)| cell(p)).collect();
    let near = |(p, _): &&Oriented| {
        let [x, y, z] = cell(p);
        let step = || -1..=1;
        step().any(|i| step().any(|j| step().any(|k| taken.contains(&[x + i, y + j, z + k]))))
    };
    view.iter().filter(near).copied().collect()
}

/// View and placed points in a level frame, metres from the view's centre.
struct Levelled {
    /// A sample of the view's points, at most about `TRIED`.
    tried: Vec<Oriented>,
    /// Points near enough to be matched.
    placed: Vec<Oriented>,
    /// Centre of the view's sampled points in the level frame, metres.
    middle: Vector3<f64>,
}

/// Points in a level frame; `None` if the view or the placed surfaces have none.
fn levelled(view: &[Oriented], placed: &[Oriented], level: &Isometry3<f64>) -> Option<Levelled> {
    let stride = (view.len() / TRIED).max(1);
    let mut tried: Vec<Oriented> = view.iter().step_by(stride).map(|(p, n)| (level * p, level * n)).collect();
    let middle = tried.iter().fold(Vector3::zeros(), |m, (p, _)| m + p.coords) / tried.len().max(1) as f64;
    tried.iter_mut().for_each(|(p, _)| *p -= middle);
    let near = |(p, _): &Oriented| p.x.abs().max(p.y.abs()) < FARTHEST_M[0] && p.z.abs() < FARTHEST_M[1];
    let placed: Vec<Oriented> =
        placed.iter().map(|(p, n)| (level * p - middle, level * n)).filter(near).collect();
    (!tried.is_empty() && !placed.is_empty()).then_some(Levelled { tried, placed, middle })
}

/// Correction (world from world) that best matches `view` (points and normals off the planes, world
/// frame) with `placed`; `None` if there are too few points, or less than the minimum share
/// matches.
pub(super) fn place(
    view: &[Oriented],
    placed: &[Oriented],
    up: &Unit<Vector3<f64>>,
    window: Window,
    least_share: f64,
) -> Option<Placed> {
    /// Steps of the turn, coarse and fine, radians. From: chosen.
    const TURN_STEPS_RAD: [f64; 2] = [0.03, 0.009];
    /// Range of the fine search around the best coarse poses, metres and radians. From: derived, a
    /// coarse cell and three fine steps.
    const FINE: (f64, f64) = (CELLS_M[0], 0.027);
    if view.len() < FEWEST || placed.len() < FEWEST {
        return None;
    }
    let level = frame(up);
    let Levelled { tried, placed, middle } =
        levelled(&within_reach(view, placed, window.shift_m), placed, &level)?;
    let mut best = [Candidate { x: 0.0, y: 0.0, turn: 0.0, score: 0.0 }; 3];
    for (stage, side_m) in CELLS_M.into_iter().enumerate() {
        let (shift, turn) = if stage == 0 { (window.shift_m, window.turn_rad) } else { FINE };
        let turn_step = TURN_STEPS_RAD[stage];
        let (turns, shifts) = ((turn / turn_step).ceil() as i32, (shift / side_m).ceil() as i32);
        let cells = Cells::new(&placed, side_m, shifts);
        let starts: &[Candidate] = if stage == 0 { &best[..1] } else { &best };
        let tries: Vec<(&Candidate, f64)> = starts
            .iter()
            .flat_map(|start| (-turns..=turns).map(move |t| (start, start.turn + f64::from(t) * turn_step)))
            .collect();
        let candidates = |&(start, angle): &(&Candidate, f64)| -> Vec<Candidate> {
            let mut turned = turned(&tried, angle);
            turned.iter_mut().for_each(|(p, _)| *p += Vector3::new(start.x, start.y, 0.0));
            let shifted = (-shifts..=shifts).flat_map(|i| (-shifts..=shifts).map(move |j| (i, j)));
            let of_shift = |((i, j), score): ((i32, i32), f64)| {
                let (x, y) = (start.x + f64::from(i) * side_m, start.y + f64::from(j) * side_m);
                let score = score
                    - PRIOR * (x * x + y * y) / window.shift_m.powi(2)
                    - PRIOR * (angle / window.turn_rad).powi(2);
                Candidate { x, y, turn: angle, score }
            };
            shifted.zip(cells.scores(&turned, shifts)).map(of_shift).collect()
        };
        let found: Vec<Candidate> = pool::map(&tries, 1, candidates).into_iter().flatten().collect();
        best = distinct(&found, 2.0 * side_m);
    }
    let Candidate { x, y, turn: angle, score } = best[0];
    if score < least_share {
        return None;
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let about = Translation3::from(middle) * turn * Translation3::from(-middle);
    let correction = Translation3::new(x, y, 0.0) * about;
    let costs = PRIOR * (x.hypot(y) / window.shift_m).powi(2) + PRIOR * (angle / window.turn_rad).powi(2);
    let correction = level.inverse() * correction * level;
    Some(Placed { correction, share: score + costs })
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    x: f64,
    y: f64,
    turn: f64,
    score: f64,
}

/// Three best candidates in distinct minima.
fn distinct(found: &[Candidate], apart: f64) -> [Candidate; 3] {
    let mut kept = [found[0]; 3];
    for k in 0..3 {
        let other = |c: &&Candidate| {
            kept[..k].iter().all(|kept| (kept.x - c.x).powi(2) + (kept.y - c.y).powi(2) > apart * apart)
        };
        // Of equally good ones the first.
        let best = found.iter().filter(other).reduce(|best, c| if c.score > best.score { c } else { best });
        kept[k] = *best.unwrap_or(&kept[0]);
    }
    kept
}

/// Points rotated about the vertical, each with its dominant facing.
fn turned(points: &[Oriented], angle: f64) -> Vec<(Point3<f64>, usize)> {
    /// Difference below which components of a normal count as equal. From: rounding.
    const ALIKE: f64 = 1e-9;
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
    let most = |n: Vector3<f64>| sides(&n, n.amax() - ALIKE).next().unwrap_or(0);
    points.iter().map(|(p, n)| (turn * p, most(turn * n))).collect()
}

/// Rotation from the world to a frame with z up.
fn frame(up: &Unit<Vector3<f64>>) -> Isometry3<f64> {
    let turn = UnitQuaternion::rotation_between(up, &Vector3::z()).unwrap_or_else(|| {
        UnitQuaternion::from_matrix(&Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)))
    });
    Isometry3::from_parts(Translation3::identity(), turn)
}
