//! Tests of `transforms`.

use descry_memory::transforms::*;
use nalgebra::{Isometry3, Translation3};
use nalgebra::{UnitQuaternion, Vector3};

const S: i64 = 1_000_000_000;

fn iso(x: f64, y: f64, yaw: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, 0.0), UnitQuaternion::from_scaled_axis(Vector3::z() * yaw))
}

/// A robot that drives 1 m/s along x and turns 0.1 rad/s, its camera fixed 0.5 m ahead, and an unconnected
/// tree of frames.
fn drive() -> Transforms {
    let mut t = Transforms::default();
    for i in 0..=4 {
        t.insert(i * S, "map", "base", &iso(i as f64, 0.0, 0.1 * i as f64)).unwrap();
    }
    t.insert_static("base", "camera", &iso(0.5, 0.0, 0.0)).unwrap();
    t.insert(0, "shelf", "box", &iso(1.0, 1.0, 0.0)).unwrap();
    t.insert(0, "base", "hand", &iso(0.0, 0.0, 0.0)).unwrap();
    t.insert(9 * S, "base", "hand", &iso(0.0, 0.0, 0.0)).unwrap();
    t
}

#[test]
fn a_moment_between_two_measurements_is_interpolated_through_the_tree() {
    let t = drive();
    for (stamp, x, yaw) in
        [(0, 0.0, 0.0), (2 * S, 2.0, 0.2), (2 * S + S / 2, 2.5, 0.25), (4 * S + S / 20, 4.0, 0.4)]
    {
        let expected = iso(x, 0.0, yaw) * iso(0.5, 0.0, 0.0);
        let found = t.lookup("map", "camera", stamp, Reach::default()).unwrap();
        assert!((found.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-12, "{stamp}: {found}");
        let back = t.lookup("camera", "map", stamp, Reach::default()).unwrap();
        assert!((back * found).to_homogeneous().is_identity(1e-12));
    }
    assert_eq!(t.lookup("map", "map", 0, Reach::default()).unwrap(), Isometry3::identity());
}

#[test]
fn what_is_missing_is_named() {
    let cases = [
        (
            "map",
            "lamp",
            S,
            "no transform names the frame `lamp`; known are: `base`, `box`, `camera`, `hand`, `map`, `shelf`",
        ),
        (
            "map",
            "box",
            S,
            "at 1000000000 ns no chain links `map` to `box`: `box` ends at `shelf` and `map` at `map`; record the transform between those two",
        ),
        (
            "map",
            "base",
            7 * S,
            "the link `map` <- `base` was not measured near 7000000000 ns: the last is 3.000 s earlier",
        ),
        (
            "base",
            "hand",
            3 * S,
            "the link `base` <- `hand` was not measured near 3000000000 ns: a gap of 9.000 s, from 3.000 s before to 6.000 s after, where at most 4.000 s are bridged",
        ),
    ];
    let t = drive();
    for (target, origin, stamp, message) in cases {
        assert_eq!(t.lookup(target, origin, stamp, Reach::default()).unwrap_err().to_string(), message);
    }
}

#[test]
fn a_child_may_change_its_parent() {
    let mut t = Transforms::default();
    t.insert(0, "table", "cup", &iso(1.0, 0.0, 0.0)).unwrap();
    t.insert(S, "table", "cup", &iso(1.0, 0.0, 0.0)).unwrap();
    t.insert(2 * S, "hand", "cup", &iso(0.0, 2.0, 0.0)).unwrap();
    t.insert_static("table", "hand", &iso(5.0, 0.0, 0.0)).unwrap();
    for (stamp, x, y) in [(S / 2, 1.0, 0.0), (2 * S, 5.0, 2.0)] {
        let p = t.lookup("table", "cup", stamp, Reach::default()).unwrap().translation;
        assert_eq!((p.x, p.y), (x, y));
    }
}

#[test]
fn a_loop_is_an_error_and_so_is_nonsense() {
    let mut t = Transforms::default();
    t.insert(0, "a", "b", &iso(1.0, 0.0, 0.0)).unwrap();
    t.insert(0, "b", "a", &iso(1.0, 0.0, 0.0)).unwrap();
    t.insert(0, "x", "y", &iso(1.0, 0.0, 0.0)).unwrap();
    assert!(matches!(t.lookup("x", "a", 0, Reach::default()), Err(TransformError::Loop { .. })));
    let mut nan = iso(0.0, 0.0, 0.0);
    nan.translation.x = f64::NAN;
    assert!(matches!(t.insert(0, "a", "c", &nan), Err(TransformError::Invalid { .. })));
    assert!(matches!(t.insert(0, "c", "c", &iso(0.0, 0.0, 0.0)), Err(TransformError::Invalid { .. })));
}
