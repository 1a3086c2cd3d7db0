//! Arrangement of a scene by a seed: objects are placed without overlap, and the target with the requested
//! occlusion.

use crate::body::Pose2;
use crate::head;
use crate::input::InputError;
use crate::route::Router;
use crate::sim::body::{HEAD, RADIUS_M, SAFETY_M, SPEEDS, intrinsics};
use crate::sim::noise::{mix, share};
use crate::sim::outline::{corners, gap_between, upright};
use crate::sim::render::visible_share;
use crate::sim::scene::{
    DoorSpec, DoorState, ObjectSpec, ObstacleSpec, RoomSpec, SceneSpec, SurfaceSpec, TargetSpec,
};
use crate::sim::shape::{Outline, Shape};
use crate::sim::walls::walls;
use crate::sim::world::{HungDoor, LABEL_OBJECT, Object, Scene, Stand};
use nalgebra::{Isometry2, Vector2};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Maximum number of arrangements of a scene that are tried.
const ROUNDS: usize = 400;
/// Maximum number of places tried for one object within an arrangement.
const PLACES: usize = 60;
/// Maximum number of places tried for the target among the others.
const TARGET_PLACES: usize = 40;
/// Stride in columns and rows of the pixels that are used for first tests of visibility.
const COARSE_STRIDE: usize = 3;
/// Radius of the ring of test poses around the centre of the target's surface, metres: in the middle of the
/// published 1.2 to 1.6 m.
const RING_M: f64 = 1.4;
/// Number of test poses on the ring.
const RING_POSES: usize = 16;

/// Draws everything that the scene leaves open. The same seed gives the same scene.
///
/// # Errors
/// If no arrangement fits: the number of tries, and the most frequent obstacle.
pub fn arrange(spec: &SceneSpec, seed: u64) -> Result<Scene, InputError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let doors = hang_doors(spec, seed);
    let doorways: Vec<_> = doors.iter().map(|d| d.doorway.clone()).collect();
    let mut scene = Scene {
        title: spec.title.clone(),
        room: RoomSpec::around(&spec.rooms),
        rooms: spec.named_rooms().cloned().collect(),
        walls: walls(&spec.rooms, &doorways),
        doors,
        surfaces: spec.surfaces.clone(),
        obstacles: stand_on_floor(spec, seed)?,
        start: Pose2::new(
            spec.start.position_m[0],
            spec.start.position_m[1],
            spec.start.yaw_deg.to_radians(),
        ),
        objects: Vec::new(),
        target: spec.target.clone(),
        target_visible_from_start: None,
        mapped: spec.mapped,
        stereo: spec.stereo,
        light: spec.light,
        visit: spec.visit,
    };
    let router = Router::new(&scene.map(), RADIUS_M + SAFETY_M, SPEEDS);
    if let Err(failure) = router.fits(&scene.start.point()) {
        return Err(InputError::whole(
            title_of(spec),
            format!("the robot cannot stand at its start: {}", failure.because()),
            "move `position_m` of [start]",
        ));
    }
    let mut failures = Failures::default();
    if spec.visits > 1 {
        let placed = (0..ROUNDS as u64).find_map(|round| visits(spec, mix(seed ^ 0x71517) ^ round));
        failures.crowded = ROUNDS;
        scene.objects = placed.ok_or_else(|| failures.report(spec, seed))?;
        return Ok(scene);
    }
    for _ in 0..ROUNDS {
        if !place_all(spec, &mut scene, &mut rng) {
            failures.crowded += 1;
            continue;
        }
        let Some(target) = &spec.target else { return Ok(scene) };
        if let Some(share) = settle_target(spec, target, &router, &mut scene, &mut rng, &mut failures) {
            scene.target_visible_from_start = Some(share);
            return Ok(scene);
        }
    }
    Err(failures.report(spec, seed))
}

