//! Tests of `segment::stand`.

use descry_perception::segment::Segment;
use descry_perception::segment::stand::*;
use nalgebra::Point3;

/// Points of an upright wall: radii at foot and rim, between two heights and two angles, degrees.
fn wall([foot_m, rim_m]: [f64; 2], [low_m, high_m]: [f64; 2], [from, to]: [f64; 2]) -> Vec<Point3<f64>> {
    let at = |k: usize| {
        let (turn, rise) = ((k % 60) as f64 / 59.0, (k / 60) as f64 / 19.0);
        let angle = (from + (to - from) * turn).to_radians();
        let radius_m = foot_m + (rim_m - foot_m) * rise;
        Point3::new(radius_m * angle.cos(), radius_m * angle.sin(), low_m + (high_m - low_m) * rise)
    };
    (0..1200).map(at).collect()
}

/// Checks the height of the first object's support, and its standard deviation, metres.
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
    let cover = |k: usize| Point3::new(0.004 * (k % 50) as f64 - 0.1, 0.004 * (k / 50) as f64 - 0.07, 0.03);
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
