//! Pushing an object aside on its surface.

use crate::sim::arrange::fits;
use crate::sim::drive::normal;
use crate::sim::world::Scene;
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Probability that the hand slides off the object.
const SLIP_CHANCE: f64 = 0.08;
/// Standard deviation of the distance, relative to the requested one.
const DISTANCE_SIGMA: f64 = 0.08;
/// Standard deviation of the direction of the push, radians.
const DIRECTION_SIGMA_RAD: f64 = 0.08;
/// Standard deviation of the object's rotation, radians.
const TURN_SIGMA_RAD: f64 = 0.15;
/// Maximum horizontal distance between the stated point and the centre of an object that the hand finds
/// there, metres.
const FIND_M: f64 = 0.15;
/// Tolerance of the hand above an object's top and below its base, metres, which excludes objects on other
/// boards.
const FIND_HEIGHT_M: f64 = 0.05;
/// Step of a push, metres; after each step, obstacles are checked.
const STEP_M: f64 = 0.005;

/// Effect of a push.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// No object on a surface is there.
    Nothing,
    /// The object moved until the distance was reached, an obstacle was felt, or the hand slid off.
    Moved {
        /// Index of the object.
        object: usize,
        /// Distance that the object moved, metres.
        moved_m: f64,
        /// Reason for which the push ended early, if it did.
        stopped: Option<&'static str>,
    },
}

/// Pushes the object at a point of the map (true coordinates, metres). The object stays on its surface and
/// does not push others.
pub fn push(
    scene: &mut Scene,
    at: &Point3<f64>,
    direction: &Vector2<f64>,
    distance_m: f64,
    rng: &mut ChaCha8Rng,
) -> Effect {
    let off = |i: usize| (scene.objects[i].centre_m().xy() - at.xy()).norm();
    let found = (0..scene.objects.len())
        .filter(|&i| scene.objects[i].is_in_place() && off(i) <= FIND_M)
        .filter(|&i| scene.objects[i].is_at_height(at.z, FIND_HEIGHT_M))
        .min_by(|&a, &b| off(a).total_cmp(&off(b)));
    let Some(object) = found else { return Effect::Nothing };
    let slips = rng.random_bool(SLIP_CHANCE);
    let reach = if slips { rng.random_range(0.0..0.5) } else { 1.0 + DISTANCE_SIGMA * normal(rng) };
    let wanted_m = (distance_m * reach).max(0.0);
    let heading_rad = direction.y.atan2(direction.x) + DIRECTION_SIGMA_RAD * normal(rng);
    let turned_rad = TURN_SIGMA_RAD * normal(rng);
    let Some(surface) = scene.objects[object].surface().and_then(|s| scene.surface(s)).cloned() else {
        return Effect::Nothing;
    };
    let steps = (wanted_m / STEP_M).ceil().max(1.0);
    let line = Vector3::new(heading_rad.cos(), heading_rad.sin(), 0.0) * (wanted_m / steps);
    let twist = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turned_rad / steps);
    let mut stopped = slips.then_some("the hand slid off");
    let mut moved_m = 0.0;
    for _ in 0..steps as usize {
        let mut next = scene.objects[object].clone();
        next.map_from_object.rotation = twist * next.map_from_object.rotation;
        next.map_from_object = Translation3::from(line) * next.map_from_object;
        if !fits(&next, &surface, scene.objects.iter(), 0.0) {
            stopped = Some("something, or the edge of the surface, was in the way");
            break;
        }
        scene.objects[object] = next;
        moved_m += wanted_m / steps;
    }
    Effect::Moved { object, moved_m, stopped }
}