/// Places the obstacles on the floor. Their random numbers are drawn separately, so that obstacles do not
/// change other draws.
fn stand_on_floor(spec: &SceneSpec, seed: u64) -> Result<Vec<ObstacleSpec>, InputError> {
    let mut rng = ChaCha8Rng::seed_from_u64(mix(seed ^ 0xf100));
    let outline = |o: &ObstacleSpec| Outline::Rectangle { half_m: [0.5 * o.size_m[0], 0.5 * o.size_m[1]] };
    let at = |o: &ObstacleSpec| {
        Isometry2::new(Vector2::new(o.position_m[0], o.position_m[1]), o.yaw_deg.to_radians())
    };
    let mut tries = |spec: &ObstacleSpec, placed: &[ObstacleSpec]| {
        let Some([x, y]) = spec.spread_m else { return Some(spec.clone()) };
        (0..PLACES).find_map(|_| {
            let mut o = spec.clone();
            o.position_m[0] += x * (rng.random::<f64>() - 0.5);
            o.position_m[1] += y * (rng.random::<f64>() - 0.5);
            o.yaw_deg = rng.random_range(0.0..360.0);
            let apart = |other: &ObstacleSpec| {
                gap_between(&outline(&o), &at(&o), &outline(other), &at(other)) >= o.gap_m
            };
            placed.iter().all(apart).then_some(o)
        })
    };
    for _ in 0..ROUNDS {
        let mut placed: Vec<ObstacleSpec> = Vec::new();
        while let Some(o) = spec.obstacles.get(placed.len()).and_then(|o| tries(o, &placed)) {
            placed.push(o);
        }
        if placed.len() == spec.obstacles.len() {
            placed.retain(|o| spec.is_there(&o.visits, spec.visit));
            return Ok(placed);
        }
    }
    Err(InputError::whole(
        title_of(spec),
        format!("its obstacles found no room in {ROUNDS} arrangements (seed {seed})"),
        "take fewer, a larger `spread_m` or a smaller `gap_m`",
    ))
}

/// Draws the state of each door. Its random numbers are drawn separately, so that arrangements do not depend
/// on the number of doors.
fn hang_doors(spec: &SceneSpec, seed: u64) -> Vec<HungDoor> {
    let hang = |(i, door): (usize, &DoorSpec)| {
        let drawn = mix(mix(seed ^ 0xd00f) ^ i as u64);
        let shut = match (door.state, door.shut_chance) {
            (Some(state), _) => state == DoorState::Shut,
            (None, Some(chance)) => share(drawn) < chance,
            (None, None) => false,
        };
        door.doorway(&spec.rooms).map(|doorway| HungDoor { doorway, shut })
    };
    spec.doors.iter().enumerate().filter_map(hang).collect()
}

fn title_of(spec: &SceneSpec) -> &str {
    if spec.title.is_empty() { "the scene" } else { &spec.title }
}

#[derive(Default)]
struct Failures {
    crowded: usize,
    start: usize,
    nowhere: usize,
    shares: Vec<f64>,
}

impl Failures {
    fn report(self, spec: &SceneSpec, seed: u64) -> InputError {
        let target = spec.target.as_ref().map_or("", |t| t.object.as_str());
        let (problem, mend) = if self.crowded >= ROUNDS / 2 {
            (
                format!(
                    "its objects found no room for {} of {ROUNDS} arrangements (seed {seed})",
                    self.crowded
                ),
                "take fewer or smaller objects, a larger `area_m` or a smaller `gap_m`",
            )
        } else if self.start >= self.nowhere {
            let low = self.shares.iter().copied().fold(f64::INFINITY, f64::min);
            let high = self.shares.iter().copied().fold(0.0, f64::max);
            (
                format!(
                    "in {} places \"{target}\" was seen from the start by a share of {low:.2} to {high:.2}, never within the range asked for (seed {seed})",
                    self.start
                ),
                "add or enlarge something that hides it, or widen `visible_from_start`",
            )
        } else {
            (
                format!(
                    "in {} places that suit the start no pose around the surface saw enough of \"{target}\" (seed {seed})",
                    self.nowhere
                ),
                "make what hides it smaller, or lower `visible_from_some`",
            )
        };
        InputError::whole(title_of(spec), problem, mend)
    }
}

/// Places the objects for the requested visit; `None` if an object finds no place. An object that arrives or
/// moves is placed among the present ones with random numbers of its own, so that all others stay.
fn visits(spec: &SceneSpec, seed: u64) -> Option<Vec<Object>> {
    let mut there: Vec<Option<Object>> = vec![None; spec.objects.len()];
    let mut asked = Vec::new();
    let draws = |i: usize, visit: usize| ChaCha8Rng::seed_from_u64(mix(mix(seed ^ i as u64) ^ visit as u64));
    for visit in 1..=spec.visits {
        let is_there = |o: &ObjectSpec| spec.is_there(&o.visits, visit);
        for (i, o) in spec.objects.iter().enumerate() {
            if !is_there(o) || o.moves.contains(&visit) {
                there[i] = None;
            }
        }
        for (i, o) in spec.objects.iter().enumerate().filter(|(_, o)| is_there(o)) {
            if there[i].is_none() {
                let scaled = |[low, high]: [f64; 2]| o.shape.scaled(draws(i, 0).random_range(low..=high));
                let shape = o.scale.map_or(o.shape.clone(), scaled);
                let mut rng = draws(i, visit);
                let surface = choose_surface(spec, o, None, &mut rng)?;
                there[i] = Some(place(o, shape, surface, there.iter().flatten(), spec.gap_m, &mut rng)?);
            }
        }
        if visit == spec.visit {
            asked = there.iter().flatten().cloned().collect();
        }
    }
    Some(asked)
}

