//! Whether a model at a pose stands as it stood when it was learned: upright, and on something.

use super::evidence::tolerance_m;
use super::scene::Seen;
use super::skin::{Skin, across};
use nalgebra::{Isometry3, Point3, Vector3};
use std::f32::consts::TAU;

/// What is turned from up by more lies, radians.
const TILTED_RAD: f64 = 0.35;
/// Points no higher above the lowest are of the foot, metres.
const FOOT_M: f32 = 0.015;
/// In so many directions around the foot, so far beside it, it is looked whether there is something to stand on, metres.
const AROUND: u16 = 24;
const BESIDE_M: f32 = 0.02;
/// What is level and no farther above or below carries it, metres: of a model the lowest centimetre may be missing.
const STEP_M: f64 = 0.03;
/// Least cosine between up and the normal of what is level.
const LEVEL: f64 = 0.8;
/// Fewer places say nothing.
const LEAST: usize = 6;
/// It floats if so many times as many places are seen past as carry it.
const FLOATS: usize = 2;

/// False if a model is tilted, or if hardly anything is beneath it: all around its foot the camera saw past where it would stand. `up` is up in the model
/// and in the camera's frame.
pub(super) fn stands(
    model: &Skin,
    camera_from_model: &Isometry3<f64>,
    scene: &Seen,
    up: &[Vector3<f64>; 2],
) -> bool {
    if (camera_from_model.rotation * up[0]).angle(&up[1]) > TILTED_RAD {
        return false;
    }
    let (mut carried, mut past) = (0, 0);
    for p in beside_foot(model, &up[0].cast()) {
        let q = camera_from_model * p.cast::<f64>();
        let Some((depth, _)) = scene.around(&q) else { continue };
        let met = q * (f64::from(depth) / q.z);
        let is_level = || {
            let near = scene.skin.tree.nearest(&met.cast(), super::evidence::NEAR_M);
            near.is_some_and(|n| scene.skin.normals[n.index as usize].cast::<f64>().dot(&up[1]) > LEVEL)
        };
        if (met - q).dot(&up[1]).abs() < STEP_M && is_level() {
            carried += 1;
        } else if f64::from(depth) > q.z + f64::from(tolerance_m(q.z as f32).max(0.01)) {
            past += 1;
        }
    }
    carried + past < LEAST || past <= FLOATS * carried
}

/// Places around the foot of a model, at its height.
fn beside_foot(model: &Skin, up: &Vector3<f32>) -> Vec<Point3<f32>> {
    let height = |p: &Point3<f32>| up.dot(&p.coords);
    let low = model.points.iter().map(height).fold(f32::INFINITY, f32::min);
    let foot: Vec<&Point3<f32>> = model.points.iter().filter(|p| height(p) < low + FOOT_M).collect();
    let middle = foot.iter().map(|p| p.coords).sum::<Vector3<f32>>() / foot.len().max(1) as f32;
    let middle = middle + up * (low - up.dot(&middle));
    let right = across(up);
    let ahead = up.cross(&right);
    let beside = |k: u16| {
        let turn = TAU * f32::from(k) / f32::from(AROUND);
        let away = right * turn.cos() + ahead * turn.sin();
        let far = foot.iter().map(|p| away.dot(&(p.coords - middle))).fold(0.0, f32::max);
        Point3::from(middle + away * (far + BESIDE_M))
    };
    (0..AROUND).map(beside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;
    use crate::cloud::Cloud;
    use crate::view::View;

    const CAMERA: Intrinsics =
        Intrinsics { width: 320, height: 240, fx: 262.5, fy: 262.5, cx: 159.5, cy: 119.5 };
    /// A camera that looks straight down from this high over a table that ends at x = 0, over a floor.
    const HIGH_M: f64 = 1.0;
    const FLOOR_M: f64 = 1.7;

    fn table() -> Seen {
        let depth = |i: usize| {
            let x = (i % 320) as f64 - 159.5;
            (if x < 0.0 { HIGH_M } else { FLOOR_M }) as f32
        };
        let depths: Vec<f32> = (0..320 * 240).map(depth).collect();
        let cloud = CAMERA.cloud_from_depth(&depths).expect("the camera is sound");
        Seen::new(&View { intrinsics: Some(CAMERA), ..View::alone(cloud) }, 2.5, 0.05).expect("a depth image")
    }

    /// A post of 6 cm across and 10 cm high on the origin, z up.
    fn post() -> Skin {
        let at = |k: usize| {
            let (turn, up) = ((k % 40) as f32 * TAU / 40.0, (k / 40) as f32 * 0.004);
            (Vector3::new(turn.cos(), turn.sin(), 0.0), up)
        };
        let normals: Vec<Vector3<f32>> = (0..40 * 26).map(|k| at(k).0).collect();
        let points = (0..40 * 26).map(|k| Point3::from(at(k).0 * 0.03 + Vector3::z() * at(k).1)).collect();
        Skin::of(&Cloud { points, normals: Some(normals), ..Cloud::default() }).expect("few points")
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
}
