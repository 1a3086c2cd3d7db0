//! Local registration of views on one round body.
//!
//! Merging moves views as wholes, which leaves errors of about a centimetre: localisation errs, and
//! the front and the back of a lone cup have no point in common. Each view of a round body by
//! itself shows where the axis is. So each view gets a small shift with standard deviation
//! [`PLACE_M`], found together with axis, radius and slope.

use super::asker::{Asker, Lying};
use crate::round::{
    self, MOST_INDEPENDENT, RADIUS_SPREAD_M, Round, SLOPE_SPREAD, STEEPEST, distance, side_band,
};
use crate::scale::{EDGE_M, PLACE_M, SHAPE_M};
use crate::segment::Segment;
use crate::surface::{floor, range_sigma_m};
use crate::visibility::DepthMap;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix4, Point3, Vector3, Vector4};
use rustc_hash::FxHashMap;

/// Maximum shift of a view, metres; beyond it, the view shows another object. From: chosen.
const MOST_M: f64 = 0.03;
/// Maximum ratio of the side's spread after and before registration. From: chosen.
const ROUNDER: f64 = 0.85;
/// Maximum distance of used points from the side, metres, decreasing over the iterations.
/// From: chosen, one a step.
const GATES_M: [f64; 8] = [0.02, 0.02, 0.016, 0.016, 0.012, 0.012, 0.01, 0.01];
/// Maximum number of points used of each view. From: chosen.
const ENOUGH: usize = 400;
/// Minimum number of points on the side for a view to be used. From: chosen.
const FEWEST: usize = 40;
/// Minimum share of a view's points that lie on the registered body. From: chosen.
const ON_IT: f64 = 0.7;
/// Maximum spread of a view's points about the registered body, in standard deviations of a
/// measurement. From: chosen.
const WELL: f64 = 1.3;

/// Body with registered views.
pub(super) struct Settled<'a> {
    pub segment: Segment,
    /// Visibility queries with the cameras at their registered poses.
    pub asker: Asker<'a>,
    pub round: Round,
}

/// Registers the views on a round body; `None` if they already agree, or if registration does not
/// make the points rounder.
pub(super) fn settle<'a>(
    round: &Round,
    segment: &Segment,
    asker: &Asker<'a>,
    (base_m, top_m): (f64, f64),
    sigma_m: f64,
) -> Option<Settled<'a>> {
    if asker.views.len() < 2 || round.spread_m < sigma_m.max(SHAPE_M) {
        return None;
    }
    let cells = Cells::of(&segment.points);
    let shown: Vec<Vec<Point3<f64>>> = asker.views.iter().map(|view| shown_of(view, &cells)).collect();
    let band = side_band(base_m, top_m);
    let sides: Vec<Side> = shown
        .iter()
        .zip(&asker.views)
        .map(|(points, view)| Side::of(points.iter().filter(|p| band.contains(&p.z)), view, round))
        .collect();
    let (body, shifts) = lay(round, &sides)?;
    let moved = shown
        .into_iter()
        .zip(&shifts)
        .flat_map(|(points, &[x, y])| points.into_iter().map(move |p| Point3::new(p.x - x, p.y - y, p.z)));
    // What lay beside the body before and does so still is another thing, or the edge of one.
    let of_it = |p: &Point3<f64>| body.outside_m(p) < PLACE_M || cells.holds(p);
    let segment = Segment { points: thinned(moved.filter(of_it)), ..segment.clone() };
    let settled = round::fit(&segment.points, base_m, top_m, sigma_m, round::SEED)?;
    if settled.spread_m > ROUNDER * round.spread_m {
        return None;
    }
    let views = asker.views.iter().zip(&shifts).map(|(view, shift_m)| view.moved(*shift_m)).collect();
    Some(Settled { segment, asker: Asker { views, ..asker.clone() }, round: settled })
}

/// Part of the side shown by one view.
struct Side {
    points: Vec<Point3<f64>>,
    /// Standard deviation of a measurement, metres.
    sigma_m: f64,
}

impl Side {
    fn of<'p>(points: impl Iterator<Item = &'p Point3<f64>>, view: &Lying<'_>, round: &Round) -> Side {
        let near = |p: &&Point3<f64>| round.outside_m(p).abs() < GATES_M[0] + PLACE_M;
        let mut points: Vec<Point3<f64>> = points.filter(near).copied().collect();
        let step = points.len().div_ceil(ENOUGH).max(1);
        points = points.into_iter().step_by(step).collect();
        if points.len() < FEWEST {
            points.clear();
        }
        let middle = Point3::new(round.x, round.y, round.middle_m);
        Side { points, sigma_m: range_sigma_m((middle - view.viewpoint).norm()) }
    }
}

