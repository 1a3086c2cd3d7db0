//! Joins parts of vessels: near outside and far inside meet only in a thin rim, which cameras do
//! not resolve.

use super::footprint::{OUTSIDE, bounds, hull_from_above, middle, most_within};
use super::scene::{Segment, top_m};
use crate::outline;
use crate::pool;
use crate::quantile::{POINT_ENDS, end};
use crate::round::lying::{self, LyingRound};
use crate::round::{self, Round, SECTORS, STEEPEST, distance, sector};
use crate::scale::{APART_M, HANDLE_M, HANDLE_WIDTH_M, PLACE_M, SHAPE_M};
use crate::surface::nearest_sigma_m;
use nalgebra::Point3;
use std::sync::OnceLock;

/// Maximum radius of a vessel, metres. From: chosen.
const WIDEST_M: f64 = 0.14;
/// Minimum share of both parts' points on the common round body. From: chosen.
const ON_BODY: f64 = 0.85;
/// Minimum share of the side of each of two parts on its own round body for both to be images of
/// one body, and of a rim on its circle; handles lie off. From: chosen, more than half.
const ON_MOST: f64 = 0.55;
/// Maximum distance between the axes of one body, as a share of the smaller radius. From: chosen,
/// two bodies cannot stand so near to each other.
const ONE_PLACE: f64 = 0.5;
/// Maximum residual of a body's side, as a share of the residual of any box. From: chosen.
const OF_BOX: f64 = 0.6;

/// Part with cached values for pairwise tests.
pub struct Candidate {
    /// Index among all parts; `None` for parts that were joined.
    number: Option<usize>,
    segment: Segment,
    low: Point3<f64>,
    high: Point3<f64>,
    top_m: f64,
    /// Convex hull of the points seen from above, computed on demand.
    hull: OnceLock<Vec<[f64; 2]>>,
    /// Best-fitting upright round body, computed on demand; `None` if none fits.
    fitted: OnceLock<Option<Fitted>>,
    /// Lying round body, computed on demand; `None` if none fits.
    lying: OnceLock<Option<LyingRound>>,
}

impl Candidate {
    fn new(number: Option<usize>, segment: Segment) -> Candidate {
        let (low, high) = bounds(&segment.points);
        let top_m = top_m(&segment);
        Candidate {
            number,
            segment,
            low,
            high,
            top_m,
            hull: OnceLock::new(),
            fitted: OnceLock::new(),
            lying: OnceLock::new(),
        }
    }

    fn fitted(&self, viewpoints: &[Point3<f64>]) -> Option<&Fitted> {
        self.fitted
            .get_or_init(|| Fitted::to(&self.segment.points, self.low.z, self.top_m, viewpoints))
            .as_ref()
    }

    /// Lying round body of the part; `None` if it is no rounder than a box.
    fn lying(&self, viewpoints: &[Point3<f64>]) -> Option<&LyingRound> {
        let fit = || {
            let points = &self.segment.points;
            // What is higher than it is long stands.
            if (self.high - self.low).xy().norm() < self.top_m {
                return None;
            }
            let (bounds, sigma_m) =
                (outline::bounding(points)?, nearest_sigma_m(points.first()?, viewpoints));
            let found = lying::fit(points, &bounds, 0.0, sigma_m)?;
            let fitted = Fitted { body: found.body.round, sigma_m };
            fitted.is_tight(&found.points).then_some(found.body)
        };
        self.lying.get_or_init(fit).as_ref()
    }

    fn hull(&self) -> &[[f64; 2]] {
        self.hull.get_or_init(|| hull_from_above(&self.segment.points))
    }
}

/// Joins parts on one upright round body, and the parts inside it.
pub fn whole(mut parts: Vec<Segment>, viewpoints: &[Point3<f64>]) -> Vec<Segment> {
    parts.sort_by(|a, b| b.indices.len().cmp(&a.indices.len()).then(a.indices.cmp(&b.indices)));
    let parts = parts.into_iter().enumerate();
    let mut parts: Vec<Candidate> = parts.map(|(n, part)| Candidate::new(Some(n), part)).collect();
    // All at once, as if none were joined: most are not.
    let with_all = |n: usize| pool::map(&parts[n + 1..], 1, |other| one_vessel(&parts[n], other, viewpoints));
    let pairs: Vec<Vec<bool>> = pool::each(parts.len(), 1, with_all);
    let mut first = 0;
    while first < parts.len() {
        let is_one = |second: usize| match (parts[first].number, parts[second].number) {
            (Some(one), Some(other)) => pairs[one][other - one - 1],
            _ => one_vessel(&parts[first], &parts[second], viewpoints),
        };
        match pool::find_first(first + 1..parts.len(), |second| is_one(second).then_some(second)) {
            Some(second) => {
                let other = parts.remove(second);
                parts[first] = Candidate::new(None, parts[first].segment.with(&other.segment));
            }
            None => first += 1,
        }
    }
    parts.into_iter().map(|c| c.segment).collect()
}