fn place_all(spec: &SceneSpec, scene: &mut Scene, rng: &mut ChaCha8Rng) -> bool {
    scene.objects.clear();
    // What is fixed stands first, then what is large: small things find room between large ones.
    let shapes: Vec<_> = spec
        .objects
        .iter()
        .map(|o| o.scale.map_or(o.shape.clone(), |[low, high]| o.shape.scaled(rng.random_range(low..=high))))
        .collect();
    let mut order: Vec<usize> = (0..spec.objects.len()).collect();
    let reach = |i: usize| match shapes[i].outline() {
        Outline::Disc { radius_m } => radius_m,
        Outline::Rectangle { half_m } => half_m[0].hypot(half_m[1]),
    };
    order.sort_by(|&a, &b| {
        let free = |i: usize| spec.objects[i].position_m.is_none();
        free(a).cmp(&free(b)).then(reach(b).total_cmp(&reach(a))).then(a.cmp(&b))
    });
    let Some(surfaces) = choose_surfaces(spec, rng) else { return false };
    let mut placed: Vec<Option<Object>> = vec![None; spec.objects.len()];
    for i in order {
        let o = &spec.objects[i];
        let others = placed.iter().flatten();
        match place(o, shapes[i].clone(), surfaces[i], others, spec.gap_m, rng) {
            Some(object) => placed[i] = Some(object),
            None => return false,
        }
    }
    scene.objects = placed.into_iter().flatten().collect();
    true
}

/// Places an object on its surface, clear of the others there; `None` if no place is found.
fn place<'a>(
    o: &ObjectSpec,
    shape: Shape,
    surface: &SurfaceSpec,
    others: impl Iterator<Item = &'a Object> + Clone,
    gap_m: f64,
    rng: &mut ChaCha8Rng,
) -> Option<Object> {
    let holds_l = o.holds_l.min(shape.capacity_l());
    let mut object = Object {
        name: o.name.clone(),
        kind: o.kind.clone().unwrap_or_else(|| o.name.clone()),
        shape,
        colour: o.colour,
        stands: Stand::On(surface.name.clone()),
        map_from_object: surface.map_from_top(),
        holds_l,
    };
    let fixed = o.position_m.is_some();
    let tries = if fixed { 1 } else { PLACES };
    let found = (0..tries).any(|_| {
        move_somewhere(o, surface, &mut object, rng);
        fixed || fits(&object, surface, others.clone(), gap_m)
    });
    found.then_some(object)
}

/// Draws for each object one of its possible surfaces by their weights, without a draw where only one is
/// possible; `None` if an object has none.
fn choose_surfaces<'a>(spec: &'a SceneSpec, rng: &mut ChaCha8Rng) -> Option<Vec<&'a SurfaceSpec>> {
    let mut chosen: Vec<&SurfaceSpec> = Vec::new();
    for o in &spec.objects {
        let other = spec.objects.iter().position(|other| Some(&other.name) == o.apart_from.as_ref());
        let taken = other.and_then(|k| chosen.get(k)).map(|s| &s.name);
        chosen.push(choose_surface(spec, o, taken, rng)?);
    }
    Some(chosen)
}

/// Draws one of the possible surfaces of an object by their weights, except `taken`; `None` if no surface is
/// possible.
fn choose_surface<'a>(
    spec: &'a SceneSpec,
    o: &ObjectSpec,
    taken: Option<&String>,
    rng: &mut ChaCha8Rng,
) -> Option<&'a SurfaceSpec> {
    let weight = |k: usize| o.weights.as_ref().map_or(1.0, |w| w[k]);
    let choice: Vec<(&SurfaceSpec, f64)> = spec
        .surfaces_of(o)
        .into_iter()
        .enumerate()
        .filter(|(_, s)| Some(&s.name) != taken)
        .map(|(k, s)| (s, weight(k)))
        .filter(|(_, weight)| *weight > 0.0)
        .collect();
    match choice.as_slice() {
        [] => None,
        [(only, _)] => Some(only),
        several => {
            let mut left = rng.random::<f64>() * several.iter().map(|(_, weight)| weight).sum::<f64>();
            let first = several.iter().find(|(_, weight)| {
                left -= weight;
                left < 0.0
            });
            Some(first.unwrap_or(&several[several.len() - 1]).0)
        }
    }
}

