//! What each thing stands on: the surface, another thing, or the bottom of one that it stands in.

use super::{POINT_ENDS, Segment, bounds, end, hull_from_above, middle, quantile, top_m};
use crate::round::{SECTORS, sector};
use crate::scale::{APART_M, PLACE_M};
use crate::surface::Outline;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use std::sync::OnceLock;

/// How high the bottom of a vessel or of an open carton is in which something stands, metres, and its spread. From: chosen.
const BOTTOM_M: (f64, f64) = (0.005, 0.006);

/// How far from its lower edge the top of what a thing stands on may be measured, metres. From: chosen.
const MEETS_M: f64 = 0.03;
/// Of the directions from a place, how many what is around shows at least, and what bears. From: chosen.
const AROUND: usize = 27;
const BEARS: usize = 15;

/// Tells for each segment what it stands on: the surface, another segment that is seen around its foot, or the bottom of one that is
/// around it. Gives all tops.
pub(super) fn on(parts: &mut [Segment]) -> Vec<f64> {
    let of = |part: &Segment| (top_m(part), bounds(&part.points));
    let (tops, boxes): (Vec<f64>, Vec<_>) = parts.par_iter().with_max_len(1).map(of).unzip();
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
    let bases: Vec<(f64, f64)> = parts.par_iter().with_max_len(1).enumerate().map(base).collect();
    for (part, base) in parts.iter_mut().zip(bases) {
        (part.base_m, part.base_sigma_m) = base;
    }
    tops
}

/// How high another thing bears a part, metres: its top is seen around the part's foot, or its side below. None if it does not.
fn borne_at_m(outline: &Outline, (place, low): ([f64; 2], f64), other: &[Point3<f64>]) -> Option<f64> {
    /// Share of them that lie lower than the top. From: chosen.
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

/// True if a box is wider than another both ways.
fn is_wider((low, high): &(Point3<f64>, Point3<f64>), (from, to): &(Point3<f64>, Point3<f64>)) -> bool {
    (0..2).all(|k| high[k] - low[k] > to[k] - from[k])
}

/// In how many directions from a place points lie.
fn directions<'a>(points: impl Iterator<Item = &'a Point3<f64>>, [x, y]: [f64; 2]) -> usize {
    let mut seen = [false; SECTORS];
    points.for_each(|p| seen[sector(p.x - x, p.y - y)] = true);
    seen.iter().filter(|seen| **seen).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of an upright wall: its radius at the foot and at the rim, between two heights and two angles, degrees.
    fn wall([foot_m, rim_m]: [f64; 2], [low_m, high_m]: [f64; 2], [from, to]: [f64; 2]) -> Vec<Point3<f64>> {
        let at = |k: usize| {
            let (turn, rise) = ((k % 60) as f64 / 59.0, (k / 60) as f64 / 19.0);
            let angle = (from + (to - from) * turn).to_radians();
            let radius_m = foot_m + (rim_m - foot_m) * rise;
            Point3::new(radius_m * angle.cos(), radius_m * angle.sin(), low_m + (high_m - low_m) * rise)
        };
        (0..1200).map(at).collect()
    }

    /// What the first of two things stands on, and its spread, metres.
    fn check(what: &str, first: Vec<Point3<f64>>, second: Vec<Point3<f64>>, (base_m, sigma_m): (f64, f64)) {
        let part = |points: Vec<Point3<f64>>| Segment {
            indices: (0..points.len() as u32).collect(),
            points,
            base_m: 0.0,
            base_sigma_m: 0.0,
        };
        let mut parts = [part(first), part(second)];
        on(&mut parts);
        let found = (parts[0].base_m, parts[0].base_sigma_m);
        assert!((found.0 - base_m).abs() < 0.003 && found.1 == sigma_m, "{what}: {found:?}");
        assert_eq!(parts[1].base_m, 0.0, "{what}: what bears it stands on the surface");
    }

    #[test]
    fn what_is_seen_around_a_foot_tells_what_a_thing_stands_on() {
        const ROUND: [f64; 2] = [0.0, 360.0];
        let cup = |low_m: f64, high_m: f64| wall([0.035; 2], [low_m, high_m], ROUND);
        // The cover of a book, as far as a cup on it does not hide it, and bits of the cup that were taken for the book's.
        let on_book = |p: &Point3<f64>| p.x.hypot(p.y) > 0.036 && p.x.abs() < 0.1 && p.y.abs() < 0.07;
        let cover =
            |k: usize| Point3::new(0.004 * (k % 50) as f64 - 0.1, 0.004 * (k / 50) as f64 - 0.07, 0.03);
        let mut book: Vec<Point3<f64>> = (0..1800).map(cover).filter(on_book).collect();
        book.extend(wall([0.034; 2], [0.11, 0.13], [0.0, 40.0]));
        check("a cup on a book", cup(0.03, 0.134), book, (0.03, 0.0));
        let dish = || wall([0.06, 0.075], [0.008, 0.05], ROUND);
        check("a cup in a dish", cup(0.025, 0.104), dish(), BOTTOM_M);
        let piece = wall([0.068, 0.074], [0.03, 0.05], [20.0, 50.0]);
        check("a piece of a dish, which is too low to be a thing then", piece, dish(), (0.041, 0.0));
        let beside = dish().into_iter().map(|p| Point3::new(p.x + 0.2, p.y, p.z)).collect();
        check("a cup beside a dish, its foot hidden", cup(0.04, 0.104), beside, (0.0, 0.0));
    }
}
