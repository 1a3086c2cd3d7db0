//! Tests of `round`.

use descry_perception::round::*;
use nalgebra::Point3;
use std::f64::consts::TAU;

/// Points on the side of a cup, over an arc, with a ripple in place of noise.
fn cup(x: f64, y: f64, base: f64, top: f64, arc_rad: f64) -> Vec<Point3<f64>> {
    (0..2000)
        .map(|i| {
            let z = f64::from(i % 40) / 40.0 * 0.1;
            let angle = f64::from(i / 40) / 50.0 * arc_rad;
            let r = base + (top - base) * z / 0.1 + 0.001 * f64::from(i).sin();
            Point3::new(x + r * angle.cos(), y + r * angle.sin(), z)
        })
        .collect()
}

#[test]
fn radius_place_and_taper_come_back() {
    let cases = [
        ("all around", 0.0, 0.0, 0.035, 0.035, TAU),
        ("half", 0.4, -0.2, 0.035, 0.035, 2.6),
        ("a tapered cup", -0.3, 0.1, 0.025, 0.04, 3.0),
    ];
    for (name, x, y, base, top, arc) in cases {
        let found = fit(&cup(x, y, base, top, arc), 0.0, 0.1, 0.001, 1);
        let close = found.is_some_and(|r| {
            (r.x - x).abs() < 0.001
                && (r.y - y).abs() < 0.001
                && (r.radius_at(0.0) - base).abs() < 0.001
                && (r.radius_at(0.1) - top).abs() < 0.001
        });
        assert!(close, "{name}: {found:?}");
    }
}

#[test]
fn directions_around_an_axis_are_those_of_the_angle() {
    for k in 0..7200 {
        let angle = TAU * (f64::from(k) + 0.5) / 7200.0;
        assert_eq!(sector(0.3 * angle.cos(), 0.3 * angle.sin()), k as usize / 200, "{angle} rad");
    }
    let axes = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (0.0, 0.0)];
    assert_eq!(axes.map(|(x, y)| sector(x, y)), [0, 9, 18, 27, 0]);
}

#[test]
fn far_off_a_body_stands_behind_what_was_seen_of_it() {
    // Depth along y comes in steps of 2.5 cm, as at nearly three metres.
    let (x, y, r) = (0.3, 2.7, 0.035);
    let across = |i: usize| -0.95 * r + 1.9 * r * (i % 20) as f64 / 19.0;
    let seen = |i: usize| {
        let depth = y - (r * r - across(i).powi(2)).sqrt();
        Point3::new(x + across(i), (depth / 0.025).round() * 0.025, 0.1 * (i / 20) as f64 / 10.0)
    };
    let points: Vec<Point3<f64>> = (0..200).map(seen).collect();
    let drawn =
        Round { x, y: y - 0.03, radius_m: r, ..fit(&cup(x, y, r, r, TAU), 0.0, 0.1, 0.001, 1).unwrap() };
    let off = drawn.behind(&points, (0.0, 0.1), [0.0, -1.0]).map(|found| (found.x - x).hypot(found.y - y));
    assert!(off.is_some_and(|off| off < 0.012), "{off:?} m off");
}

#[test]
fn what_is_no_circle_is_none() {
    assert_eq!(fit(&[], 0.0, 0.1, 0.001, 1), None);
    let same = vec![Point3::new(0.1, 0.1, 0.05); 100];
    assert_eq!(fit(&same, 0.0, 0.1, 0.001, 1), None);
}