fn one_vessel(large: &Candidate, small: &Candidate, viewpoints: &[Point3<f64>]) -> bool {
    /// Approximate number of points of both parts used for fitting a body. From: work.
    const ENOUGH: usize = 2000;
    if !near(large, small) {
        return is_level(large, small) && is_in_reach(large, small) && one_rim([large, small], viewpoints);
    }
    let inside = small.top_m < large.top_m + PLACE_M && footprint_inside(large, small);
    let fitted = large.fitted(viewpoints).filter(|f| f.is_tight(&large.segment.points));
    if inside && fitted.is_some() || fitted.is_some_and(|f| is_handle(&f.body, large, small)) {
        return true;
    }
    if lies_within(large, small, viewpoints) {
        return true;
    }
    if !is_level(large, small) {
        return false;
    }
    if in_one_place(large, small, viewpoints) {
        return true;
    }
    let parts = [large, small].map(|part| &part.segment.points);
    let stride = parts.iter().map(|points| points.len()).sum::<usize>().div_ceil(ENOUGH).max(1);
    let both: Vec<Point3<f64>> =
        parts.into_iter().flat_map(|points| points.iter().step_by(stride)).copied().collect();
    let top = large.top_m.max(small.top_m);
    round_body(&both, large.low.z.min(small.low.z), top, viewpoints).is_some_and(|body| {
        // Each part on its own must keep to the common body: one alone may carry the fit.
        [large, small].iter().all(|part| share_on(&body, &part.segment) >= ON_BODY)
    }) || one_rim([large, small], viewpoints)
}

/// True if a part lies inside another part that is a lying round body.
fn lies_within(large: &Candidate, small: &Candidate, viewpoints: &[Point3<f64>]) -> bool {
    large.lying(viewpoints).is_some_and(|LyingRound { turned, round, ends_m: [low, high] }| {
        let ends_m = low - PLACE_M..high + PLACE_M;
        let points = &small.segment.points;
        let own = points.iter().map(|p| turned * p);
        let within = own.filter(|p| ends_m.contains(&p.z) && round.outside_m(p) < PLACE_M).count();
        within as f64 >= ON_BODY * points.len() as f64
    })
}

/// True if the upper ends of two parts lie on one circle that encloses both: near outside and far
/// inside of a bowl, whose side is not conical.
fn one_rim(parts: [&Candidate; 2], viewpoints: &[Point3<f64>]) -> bool {
    let top_m = parts[0].top_m.max(parts[1].top_m);
    let rims = parts.map(|part| {
        let points = part.segment.points.iter().copied();
        points.filter(|p| p.z > top_m - APART_M).collect::<Vec<_>>()
    });
    let both = rims.concat();
    let Some(fitted) = Fitted::to(&both, top_m - APART_M, top_m, viewpoints) else { return false };
    let body = &fitted.body;
    let is_on = |p: &&Point3<f64>| body.outside_m(p).abs() < PLACE_M;
    let on = |of: &[Point3<f64>]| of.iter().filter(is_on).count() as f64 / of.len().max(1) as f64;
    let mut seen = [false; SECTORS];
    both.iter().filter(is_on).for_each(|p| seen[sector(p.x - body.x, p.y - body.y)] = true);
    let is_within = |p: &&Point3<f64>| distance(p.x - body.x, p.y - body.y) < body.radius_at(top_m) + APART_M;
    let holds = |part: &Candidate| {
        let points = &part.segment.points;
        points.iter().filter(is_within).count() as f64 >= ON_BODY * points.len() as f64
    };
    seen.iter().filter(|seen| **seen).count() * 2 >= SECTORS
        && rims.iter().all(|rim| on(rim) >= ON_MOST)
        && parts.into_iter().all(holds)
        && fitted.is_near(&both, ON_MOST)
}

/// True if two parts are equally high.
fn is_level(large: &Candidate, small: &Candidate) -> bool {
    (large.top_m - small.top_m).abs() <= APART_M
}

/// Round body with nearly all side points on it; `None` if none fits or it is no rounder than a
/// box.
pub(super) fn round_body(
    points: &[Point3<f64>],
    low_m: f64,
    top_m: f64,
    viewpoints: &[Point3<f64>],
) -> Option<Round> {
    Fitted::to(points, low_m, top_m, viewpoints).filter(|f| f.is_tight(points)).map(|f| f.body)
}

/// Round body fitted to points, however badly.
struct Fitted {
    body: Round,
    /// Standard deviation of one measurement, metres.
    sigma_m: f64,
}

