//! Bodies with a shoulder and a neck, such as bottles, which may have been segmented into two
//! parts.

use super::model::{ObjectModel, Shape};
use crate::round::{self, Round, distance};
use crate::scale::{APART_M, EDGE_M, PLACE_M};
use crate::segment::{Scene, Segment, quantile, top_m};

/// Minimum taper of a model that may have a shoulder; less is a straight side. From: chosen.
const NARROWS: f64 = 1.3;
/// Lower share of the height, which shows the part below the shoulder. From: chosen.
const BODY: f64 = 0.4;
/// Upper share of the height, which shows the neck. From: chosen.
const NECK: f64 = 0.1;
/// Minimum radius below the shoulder, as a share of the radius at the foot. From: chosen.
const SHOULDER: f64 = 0.9;
/// Minimum share of the lower part's points that lie on its fitted side. From: chosen, more than
/// half.
const ON_SIDE: f64 = 0.55;
/// Quantile of the distances from the axis that defines a radius. From: chosen, some points lie on
/// the top.
const RADIUS: f64 = 0.75;

/// A body with a neck.
pub(super) struct Necked {
    /// Whole body.
    pub whole: Segment,
    /// Part of the body below the shoulder.
    pub body: Segment,
    /// Height of the whole body above its support, metres.
    pub height_m: f64,
    /// Diameter at the base over diameter at the neck.
    pub taper: f64,
    /// Indices of the segments that are pieces of the body.
    pub pieces: Vec<usize>,
}

/// Joins segment `of` and the coaxial segments on top into a body with a neck; `None` unless some
/// model narrows so and has that height.
pub(super) fn necked(scene: &Scene, of: usize, models: &[ObjectModel], sigma_m: f64) -> Option<Necked> {
    let low = &scene.segments[of];
    let narrows = |m: &ObjectModel| m.shape == Shape::Round && m.taper.low > NARROWS;
    let may_be = |height_m: f64| {
        let is_as_high =
            |m: &ObjectModel| height_m > m.height_m.low - APART_M && height_m < m.height_m.high + APART_M;
        models.iter().any(|m| narrows(m) && is_as_high(m))
    };
    let top = top_m(low);
    let foot_m = low.base_m..low.base_m + BODY * (top - low.base_m);
    // Most segments are ruled out before anything is fitted.
    let highest_m = scene.segments.iter().map(top_m).fold(top, f64::max);
    if !models.iter().any(|m| narrows(m) && highest_m > low.base_m + m.height_m.low - APART_M) {
        return None;
    }
    let axis = round::fit(&low.points, foot_m.start, foot_m.end, sigma_m, round::SEED)?;
    if axis.inliers < ON_SIDE {
        return None;
    }
    let from_axis_m = |x: f64, y: f64| distance(x - axis.x, y - axis.y);
    let stands_on = |other: &Segment| {
        let n = other.points.len().max(1) as f64;
        let (x, y, z) = other.points.iter().fold((0.0, 0.0, 0.0), |s, p| (s.0 + p.x, s.1 + p.y, s.2 + p.z));
        from_axis_m(x / n, y / n) < PLACE_M + 0.5 * EDGE_M && z / n > foot_m.end
    };
    let others = (0..scene.segments.len()).filter(|&n| n != of && stands_on(&scene.segments[n]));
    let pieces: Vec<usize> = std::iter::once(of).chain(others).collect();
    let of_pieces = pieces.iter().map(|&n| &scene.segments[n]);
    let mut points: Vec<_> = of_pieces.flat_map(|piece| piece.indices.iter().zip(&piece.points)).collect();
    points.sort_by_key(|(index, _)| **index);
    let (indices, points) = points.into_iter().map(|(index, point)| (*index, *point)).unzip();
    let whole = Segment { indices, points, base_m: low.base_m, base_sigma_m: low.base_sigma_m };
    let height_m = top_m(&whole) - low.base_m;
    let neck_m = radius_m(&whole, &axis, low.base_m + (1.0 - NECK) * height_m..f64::INFINITY)?;
    let foot_radius_m = axis.radius_at(low.base_m);
    if !may_be(height_m) || foot_radius_m < NARROWS * neck_m {
        return None;
    }
    let steps = (height_m / PLACE_M) as usize;
    let level_m = |n: usize| low.base_m + n as f64 * PLACE_M;
    let is_body = |n: &usize| {
        radius_m(&whole, &axis, level_m(*n)..level_m(n + 1)).is_some_and(|r| r > SHOULDER * foot_radius_m)
    };
    let shoulder_m = level_m((0..steps).rev().find(is_body)? + 1);
    let below = whole.indices.iter().zip(&whole.points).filter(|(_, p)| p.z < shoulder_m);
    let (indices, points) = below.map(|(i, p)| (*i, *p)).unzip();
    let body = Segment { indices, points, base_m: low.base_m, base_sigma_m: low.base_sigma_m };
    Some(Necked { body, height_m, taper: foot_radius_m / neck_m, pieces, whole })
}

/// Radius of a body about an axis between two heights, metres; `None` if too little is visible.
fn radius_m(of: &Segment, axis: &Round, between_m: std::ops::Range<f64>) -> Option<f64> {
    /// Minimum number of points that determine a radius. From: chosen.
    const FEWEST: usize = 8;
    let points = of.points.iter().filter(|p| between_m.contains(&p.z));
    let mut from_axis_m: Vec<f64> = points.map(|p| distance(p.x - axis.x, p.y - axis.y)).collect();
    (from_axis_m.len() >= FEWEST).then(|| quantile(&mut from_axis_m, RADIUS))
}
