//! Resting-pose prior: an object stands as it stood when it was learned, upright and on something.

use super::evidence::tolerance_m;
use super::scene::SceneView;
use super::surfels::{Surfels, across};
use nalgebra::{Isometry3, Point3, Vector3};
use std::f32::consts::TAU;

/// Tilt from the vertical above which an object lies, radians.
const TILTED_RAD: f64 = 0.35;
/// Maximum height above the lowest point of foot points, metres.
const FOOT_M: f32 = 0.015;
/// Number of directions around the foot, and distance from it in metres, in which a support is
/// sought.
const AROUND: u16 = 24;
const BESIDE_M: f32 = 0.02;
/// Maximum height difference between a level surface and the supported foot, metres; a model may
/// lack the lowest centimetre.
const STEP_M: f64 = 0.03;
/// Minimum cosine between up and the normal of a level surface.
const LEVEL: f64 = 0.8;
/// Minimum number of places with evidence.
const LEAST: usize = 6;
/// Ratio of places seen past to supporting places, from which the model floats.
const FLOATS: usize = 2;

/// False if a model is tilted, or hardly supported: the camera saw past the support height all
/// around its foot. `up`: up direction in the model and in the camera frame.
pub fn stands(
    model: &Surfels,
    camera_from_model: &Isometry3<f64>,
    scene: &SceneView,
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
            let near = scene.surfels.tree.nearest(&met.cast(), super::evidence::NEAR_M);
            near.is_some_and(|n| scene.surfels.normals[n.index as usize].cast::<f64>().dot(&up[1]) > LEVEL)
        };
        if (met - q).dot(&up[1]).abs() < STEP_M && is_level() {
            carried += 1;
        } else if f64::from(depth) > q.z + f64::from(tolerance_m(q.z as f32).max(0.01)) {
            past += 1;
        }
    }
    carried + past < LEAST || past <= FLOATS * carried
}

/// Points around the foot of a model, at its height.
fn beside_foot(model: &Surfels, up: &Vector3<f32>) -> Vec<Point3<f32>> {
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