fn move_somewhere(o: &ObjectSpec, surface: &SurfaceSpec, object: &mut Object, rng: &mut ChaCha8Rng) {
    let [x, y] = o.position_m.unwrap_or_else(|| {
        let area = o.area_m.unwrap_or(surface.size_m);
        [0, 1].map(|k| o.area_centre_m[k] + area[k] * (rng.random::<f64>() - 0.5))
    });
    let yaw_rad =
        o.yaw_deg.map_or_else(|| rng.random_range(0.0..std::f64::consts::TAU), |deg| deg.to_radians());
    object.map_from_object = surface.map_from_top() * upright(x, y, 0.0, yaw_rad);
}

/// True if the object's outline lies completely on its surface and keeps the gap to the others.
pub(crate) fn fits<'a>(
    object: &Object,
    surface: &SurfaceSpec,
    others: impl Iterator<Item = &'a Object>,
    gap_m: f64,
) -> bool {
    let local = surface.map_from_top().inv_mul(&object.map_from_object);
    let on_top = corners(&object.shape.outline(), &flat(&local))
        .iter()
        .all(|(p, r)| p.x.abs() + r <= 0.5 * surface.size_m[0] && p.y.abs() + r <= 0.5 * surface.size_m[1]);
    on_top && keeps_apart(object, others, gap_m)
}

/// True if the object keeps the gap to the others on the same surface.
pub(crate) fn keeps_apart<'a>(
    object: &Object,
    mut others: impl Iterator<Item = &'a Object>,
    gap_m: f64,
) -> bool {
    let (outline, here) = (object.shape.outline(), flat(&object.map_from_object));
    others.all(|o| {
        o.name == object.name
            || o.stands != object.stands
            || gap_between(&outline, &here, &o.shape.outline(), &flat(&o.map_from_object)) >= gap_m
    })
}

fn flat(map_from_object: &nalgebra::Isometry3<f64>) -> Isometry2<f64> {
    let pose = Pose2::from_isometry(map_from_object);
    Isometry2::new(Vector2::new(pose.x_m, pose.y_m), pose.yaw_rad)
}

/// Moves the target among the others until it is occluded as requested; returns the share of it that is
/// visible from the start, `None` if no try succeeds.
fn settle_target(
    spec: &SceneSpec,
    target: &TargetSpec,
    router: &Router,
    scene: &mut Scene,
    rng: &mut ChaCha8Rng,
    failures: &mut Failures,
) -> Option<f64> {
    let index = spec.objects.iter().position(|o| o.name == target.object)?;
    let o = &spec.objects[index];
    let surface = spec.surfaces.iter().find(|s| Some(s.name.as_str()) == scene.objects[index].surface())?;
    let label = LABEL_OBJECT + index as u16;
    let [low, high] = target.visible_from_start;
    let tries = if o.position_m.is_some() { 1 } else { TARGET_PLACES };
    for attempt in 0..tries {
        if attempt > 0 {
            let mut moved = scene.objects[index].clone();
            move_somewhere(o, surface, &mut moved, rng);
            if !fits(&moved, surface, scene.objects.iter(), spec.gap_m) {
                continue;
            }
            scene.objects[index] = moved;
        }
        let coarse = share_from(scene, label, &scene.start, COARSE_STRIDE);
        // The coarse share only spares the exact one where it is far off.
        if coarse < low - 0.1 || coarse > high + 0.1 {
            failures.start += 1;
            failures.shares.push(coarse);
            continue;
        }
        let share = share_from(scene, label, &scene.start, 1);
        if share < low || share > high {
            failures.start += 1;
            failures.shares.push(share);
            continue;
        }
        if some_pose_sees(scene, label, surface, router, target.visible_from_some) {
            return Some(share);
        }
        failures.nowhere += 1;
    }
    None
}

fn share_from(scene: &Scene, label: u16, pose: &Pose2, stride: usize) -> f64 {
    let index = usize::from(label - LABEL_OBJECT);
    let look_at = scene.objects[index].centre_m();
    let map_from_camera = head::camera_towards(&HEAD, &pose.isometry(), Some(&look_at));
    visible_share(scene, label, &map_from_camera, &intrinsics(), stride).unwrap_or(0.0)
}

fn some_pose_sees(scene: &Scene, label: u16, surface: &SurfaceSpec, router: &Router, least: f64) -> bool {
    if least <= 0.0 {
        return true;
    }
    let centre = surface.centre_m();
    (0..RING_POSES)
        .map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / RING_POSES as f64;
            Pose2::facing(centre.x + RING_M * angle.cos(), centre.y + RING_M * angle.sin(), &centre)
        })
        .filter(|pose| router.travel(&scene.start, pose).is_ok())
        .any(|pose| share_from(scene, label, &pose, COARSE_STRIDE) >= least)
}