/// Estimates the body and the shift of each view (surface frame, metres) by Gauss-Newton. `None` if
/// no shift matters, one is too large, or a view's points still do not lie on the body.
fn lay(round: &Round, sides: &[Side]) -> Option<(Round, Vec<[f64; 2]>)> {
    /// Number of body parameters (axis, radius, slope) before the shifts. From: derived, two for
    /// the axis and one each for radius and slope.
    const BODY: usize = 4;
    /// Distance from the axis below which the direction away from it is undefined, metres. From: rounding.
    const AT_AXIS_M: f64 = 1e-6;
    if sides.iter().filter(|side| !side.points.is_empty()).count() < 2 {
        return None;
    }
    let mut body = *round;
    let mut shifts = vec![[0.0_f64; 2]; sides.len()];
    for gate_m in GATES_M {
        let size = BODY + 2 * sides.len();
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size));
        for (v, side) in sides.iter().enumerate() {
            let weight = (MOST_INDEPENDENT / side.points.len().max(1) as f64).min(1.0) / side.sigma_m.powi(2);
            let at = BODY + 2 * v;
            let (mut own, mut own_right) = (Matrix4::zeros(), Vector4::zeros());
            for p in &side.points {
                let (x, y) = (p.x - body.x - shifts[v][0], p.y - body.y - shifts[v][1]);
                let from_axis = distance(x, y).max(AT_AXIS_M);
                let miss = from_axis - body.radius_at(p.z);
                if miss.abs() > gate_m {
                    continue;
                }
                let w = weight * (1.0 - (miss / gate_m).powi(2)).powi(2);
                let row = Vector4::new(x / from_axis, y / from_axis, 1.0, p.z - body.middle_m);
                own += row * (row * w).transpose();
                own_right += row * (w * miss);
            }
            // A shift of the view does what one of the axis does.
            let columns = [0, 1, 2, 3, at, at + 1].into_iter().zip([0, 1, 2, 3, 0, 1]);
            for (i, a) in columns.clone() {
                right[i] += own_right[a];
                columns.clone().for_each(|(j, b)| normal[(i, j)] += own[(a, b)]);
            }
            for k in 0..2 {
                normal[(at + k, at + k)] += PLACE_M.powi(-2);
                right[at + k] -= shifts[v][k] * PLACE_M.powi(-2);
            }
        }
        for (k, spread) in [(2, RADIUS_SPREAD_M), (3, SLOPE_SPREAD)] {
            normal[(k, k)] += spread.powi(-2);
        }
        right[3] -= body.slope * SLOPE_SPREAD.powi(-2);
        let step = normal.cholesky()?.solve(&right);
        body.x += step[0];
        body.y += step[1];
        body.radius_m += step[2];
        body.slope = (body.slope + step[3]).clamp(-STEEPEST, STEEPEST);
        shifts.iter_mut().enumerate().for_each(|(v, s)| {
            s[0] += step[BODY + 2 * v];
            s[1] += step[BODY + 2 * v + 1];
        });
    }
    let far = shifts.iter().map(|s| s[0].hypot(s[1])).fold(0.0, f64::max);
    let on_it = |(side, shift): (&Side, &[f64; 2])| side.lies_on(&body, *shift);
    ((EDGE_M..MOST_M).contains(&far) && body.radius_m > 0.0 && sides.iter().zip(&shifts).all(on_it))
        .then_some((body, shifts))
}

impl Side {
    /// True if the points, shifted back, lie on a body's side with the spread of the camera's
    /// noise.
    fn lies_on(&self, body: &Round, [x, y]: [f64; 2]) -> bool {
        /// Maximum distance of tested points from the side, metres, unless two standard deviations
        /// are more. From: derived, the last of the gates.
        const GATE_M: f64 = GATES_M[GATES_M.len() - 1];
        let misses = self.points.iter().map(|p| body.outside_m(&Point3::new(p.x - x, p.y - y, p.z)));
        let near: Vec<f64> = misses.filter(|m| m.abs() < GATE_M.max(2.0 * self.sigma_m)).collect();
        let spread_m = (near.iter().map(|m| m * m).sum::<f64>() / near.len().max(1) as f64).sqrt();
        self.points.is_empty()
            || (near.len() as f64 > ON_IT * self.points.len() as f64
                && spread_m < SHAPE_M.max(WELL * self.sigma_m))
    }
}

/// Cells that a body's points occupy seen from above, and the points' height range.
struct Cells {
    /// Cell with the least x and y.
    first: [i32; 2],
    /// Number of cells along x and y.
    sizes: [i32; 2],
    /// True for each cell that holds points.
    own: Vec<bool>,
    /// True for each cell that holds points or is next to one that does.
    beside: Vec<bool>,
    /// Least coordinates of the points, x and y lowered by two cells, metres.
    low: Point3<f64>,
    /// Greatest coordinates of the points, x and y raised by two cells, metres.
    high: Point3<f64>,
}