impl Fitted {
    fn to(points: &[Point3<f64>], low_m: f64, top_m: f64, viewpoints: &[Point3<f64>]) -> Option<Fitted> {
        /// Seed of the proposed circles. From: mark.
        const SEED: u64 = 3;
        let sigma_m = nearest_sigma_m(points.first()?, viewpoints);
        let body = round::fit(points, low_m, top_m, sigma_m, SEED)?;
        (body.radius_m < WIDEST_M).then_some(Fitted { body, sigma_m })
    }

    /// True if the points' residual from the body is below this share of their residual from any
    /// box.
    fn beats_box(&self, points: &[Point3<f64>], share: f64) -> bool {
        !outline::fits(points, self.body.residual_m / share)
    }

    /// True if nearly all points lie on the body within the measurement error; a handle may lie
    /// off.
    fn is_tight(&self, points: &[Point3<f64>]) -> bool {
        self.is_near(points, ON_BODY)
    }

    /// True if at least this share of the points lies on the body within the measurement error, and
    /// much nearer than to a box.
    fn is_near(&self, points: &[Point3<f64>], share: f64) -> bool {
        self.body.residual_m < 2.0 * self.sigma_m + SHAPE_M
            && self.body.inliers >= share
            && self.beats_box(points, OF_BOX)
    }

    /// True if most of the points lie on the body, much nearer than to a box, and the points
    /// determine the body's position.
    fn is_placed(&self, points: &[Point3<f64>]) -> bool {
        self.body.inliers >= ON_MOST
            && self.body.place_sigma_m < ONE_PLACE * self.body.radius_m
            && self.beats_box(points, OF_BOX)
    }
}

/// True if two parts are images of one body in slightly misregistered views, as two bodies cannot
/// stand in one place.
fn in_one_place(a: &Candidate, b: &Candidate, viewpoints: &[Point3<f64>]) -> bool {
    let (Some(one), Some(other)) = (a.fitted(viewpoints), b.fitted(viewpoints)) else { return false };
    let apart_m = (one.body.x - other.body.x).hypot(one.body.y - other.body.y);
    apart_m < ONE_PLACE * one.body.radius_m.min(other.body.radius_m)
        && one.is_placed(&a.segment.points)
        && other.is_placed(&b.segment.points)
}

/// True if a part is a handle of a vessel: it begins at the wall, has a handle's width and reach,
/// and ends below the rim.
fn is_handle(body: &Round, large: &Candidate, small: &Candidate) -> bool {
    let points = &small.segment.points;
    let [x, y] = middle(points);
    let (dx, dy) = (x - body.x, y - body.y);
    let far_m = dx.hypot(dy);
    if far_m < body.radius_m / 2.0 || small.top_m > large.top_m + APART_M {
        return false;
    }
    let out = |p: &Point3<f64>| ((p.x - body.x) * dx + (p.y - body.y) * dy) / far_m - body.radius_m;
    let aside = |p: &Point3<f64>| ((p.x - body.x) * dy - (p.y - body.y) * dx) / far_m;
    let outs: Vec<f64> = points.iter().map(out).collect();
    let (first, last) = (end(&outs, POINT_ENDS.0), end(&outs, POINT_ENDS.1));
    let within = points.iter().filter(|p| aside(p).abs() < 0.5 * (HANDLE_WIDTH_M + PLACE_M)).count();
    first < APART_M && last < HANDLE_M.1 && within as f64 >= ON_BODY * points.len() as f64
}

fn share_on(body: &Round, part: &Segment) -> f64 {
    let on = part.points.iter().filter(|p| body.outside_m(p) < PLACE_M).count();
    on as f64 / part.points.len().max(1) as f64
}

/// True if the bounding boxes of two parts are near each other.
pub fn near(a: &Candidate, b: &Candidate) -> bool {
    (0..3).all(|k| a.low[k] - APART_M < b.high[k] && b.low[k] - APART_M < a.high[k])
}

/// True if two parts are near enough for a vessel of maximum radius to reach both.
fn is_in_reach(a: &Candidate, b: &Candidate) -> bool {
    let across_m = 2.0 * (WIDEST_M + STEEPEST * APART_M + APART_M);
    (0..2).all(|k| a.low[k] - across_m < b.high[k] && b.low[k] - across_m < a.high[k])
}

fn footprint_inside(large: &Candidate, small: &Candidate) -> bool {
    let beside =
        |p: &&Point3<f64>| p.x < large.low.x || p.x > large.high.x || p.y < large.low.y || p.y > large.high.y;
    let points = &small.segment.points;
    // The outline is drawn only where the box around it does not settle it.
    points.iter().filter(beside).count() * OUTSIDE.1 <= points.len() * OUTSIDE.0
        && most_within(large.hull(), points, |p| [p.x, p.y])
}
