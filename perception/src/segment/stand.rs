//! Support of each object: the surface, another object, or the bottom of a vessel around it.

use super::footprint::{bounds, hull_from_above, middle};
use super::scene::{Segment, top_m};
use crate::pool;
use crate::quantile::{POINT_ENDS, end, quantile};
use crate::round::{SECTORS, sector};
use crate::scale::{APART_M, PLACE_M};
use crate::surface::Outline;
use nalgebra::{Point3, Vector3};
use std::sync::OnceLock;

/// Height of the bottom of a vessel or open carton with an object inside, and its standard
/// deviation, metres. From: chosen, bottoms of tins and pans are about one millimetre thick, those
/// of bowls and pots up to seven.
pub const BOTTOM_M: (f64, f64) = (0.004, 0.003);

/// Maximum distance between an object's lower edge and the measured top of its support, metres.
/// From: chosen.
const MEETS_M: f64 = 0.03;
/// Minimum number of directions (of 36) around an object's centre in which an enclosing object must
/// be seen. From: chosen.
const AROUND: usize = 27;
/// Minimum number of directions (of 36) around an object's centre in which a supporting object must
/// be seen. From: chosen.
const BEARS: usize = 15;

/// Determines the support of each segment: the surface, another segment around its foot, or the
/// bottom of one that encloses it. Returns the height of each segment's top, metres.
pub fn on(parts: &mut [Segment]) -> Vec<f64> {
    let of = |part: &Segment| (top_m(part), bounds(&part.points));
    let (tops, boxes): (Vec<f64>, Vec<_>) = pool::map(parts, 1, of).into_iter().unzip();
    let outlines: Vec<OnceLock<Outline>> = parts.iter().map(|_| OnceLock::new()).collect();
    let outline = |part: usize| outlines[part].get_or_init(|| outline_of(&parts[part].points));
    let is_over = |other: usize, place: &Point3<f64>| {
        let (low, high) = &boxes[other];
        (0..2).all(|k| place[k] > low[k] && place[k] < high[k]) && outline(other).covers(place, 0.0)
    };
    let base = |(i, part): (usize, &Segment)| {
        let heights: Vec<f64> = part.points.iter().map(|p| p.z).collect();
        let (low, place) = (end(&heights, POINT_ENDS.0), middle(&part.points));
        let [x, y] = place;
        let above = Point3::new(x, y, 0.0);
        let is_below = |other: &usize| *other != i && tops[*other] > low - MEETS_M && is_over(*other, &above);
        let below: Vec<usize> = (0..parts.len()).filter(is_below).collect();
        let lifted = below.iter().filter(|_| low > PLACE_M);
        let borne = lifted.filter_map(|&other| borne_at_m(outline(i), (place, low), &parts[other].points));
        if let Some(at) = borne.max_by(f64::total_cmp) {
            return (at, 0.0);
        }
        let is_around = |&other: &usize| {
            is_wider(&boxes[other], &boxes[i])
                && outline(other).covers(&above, -APART_M)
                && directions(parts[other].points.iter(), place) >= AROUND
        };
        if below.iter().any(is_around) {
            return BOTTOM_M;
        }
        // What lies along the rim of another is most likely a piece of that.
        let rims = below.iter().map(|&other| tops[other]).filter(|top| low > APART_M && *top < low + MEETS_M);
        (rims.max_by(f64::total_cmp).unwrap_or(0.0), 0.0)
    };
    let bases: Vec<(f64, f64)> = pool::each(parts.len(), 1, |i| base((i, &parts[i])));
    for (part, base) in parts.iter_mut().zip(bases) {
        (part.base_m, part.base_sigma_m) = base;
    }
    tops
}

/// Height at which another object supports a part, metres: that of the other object's points around
/// the part's foot; `None` if these are seen in too few directions.
fn borne_at_m(outline: &Outline, (place, low): ([f64; 2], f64), other: &[Point3<f64>]) -> Option<f64> {
    /// Quantile of the supporting points that defines the top. From: chosen.
    const TOP: f64 = 0.8;
    let is_beside = |p: &&Point3<f64>| {
        (p.z - low).abs() < MEETS_M && outline.covers(p, APART_M) && !outline.covers(p, -PLACE_M)
    };
    let beside: Vec<&Point3<f64>> = other.iter().filter(is_beside).collect();
    let bears = directions(beside.iter().copied(), place) >= BEARS;
    let mut heights: Vec<f64> = beside.iter().map(|p| p.z).collect();
    bears.then(|| quantile(&mut heights, TOP))
}

/// The convex outline of points seen from above.
fn outline_of(points: &[Point3<f64>]) -> Outline {
    let corners = hull_from_above(points).into_iter().map(|[x, y]| Point3::new(x, y, 0.0));
    Outline::of(&corners.collect::<Vec<_>>(), &Vector3::z())
}

/// True if a box is wider than another in both directions.
fn is_wider((low, high): &(Point3<f64>, Point3<f64>), (from, to): &(Point3<f64>, Point3<f64>)) -> bool {
    (0..2).all(|k| high[k] - low[k] > to[k] - from[k])
}

/// Number of directions (of 36) from a point in which other points lie.
fn directions<'a>(points: impl Iterator<Item = &'a Point3<f64>>, [x, y]: [f64; 2]) -> usize {
    let mut seen = [false; SECTORS];
    points.for_each(|p| seen[sector(p.x - x, p.y - y)] = true);
    seen.iter().filter(|seen| **seen).count()
}
