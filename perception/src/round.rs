//! Fits an upright body of revolution with straight sides (cylinder, cup) to one object.

#[doc(hidden)]
pub mod lying;
#[doc(hidden)]
pub mod side;

use crate::draw::Draws;
use crate::quantile::quantile;
use crate::scale::{EDGE_M, PLACE_M};
use nalgebra::{Point3, Vector4};
use side::{SidePoints, Sums};
use std::ops::Range;

/// Minimum and maximum radius of a body, metres. From: chosen.
const RADII_M: (f64, f64) = (0.012, 0.20);
/// Number of random circles proposed per fit. From: chosen.
const PROPOSALS: usize = 120;
/// Maximum number of points that score a proposed circle. From: chosen.
const JUDGES: usize = 160;
/// Maximum number of points used in all steps of a fit but the last. From: chosen.
const SCOUTS: usize = 800;
/// Minimum number of side points to start a fit, and of points near the side to continue.
/// From: chosen.
const FEWEST: (usize, usize) = (20, 12);
/// Maximum distance of used points from the side in the first steps of a fit, in multiples of the
/// tolerance. From: chosen.
const FIRST_GATES: [f64; 2] = [3.0, 2.0];
/// Number of directions around an axis. From: chosen.
pub const SECTORS: usize = 36;
/// Shares of the height, at the foot and below the top, excluded from the side. From: chosen.
pub(crate) const ENDS: (f64, f64) = (0.15, 0.1);
/// Prior standard deviation of the radius of objects on tables, metres. From: chosen.
pub(crate) const RADIUS_SPREAD_M: f64 = 0.05;
/// Prior standard deviation of the slope (growth of the radius with height). From: chosen.
pub(crate) const SLOPE_SPREAD: f64 = 0.1;
/// Maximum slope (growth of the radius with height). From: chosen.
pub const STEEPEST: f64 = 0.6;
/// Share of the side's points that a fitted circle must explain: on any flat face some circle
/// explains a third. From: chosen, just above a third; on real mugs a circle explains half of the
/// side.
pub(crate) const NO_CIRCLE: f64 = 0.34;
/// Seed of the proposed circles in segments. From: mark.
pub(crate) const SEED: u64 = 7;

/// An upright cone frustum in the surface's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// Position of the axis along x, metres.
    pub x: f64,
    /// Position of the axis along y, metres.
    pub y: f64,
    /// Radius at the middle height, metres.
    pub radius_m: f64,
    /// Growth of the radius with height, metres per metre.
    pub slope: f64,
    /// Middle height, metres above the surface.
    pub middle_m: f64,
    /// Standard deviation of the axis position along x or y, metres.
    pub place_sigma_m: f64,
    /// Standard deviation of the radius, metres.
    pub radius_sigma_m: f64,
    /// Standard deviation of the slope.
    pub slope_sigma: f64,
    /// Root mean square distance of the inliers from the side, metres.
    pub residual_m: f64,
    /// Root mean square distance of all side points that are not inside the body, metres, each at
    /// most `OUTSIDE_M`.
    pub spread_m: f64,
    /// Share of the side's points that lie on the body.
    pub inliers: f64,
}

/// End of the body's silhouette against free space: along `direction`, the side reaches `reach_m`
/// from the origin at a height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// Horizontal unit vector.
    pub direction: [f64; 2],
    /// Reach of the side along `direction` from the frame's origin, metres.
    pub reach_m: f64,
    /// Height above the surface, metres.
    pub height_m: f64,
}

/// Standard deviation of a silhouette end, metres: about a pixel and a half at arm's length.
/// From: chosen.
const EDGE_SIGMA_M: f64 = 0.0025;
/// Maximum effective number of points of one body, per view where views are registered on it:
/// depths of one body share systematic errors (a structured-light camera flattens round surfaces).
/// From: chosen.
pub(crate) const MOST_INDEPENDENT: f64 = 25.0;

/// Maximum distance of used points from the side in the last steps of a fit, in multiples of the
/// tolerance. From: chosen.
const LAST_GATE: f64 = 1.5;
/// Limit of a point's distance outside the side in [`Round::spread_m`], metres; larger distances
/// are clamped. From: chosen.
const OUTSIDE_M: f64 = 0.02;

impl Round {
    /// Radius at a height above the surface, metres.
    pub fn radius_at(&self, z: f64) -> f64 {
        (self.radius_m + self.slope * (z - self.middle_m)).max(EDGE_M)
    }

    /// Distance of a point from the side, positive outside, metres.
    pub fn outside_m(&self, p: &Point3<f64>) -> f64 {
        distance(p.x - self.x, p.y - self.y) - self.radius_at(p.z)
    }
}

