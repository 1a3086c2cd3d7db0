//! Resting-pose prior: an object stands as it stood when it was learned, upright and on something.

use super::evidence::tolerance_m;
use super::scene::SceneView;
use super::surfels::{Surfels, across};
use nalgebra::{Isometry3, Point3, Vector3};
use std::f32::consts::TAU;

/// Tilt from upright above which an object does not stand, radians.
const TILTED_RAD: f64 = 0.35;
/// Maximum height of a model's foot points above its lowest point, metres.
const FOOT_M: f32 = 0.015;
/// Number of directions around the foot in which a support is sought.
const AROUND: u16 = 24;
/// Distance from the foot at which a support is sought, metres.
const BESIDE_M: f32 = 0.02;
/// Maximum height difference between the foot and a level surface that supports it, metres; a model may lack the lowest
/// centimetre.
const STEP_M: f64 = 0.03;
/// Minimum cosine between the up direction and the normal of a level surface.
const LEVEL: f64 = 0.8;
/// Minimum number of places around the foot with evidence; with fewer, the object is assumed to stand.
const LEAST: usize = 6;
/// Maximum ratio of places where the camera looks past the foot to supporting places; above it, the model floats.
const FLOATS: usize = 2;

/// True if a model at a pose is upright and not seen to float: the camera does not look past its foot nearly all
/// around. `up`: up direction in the model and in the camera frame.
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

/// Points beside the foot of a model, all around and at the height of its lowest point, model frame.
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
