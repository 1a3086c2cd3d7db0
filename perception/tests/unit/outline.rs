//! Tests of `outline`.

use descry_perception::outline::*;
use nalgebra::Point3;

#[test]
fn two_sides_of_a_box_are_a_rectangle() {
    let edge = |i: i32| f64::from(i) / 100.0;
    let turn = |x: f64, y: f64| Point3::new(0.8 * x - 0.6 * y + 1.0, 0.6 * x + 0.8 * y, 0.05);
    let points: Vec<_> =
        (0..100).flat_map(|i| [turn(0.12 * edge(i), 0.0), turn(0.0, 0.07 * edge(i))]).collect();
    let found = fit(&points);
    let close = found.is_some_and(|r| {
        (r.sides_m[0] - 0.12).abs() < 0.008 && (r.sides_m[1] - 0.07).abs() < 0.008 && r.residual_m < 0.003
    });
    assert!(close, "{found:?}");
}

#[test]
fn noise_does_not_carry_edges_outwards() {
    let noise = |i: usize| 0.02 * (f64::from((i * 7919 % 101) as u32) / 100.0 - 0.5);
    let places = (0..600).map(|i| (f64::from(i) / 600.0, noise(i as usize)));
    let points: Vec<_> = places
        .flat_map(|(along, off)| [Point3::new(0.12 * along, off, 0.05), Point3::new(off, 0.07 * along, 0.05)])
        .collect();
    let spread_m = 0.02 / 12.0_f64.sqrt();
    let found = fit(&points).expect("a rectangle");
    assert!(found.residual_m < 1.1 * spread_m, "{found:?}, of a spread of {spread_m} m");
}
