//! Grasping and placing of objects by the simulated hand.

use crate::sim::arrange::{fits, keeps_apart};
use crate::sim::drive::normal;
use crate::sim::outline::upright;
use crate::sim::scene::{SurfaceSpec, headroom_m};
use crate::sim::shape::Outline;
use crate::sim::world::{Scene, Stand};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Probability that a grasped object slips.
const SLIP_CHANCE: f64 = 0.08;
/// Maximum horizontal distance between the stated point and the centre of an object that the hand finds
/// there, metres.
const FIND_M: f64 = 0.12;
/// Tolerance of the hand above and below the object, metres.
const FIND_HEIGHT_M: f64 = 0.05;
/// Maximum displacement of a slipped object, metres.
const SLIDE_M: f64 = 0.05;
/// Number of directions tried for the displacement.
const SLIDE_TRIES: usize = 8;
/// Standard deviation of a placement along x and y, metres.
const PLACE_SIGMA_M: f64 = 0.01;
/// Maximum difference between the stated height and the true height of a surface that the hand finds there,
/// metres.
const SURFACE_HEIGHT_M: f64 = 0.1;
/// Maximum overhang that is corrected by moving the object inwards, metres.
const EDGE_M: f64 = 0.05;
/// Position of the held object's base, base frame, metres.
pub(crate) const BASE_FROM_HAND: Vector3<f64> = Vector3::new(0.35, 0.0, 0.9);

/// Result of a grasp.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Taken {
    /// No object there.
    Nothing,
    /// The object with this index is wider than the hand opens.
    TooWide(usize),
    /// The object with this index slipped; it stands, perhaps slightly displaced.
    Slid(usize),
    /// The object with this index is in the hand.
    Held(usize),
}

/// Grasps at a point of the map (true coordinates, metres): takes the object there that is nearest in
/// position and width.
pub(crate) fn take(
    scene: &mut Scene,
    at: &Point3<f64>,
    width_m: f64,
    opening_m: f64,
    slips: bool,
    rng: &mut ChaCha8Rng,
) -> Taken {
    let off = |i: usize| (scene.objects[i].centre_m().xy() - at.xy()).norm();
    let unlike = |i: usize| off(i) + (scene.objects[i].shape.width_m() - width_m).abs();
    let found = (0..scene.objects.len())
        .filter(|&i| scene.objects[i].is_in_place() && off(i) <= FIND_M)
        .filter(|&i| scene.objects[i].is_at_height(at.z, FIND_HEIGHT_M))
        .min_by(|&a, &b| unlike(a).total_cmp(&unlike(b)));
    let slides = rng.random_bool(SLIP_CHANCE) || slips;
    let Some(object) = found else { return Taken::Nothing };
    if scene.objects[object].shape.width_m() > opening_m {
        return Taken::TooWide(object);
    }
    if slides {
        slide(scene, object, rng);
        return Taken::Slid(object);
    }
    scene.objects[object].stands = Stand::Hand;
    Taken::Held(object)
}

fn slide(scene: &mut Scene, object: usize, rng: &mut ChaCha8Rng) {
    let Some(surface) = scene.objects[object].surface().and_then(|s| scene.surface(s)).cloned() else {
        return;
    };
    for _ in 0..SLIDE_TRIES {
        let angle = rng.random_range(0.0..std::f64::consts::TAU);
        let step_m = rng.random_range(0.0..SLIDE_M);
        let mut moved = scene.objects[object].clone();
        let step = Translation3::from(Vector3::new(angle.cos(), angle.sin(), 0.0) * step_m);
        moved.map_from_object = step * moved.map_from_object;
        if fits(&moved, &surface, scene.objects.iter(), 0.0) {
            scene.objects[object] = moved;
            return;
        }
    }
}

/// Reason for which an object cannot be placed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum NoPlace {
    /// No surface is at that place and height.
    NoSurface,
    /// The object is too large for the surface of this name.
    Edge(String),
    /// Another surface is too low above the surface of this name.
    Under(String),
    /// Another object is in the way.
    Taken,
}

/// Places the object with this index near a point of the map (true coordinates, metres); returns the
/// surface's name.
pub(crate) fn put(
    scene: &mut Scene,
    object: usize,
    foot: &Point3<f64>,
    yaw_rad: f64,
    rng: &mut ChaCha8Rng,
) -> Result<String, NoPlace> {
    let off = [normal(rng), normal(rng)].map(|n| PLACE_SIGMA_M * n);
    let height_off = |s: &&SurfaceSpec| (s.height_m - foot.z).abs();
    let surface = scene
        .surfaces
        .iter()
        .filter(|s| height_off(s) <= SURFACE_HEIGHT_M && s.covers(&foot.xy(), EDGE_M))
        .min_by(|a, b| height_off(a).total_cmp(&height_off(b)))
        .ok_or(NoPlace::NoSurface)?;
    let name = surface.name.clone();
    let radius_m = match scene.objects[object].shape.outline() {
        Outline::Disc { radius_m } => radius_m,
        Outline::Rectangle { half_m: [x, y] } => x.hypot(y),
    };
    let half_m = surface.size_m.map(|s| 0.5 * s - radius_m);
    if half_m.iter().any(|h| *h < 0.0) {
        return Err(NoPlace::Edge(name));
    }
    let wanted = Point3::new(foot.x + off[0], foot.y + off[1], surface.height_m);
    let local = surface.map_from_top().inverse_transform_point(&wanted);
    let [x, y] = [local.x.clamp(-half_m[0], half_m[0]), local.y.clamp(-half_m[1], half_m[1])];
    let room_m = headroom_m(&scene.surfaces, surface);
    let mut put = scene.objects[object].clone();
    if put.shape.height_m() > room_m {
        return Err(NoPlace::Under(name));
    }
    let at = surface.map_from_top() * Point3::new(x, y, 0.0);
    put.map_from_object = upright(at.x, at.y, at.z, yaw_rad);
    put.stands = Stand::On(name.clone());
    if !keeps_apart(&put, scene.objects.iter(), 0.0) {
        return Err(NoPlace::Taken);
    }
    scene.objects[object] = put;
    Ok(name)
}

/// Pose in the map of an object held by a base at `map_from_base`.
pub(crate) fn map_from_held(map_from_base: &Isometry3<f64>) -> Isometry3<f64> {
    map_from_base * Translation3::from(BASE_FROM_HAND)
}