impl Cells {
    fn of(points: &[Point3<f64>]) -> Cells {
        let ends = |end: fn(f64, f64) -> f64, from: f64| {
            let reach = points.iter().fold(Point3::new(from, from, from), |a, p| {
                Point3::new(end(a.x, p.x), end(a.y, p.y), end(a.z, p.z))
            });
            reach - Vector3::new(1.0, 1.0, 0.0) * (from.signum() * 2.0 * PLACE_M)
        };
        let (low, high) = (ends(f64::min, f64::INFINITY), ends(f64::max, f64::NEG_INFINITY));
        let first = Cells::cell(&low);
        let last = Cells::cell(&high);
        let sizes = [0, 1].map(|k| last[k] - first[k] + 1);
        let none = vec![false; (sizes[0] * sizes[1]) as usize];
        let mut cells = Cells { first, sizes, own: none.clone(), beside: none, low, high };
        for p in points {
            if let Some(place) = cells.place(p) {
                cells.own[place] = true;
            }
        }
        // What has points lies two cells or so within the rectangle.
        let wide = sizes[0] as usize;
        for place in (0..cells.own.len()).filter(|&place| cells.own[place]) {
            for row in [place - wide, place, place + wide] {
                cells.beside[row - 1..=row + 1].fill(true);
            }
        }
        cells
    }

    fn cell(p: &Point3<f64>) -> [i32; 2] {
        [p.x, p.y].map(|m| floor(m / PLACE_M))
    }

    /// Index of a point's cell; `None` outside the rectangle.
    fn place(&self, p: &Point3<f64>) -> Option<usize> {
        if !(p.x > self.low.x && p.x < self.high.x && p.y > self.low.y && p.y < self.high.y) {
            return None;
        }
        let [x, y] = Cells::cell(p);
        Some(((y - self.first[1]) * self.sizes[0] + x - self.first[0]) as usize)
    }

    fn holds(&self, p: &Point3<f64>) -> bool {
        self.place(p).is_some_and(|place| self.own[place])
    }

    /// True if a point is in or next to the cells and within the body's height range.
    fn reaches(&self, p: &Point3<f64>) -> bool {
        p.z > self.low.z && p.z < self.high.z && self.place(p).is_some_and(|place| self.beside[place])
    }
}

/// Points measured by a camera in or next to a body's cells, surface frame.
fn shown_of(view: &Lying<'_>, body: &Cells) -> Vec<Point3<f64>> {
    let mut shown = Vec::new();
    let Some([columns, rows]) = pixels_of(view.map, &view.surface_from_camera.inverse(), body) else {
        return shown;
    };
    let i = view.map.intrinsics;
    let turn = view.surface_from_camera.rotation.to_rotation_matrix().into_inner();
    let across = turn.column(0) / i.fx;
    for v in rows {
        let first = turn * Vector3::new(-i.cx / i.fx, (v as f64 - i.cy) / i.fy, 1.0);
        let row = &view.map.depths_m[v * i.width..][columns.clone()];
        for (u, &z) in columns.clone().zip(row) {
            let p = view.viewpoint + (first + across * u as f64) * f64::from(z);
            // What is no number is in no cell.
            if body.reaches(&p) {
                shown.push(p);
            }
        }
    }
    shown
}

/// Pixel window (columns and rows) of a body's box; `None` if out of view, or partly behind the
/// camera.
fn pixels_of(
    map: &DepthMap,
    camera_from_surface: &Isometry3<f64>,
    body: &Cells,
) -> Option<[std::ops::Range<usize>; 2]> {
    let mut reach = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for corner in 0..8 {
        let of = |k: usize| if corner >> k & 1 == 0 { body.low[k] } else { body.high[k] };
        let (u, v) = map.intrinsics.project(&(camera_from_surface * Point3::new(of(0), of(1), of(2))))?;
        for (reach, at) in reach.iter_mut().zip([u, v]) {
            *reach = [reach[0].min(at), reach[1].max(at)];
        }
    }
    let sizes = [map.intrinsics.width, map.intrinsics.height];
    let mut ranges = reach.into_iter().zip(sizes).map(|([low, high], size)| {
        let within = |at: f64| at.clamp(0.0, size as f64) as usize;
        within(low.floor())..within(high.ceil() + 1.0)
    });
    Some([ranges.next()?, ranges.next()?])
}

/// Thins points to the mean of those in each cube of side [`EDGE_M`].
fn thinned(points: impl Iterator<Item = Point3<f64>>) -> Vec<Point3<f64>> {
    let mut cubes: FxHashMap<[i32; 3], usize> = FxHashMap::default();
    let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
    for p in points {
        let cube = [p.x, p.y, p.z].map(|m| floor(m / EDGE_M));
        let at = *cubes.entry(cube).or_insert_with(|| {
            sums.push((Vector3::zeros(), 0.0));
            sums.len() - 1
        });
        sums[at].0 += p.coords;
        sums[at].1 += 1.0;
    }
    sums.into_iter().map(|(sum, n)| Point3::from(sum / n)).collect()
}
