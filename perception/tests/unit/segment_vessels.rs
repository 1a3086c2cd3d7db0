//! Tests of `segment::vessels`.

use descry_perception::segment::Segment;
use descry_perception::segment::vessels::*;
use nalgebra::Point3;

/// Points on the outside of a cup of 4 cm radius and 10 cm height around the origin.
fn cup() -> Vec<Point3<f64>> {
    let at = |k: usize| {
        let angle = std::f64::consts::TAU * (k % 90) as f64 / 90.0;
        Point3::new(0.04 * angle.cos(), 0.04 * angle.sin(), 0.1 * (k / 90) as f64 / 40.0)
    };
    (0..3600).map(at).collect()
}

/// Points of an upright bar of a width that begins so far from the axis and is so deep.
fn bar(from_m: f64, deep_m: f64, wide_m: f64, top_m: f64) -> Vec<Point3<f64>> {
    let at = |k: usize| {
        let share = |n: usize| (k / n % 10) as f64 / 9.0;
        let aside = wide_m * (share(10) - 0.5);
        Point3::new(from_m + deep_m * share(1), aside, 0.02 + (top_m - 0.02) * share(100))
    };
    (0..1000).map(at).collect()
}

fn check(beside: Vec<Point3<f64>>, parts: usize) {
    let body = cup();
    let n = body.len() as u32;
    let own = Segment { indices: (0..n).collect(), points: body, base_m: 0.0, base_sigma_m: 0.0 };
    let what = format!("{:?} to {:?}", beside.first(), beside.last());
    let other = Segment {
        indices: (n..n + beside.len() as u32).collect(),
        points: beside,
        base_m: 0.0,
        base_sigma_m: 0.0,
    };
    let eyes = [Point3::new(1.0, 0.3, 0.8), Point3::new(-0.7, 0.8, 0.8)];
    assert_eq!(whole(vec![own, other], &eyes).len(), parts, "{what}");
}

#[test]
fn a_handle_that_was_cut_off_is_put_back() {
    check(bar(0.044, 0.03, 0.012, 0.08), 1);
    // Too far from the wall, too wide, too far out, too high: something that stands beside the cup.
    check(bar(0.065, 0.03, 0.012, 0.08), 2);
    check(bar(0.044, 0.03, 0.07, 0.08), 2);
    check(bar(0.044, 0.09, 0.012, 0.08), 2);
    check(bar(0.044, 0.03, 0.012, 0.16), 2);
}

/// Points of a bowl's wall, 9 cm high and as wide as 9.5 cm of radius at the top, between two angles in degrees.
fn wall(from: usize, to: usize, shift_m: f64) -> Vec<Point3<f64>> {
    let at = |k: usize| {
        let angle = (from as f64 + (to - from) as f64 * (k % 120) as f64 / 119.0).to_radians();
        let share = (k / 120) as f64 / 39.0;
        let radius = 0.03 + 0.065 * share.sqrt();
        Point3::new(radius * angle.cos() + shift_m, radius * angle.sin(), 0.01 + 0.08 * share)
    };
    (0..4800).map(at).collect()
}

/// Number of parts that remain of two.
fn count(parts: [Vec<Point3<f64>>; 2]) -> usize {
    let mut from = 0;
    let parts = parts.map(|points| {
        let indices = (from..from + points.len() as u32).collect();
        from += points.len() as u32;
        Segment { indices, points, base_m: 0.0, base_sigma_m: 0.0 }
    });
    whole(parts.into(), &[Point3::new(1.0, 0.0, 0.8)]).len()
}

#[test]
fn both_sides_of_what_lies_are_one() {
    // What is 8 cm thick and 16 cm long, between two angles about its axis in degrees: at a radius of that angle.
    let along = |from: f64, to: f64, radius_m: &dyn Fn(f64) -> f64| -> Vec<Point3<f64>> {
        let at = |k: usize| {
            let angle = (from + (to - from) * (k % 60) as f64 / 59.0).to_radians();
            let (sin, cos) = angle.sin_cos();
            let out_m = radius_m(angle);
            Point3::new(0.16 * (k / 60) as f64 / 39.0, out_m * cos, 0.04 + out_m * sin)
        };
        (0..2400).map(at).collect()
    };
    let round = |_: f64| 0.04;
    let square = |angle: f64| 0.04 / angle.sin().abs().max(angle.cos().abs());
    // A strip of its side that reaches nearly as high.
    let strip = |radius_m| along(140.0, 200.0, radius_m);
    assert_eq!(count([along(0.0, 120.0, &round), strip(&round)]), 1);
    assert_eq!(count([along(0.0, 120.0, &square), strip(&square)]), 2, "a carton has no such side");
    let wide = |_: f64| 0.055;
    assert_eq!(count([along(0.0, 120.0, &round), strip(&wide)]), 2, "it stands beside it");
}

#[test]
fn the_inside_and_the_outside_of_a_bowl_are_one() {
    // The near outside and the far inside, which do not touch.
    assert_eq!(count([wall(290, 430, 0.0), wall(105, 255, 0.0)]), 1);
    // Two halves that are farther apart, and two that show too little of a rim.
    assert_eq!(count([wall(290, 430, 0.1), wall(105, 255, 0.0)]), 2);
    assert_eq!(count([wall(330, 390, 0.0), wall(150, 210, 0.0)]), 2);
}
