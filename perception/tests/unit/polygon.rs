//! Tests of `polygon`.

use descry_perception::polygon::*;

/// A corner between every two neighbours and nothing outside.
fn check(points: Vec<[f64; 2]>, corners: usize) {
    let hull = convex_hull(points.clone());
    assert_eq!(hull.len(), corners, "{hull:?}");
    for i in 0..hull.len() {
        let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
        let left = |p: &[f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        assert!(points.iter().all(|p| left(p) >= -1e-9), "{a:?} to {b:?}");
    }
}

#[test]
fn hulls_of_many_points_of_one_place_and_of_a_line() {
    let circle = |i: i32| [(f64::from(i) * 0.1).cos(), (f64::from(i) * 0.1).sin()];
    let inside = (0..1000).map(|i| circle(i).map(|c| c * f64::from(i % 97) / 100.0));
    check((0..62).map(circle).chain(inside).collect(), 62);
    check((0..400).map(|i| [f64::from(i % 20), f64::from(i / 20)]).collect(), 4);
    check(vec![[0.3, 0.4]; 100], 1);
    check((0..100).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect(), 2);
}