/// Sector index, of [`SECTORS`], of the direction (`x`, `y`) from an axis.
#[inline]
pub fn sector(x: f64, y: f64) -> usize {
    /// Tangents of the sector borders within a quarter turn. From: derived, every ten degrees.
    const ENDS: [f64; SECTORS / 4 - 1] = [
        0.176_326_980_708_464_98,
        0.363_970_234_266_202_36,
        0.577_350_269_189_625_8,
        0.839_099_631_177_280_1,
        1.191_753_592_594_21,
        1.732_050_807_568_877,
        2.747_477_419_454_622,
        5.671_281_819_617_709,
    ];
    let (quarter, along, across) = match () {
        () if y > 0.0 && x <= 0.0 => (1, y, -x),
        () if y <= 0.0 && x < 0.0 => (2, -x, -y),
        () if y < 0.0 && x >= 0.0 => (3, -y, x),
        () => (0, x, y),
    };
    let beyond: usize = ENDS.iter().map(|end| usize::from(across >= end * along)).sum();
    // Of what lies on the axis itself none is beyond.
    quarter * (SECTORS / 4) + if along > 0.0 { beyond } else { 0 }
}

/// Euclidean length, without the overflow protection of the slower `hypot`.
#[inline(always)]
pub fn distance(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Fits the side of a round body to the points between `base_m` and `top_m`; `sigma_m` is the spread of a measurement.
///
/// `None` if there are too few side points or they lie on no circle of a sensible size.
pub fn fit(points: &[Point3<f64>], base_m: f64, top_m: f64, sigma_m: f64, seed: u64) -> Option<Round> {
    let height = top_m - base_m;
    let side = SidePoints::between(points, base_m, top_m);
    if side.len() < FEWEST.0 {
        return None;
    }
    let tolerance = tolerance(sigma_m);
    let circle = propose(&side, tolerance, seed)?;
    let middle_m = base_m + 0.5 * height;
    let mut round = Round {
        x: side.origin[0] + circle[0],
        y: side.origin[1] + circle[1],
        radius_m: circle[2],
        slope: 0.0,
        middle_m,
        place_sigma_m: 0.0,
        radius_sigma_m: 0.0,
        slope_sigma: 0.0,
        residual_m: 0.0,
        spread_m: 0.0,
        inliers: 0.0,
    };
    let few = side.thinned(SCOUTS);
    for gate in [FIRST_GATES[0], FIRST_GATES[1], LAST_GATE, LAST_GATE] {
        round = improve(&round, &few, &[], gate * tolerance, sigma_m)?;
    }
    let round = improve(&round, &side, &[], LAST_GATE * tolerance, sigma_m)?;
    (round.radius_m > RADII_M.0).then_some(round)
}

/// Refits the body with silhouette constraints on its width, which depth alone measures badly;
/// `None` if too few points lie near the side.
pub(crate) fn refit(
    round: &Round,
    points: &[Point3<f64>],
    edges: &[Edge],
    base_m: f64,
    top_m: f64,
    sigma_m: f64,
) -> Option<Round> {
    let side = SidePoints::between(points, base_m, top_m);
    let tolerance = tolerance(sigma_m);
    let mut round = *round;
    let few = side.thinned(SCOUTS);
    for _ in 0..3 {
        round = improve(&round, &few, edges, LAST_GATE * tolerance, sigma_m)?;
    }
    let round = improve(&round, &side, edges, LAST_GATE * tolerance, sigma_m)?;
    (round.radius_m > RADII_M.0).then_some(round)
}

impl Round {
    /// Body shifted along a horizontal unit vector towards the camera until its side is centred in
    /// the points; `None` for too few points. Depth errors lie along the view, so a circle
    /// through such points is too near and too small.
    pub fn behind(
        &self,
        points: &[Point3<f64>],
        (base_m, top_m): (f64, f64),
        [to_x, to_y]: [f64; 2],
    ) -> Option<Round> {
        let band = side_band(base_m, top_m);
        let side = points.iter().filter(|p| band.contains(&p.z)).filter_map(|p| {
            let (x, y, r) = (p.x - self.x, p.y - self.y, self.radius_at(p.z));
            let (along, across) = (x * to_x + y * to_y, x * to_y - y * to_x);
            (across.abs() < r).then(|| along - (r * r - across * across).sqrt())
        });
        let mut shifts: Vec<f64> = side.collect();
        if shifts.len() < FEWEST.1 {
            return None;
        }
        let shift_m = quantile(&mut shifts, 0.5);
        Some(Round { x: self.x + shift_m * to_x, y: self.y + shift_m * to_y, ..*self })
    }

    /// Root mean square distance, metres, of the side points for which `counts` is true, as
    /// [`Round::spread_m`].
    pub fn spread_of(
        &self,
        points: &[Point3<f64>],
        (base_m, top_m): (f64, f64),
        sigma_m: f64,
        counts: impl Fn(&Point3<f64>) -> bool,
    ) -> f64 {
        let gate = LAST_GATE * tolerance(sigma_m);
        let band = side_band(base_m, top_m);
        let side = points.iter().filter(|p| band.contains(&p.z) && counts(p));
        let misses = side.map(|p| self.outside_m(p)).filter(|&d| d > -gate);
        let (n, squares) = misses.fold((0.0, 0.0), |(n, s), d| (n + 1.0, s + d.min(OUTSIDE_M).powi(2)));
        (squares / f64::max(n, 1.0)).sqrt()
    }
}

/// Maximum distance of a measurement from the side that it is of, metres.
fn tolerance(sigma_m: f64) -> f64 {
    (2.0 * sigma_m).clamp(EDGE_M, PLACE_M)
}

/// Height band between base and top in which points can be on the side.
pub(crate) fn side_band(base_m: f64, top_m: f64) -> Range<f64> {
    let height = top_m - base_m;
    base_m + ENDS.0 * height..top_m - ENDS.1 * height
}

/// Best of random circles through three points, with the most points on the circle and the fewest
/// outside, seen from above: centre, relative to the side's first point, and radius, metres.
fn propose(side: &SidePoints, tolerance: f64, seed: u64) -> Option<[f64; 3]> {
    let mut rng = Draws::new(seed);
    let judges = side.judges(JUDGES);
    let mut best: Option<(f32, [f64; 3])> = None;
    for _ in 0..PROPOSALS {
        let mut pick = || side.place(rng.below(side.len()));
        let Some(circle) = circumcircle(pick(), pick(), pick()) else { continue };
        if circle[2] < RADII_M.0 || circle[2] > RADII_M.1 {
            continue;
        }
        let beaten = best.map_or(f32::NEG_INFINITY, |(score, _)| score);
        best = judges.score(circle, tolerance, beaten).map(|score| (score, circle)).or(best);
    }
    best.map(|(_, circle)| circle)
}

fn circumcircle(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Option<[f64; 3]> {
    let (bx, by, cx, cy) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
    /// Minimum of four times the area of three points for a circle through them, square metres.
    /// From: rounding.
    const FLAT_M2: f64 = 1e-7;
    let twice = 2.0 * (bx * cy - by * cx);
    if twice.abs() < FLAT_M2 {
        return None;
    }
    let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
    let (ux, uy) = ((cy * b2 - by * c2) / twice, (bx * c2 - cx * b2) / twice);
    Some([a[0] + ux, a[1] + uy, distance(ux, uy)])
}

/// Takes a Gauss-Newton step on axis, radius and slope over the points within `gate` of the side;
/// `None` if the points are too few or the step is undetermined.
fn improve(round: &Round, side: &SidePoints, edges: &[Edge], gate: f64, sigma_m: f64) -> Option<Round> {
    let Sums { normal, right, squares, count, outside, spread } = side.sums(round, gate);
    if count < FEWEST.1 as f64 {
        return None;
    }
    let weight = (MOST_INDEPENDENT / count).min(1.0) / sigma_m.powi(2);
    let (mut normal, mut right) = (normal * weight, right * weight);
    for edge in edges {
        let [a, b] = edge.direction;
        let rise = edge.height_m - round.middle_m;
        let missing = edge.reach_m - (a * round.x + b * round.y + round.radius_m + round.slope * rise);
        let row = Vector4::new(a, b, 1.0, rise);
        // An edge far off is another thing's edge: its pull stays bounded.
        let w = 1.0 / (EDGE_SIGMA_M.powi(2) * (1.0 + (missing / PLACE_M).powi(2)));
        normal += row * row.transpose() * w;
        right += row * (missing * w);
    }
    // Weak priors keep what the points do not tell near a cylinder.
    normal[(2, 2)] += 1.0 / (RADIUS_SPREAD_M * RADIUS_SPREAD_M);
    normal[(3, 3)] += 1.0 / (SLOPE_SPREAD * SLOPE_SPREAD);
    right[3] -= round.slope / (SLOPE_SPREAD * SLOPE_SPREAD);
    let inverse = normal.try_inverse()?;
    let step = inverse * right;
    let sd = |i: usize| inverse[(i, i)].max(0.0).sqrt();
    let improved = Round {
        x: round.x + step[0],
        y: round.y + step[1],
        radius_m: round.radius_m + step[2],
        slope: (round.slope + step[3]).clamp(-STEEPEST, STEEPEST),
        middle_m: round.middle_m,
        place_sigma_m: sd(0).hypot(sd(1)) / std::f64::consts::SQRT_2,
        radius_sigma_m: sd(2),
        slope_sigma: sd(3),
        residual_m: (squares / count).sqrt(),
        spread_m: (spread / f64::max(outside, 1.0)).sqrt(),
        inliers: count / side.len() as f64,
    };
    [improved.x, improved.y, improved.radius_m].iter().all(|v| v.is_finite()).then_some(improved)
}
