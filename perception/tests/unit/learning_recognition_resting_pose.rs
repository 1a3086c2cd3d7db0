//! Tests of `learning::recognition::resting_pose`.

use descry_perception::camera::Intrinsics;
use descry_perception::cloud::Cloud;
use descry_perception::learning::recognition::resting_pose::*;
use descry_perception::learning::recognition::scene::SceneView;
use descry_perception::learning::recognition::surfels::Surfels;
use descry_perception::view::View;
use nalgebra::{Isometry3, Point3, Vector3};
use std::f32::consts::TAU;

const CAMERA: Intrinsics = Intrinsics { width: 320, height: 240, fx: 262.5, fy: 262.5, cx: 159.5, cy: 119.5 };
/// A camera that looks straight down from this high over a table that ends at x = 0, over a floor.
const HIGH_M: f64 = 1.0;
const FLOOR_M: f64 = 1.7;

fn table() -> SceneView {
    let depth = |i: usize| {
        let x = (i % 320) as f64 - 159.5;
        (if x < 0.0 { HIGH_M } else { FLOOR_M }) as f32
    };
    let depths: Vec<f32> = (0..320 * 240).map(depth).collect();
    let cloud = CAMERA.cloud_from_depth(&depths).expect("the camera is sound");
    SceneView::new(&View { intrinsics: Some(CAMERA), ..View::alone(cloud) }, 2.5, 0.05)
        .expect("a depth image")
}

/// A post of 6 cm across and 10 cm high on the origin, z up.
fn post() -> Surfels {
    let at = |k: usize| {
        let (turn, up) = ((k % 40) as f32 * TAU / 40.0, (k / 40) as f32 * 0.004);
        (Vector3::new(turn.cos(), turn.sin(), 0.0), up)
    };
    let normals: Vec<Vector3<f32>> = (0..40 * 26).map(|k| at(k).0).collect();
    let points = (0..40 * 26).map(|k| Point3::from(at(k).0 * 0.03 + Vector3::z() * at(k).1)).collect();
    Surfels::of(&Cloud { points, normals: Some(normals), ..Cloud::default() }).expect("few points")
}

#[test]
fn what_stands_on_a_table_stands_and_what_floats_or_lies_does_not() {
    let (post, scene) = (post(), table());
    // Up is towards the camera.
    let turned = Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
    let up = [Vector3::z(), -Vector3::z()];
    let at = |x: f64, z: f64, tilt: f64| {
        let pose = Isometry3::translation(x, 0.0, z) * turned * Isometry3::rotation(Vector3::x() * tilt);
        stands(&post, &pose, &scene, &up)
    };
    assert!(at(-0.2, HIGH_M, 0.0), "on the table");
    assert!(at(-0.2, HIGH_M - 0.01, 0.1), "with a foot that was not learned whole");
    assert!(at(-0.01, HIGH_M, 0.0), "at the edge");
    assert!(!at(0.2, HIGH_M, 0.0), "beside the table");
    assert!(!at(-0.2, HIGH_M - 0.2, 0.0), "over the table");
    assert!(!at(-0.2, HIGH_M, 1.5), "lying");
}
