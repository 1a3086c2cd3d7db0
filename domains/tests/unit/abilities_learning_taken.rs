//! Tests of `abilities::learning::taken`.

use descry_domains::abilities::learning::taken::*;
use descry_perception::learning::Visit;
use descry_perception::nalgebra::{Isometry3, Point3};
use descry_perception::{Cloud, View};
use descry_robots::Description;

#[test]
fn a_visit_that_is_laid_farther_off_than_localisation_errs_is_not_compared() {
    let body = descry_robots::sim::body::description();
    let view = View::alone(Cloud::from_points(vec![Point3::new(0.0, 0.0, 1.0)]));
    let laid = |times: f64| Visit {
        appeared: Vec::new(),
        gone: Vec::new(),
        poses: vec![Isometry3::translation(times * body.pose_sigma_m, 0.0, 0.0)],
        added: 0,
        removed: 0,
    };
    let why = |times: f64| misfit(&body, &Isometry3::identity(), &laid(times), &view);
    assert_eq!(why(1.0), None);
    let exact = Description { pose_sigma_m: 0.0, pose_sigma_rad: 0.0, ..body.clone() };
    let off_m = |x: f64| Visit { poses: vec![Isometry3::translation(x, 0.0, 0.0)], ..laid(0.0) };
    let why_exact = |x: f64| misfit(&exact, &Isometry3::identity(), &off_m(x), &view);
    assert!(why_exact(0.003).is_none() && why_exact(0.05).is_some());
    assert!(why(8.0).is_some_and(|why| why.contains("farther off than localisation errs")));
}

#[test]
fn the_shade_of_a_lamp_is_over_its_foot_and_what_stands_beside_is_not() {
    let block = |x: f32, half: f32, low: f32, high: f32| {
        Cloud::from_points(vec![Point3::new(x - half, -half, low), Point3::new(x + half, half, high)])
    };
    let foot = block(0.0, 0.07, 0.72, 0.86);
    assert!(is_over(&block(0.02, 0.09, 0.9, 1.01), &foot));
    assert!(is_over(&block(-0.05, 0.02, 0.84, 0.9), &foot));
    for (x, low, high) in [(0.2, 0.9, 1.01), (0.0, 1.2, 1.3), (0.0, 0.3, 0.6)] {
        assert!(!is_over(&block(x, 0.09, low, high), &foot), "{x} {low} {high}");
    }
}
