//! Recognition of learned objects in clutter: f-score against coverage (Fig. 5), confidence against truth.

use crate::household::made::furniture;
use crate::household::{Body, CAMERA, Room, RoomOptions, TABLE_M, looking, standing};
use crate::measure::onto;
use crate::runs::{RunOptions, radius_m, run, truth};
use crate::tabletop::Draws;
use descry_perception::learning::{KnowOptions, LearnOptions, Library, Recognised, learn};
use descry_perception::nalgebra::{Isometry3, Point3, Vector3};
use descry_perception::{Cloud, Neighbours, View};
use std::f64::consts::TAU;

/// Scene of household objects on the round table, with a view of it.
pub struct Scene {
    pub view: View,
    /// Bodies by index, with their poses in the world.
    pub things: Vec<(usize, Isometry3<f64>)>,
}

/// A scene of the given bodies, as far as there is room. Furniture stands behind the table, with an unlearned
/// box on it; every fourth scene is a desk with chairs.
pub fn scene(bodies: &[Body], which: &[usize], seed: u64) -> Scene {
    scene_among(bodies, which, 0, seed)
}

/// A scene with leaflets that stand or hang behind the objects.
pub fn scene_among(bodies: &[Body], which: &[usize], leaflets: usize, seed: u64) -> Scene {
    let mut draws = Draws(seed ^ 0x5ce);
    let mut room = Room::new(RoomOptions { controlled: seed % 4 != 3, seed });
    let mut things: Vec<(usize, Isometry3<f64>, f64)> = Vec::new();
    for &i in which {
        let reach = radius_m(&bodies[i]);
        for _ in 0..60 {
            let (r, turn) = (0.33 * draws.next().sqrt(), TAU * draws.next());
            let pose = standing(r * turn.cos(), r * turn.sin(), TAU * draws.next());
            let free = |other: &(usize, Isometry3<f64>, f64)| {
                (other.1.translation.vector - pose.translation.vector).norm() > other.2 + reach + 0.005
            };
            if things.iter().all(free) {
                room.put(&bodies[i], pose);
                things.push((i, pose, reach));
                break;
            }
        }
    }
    let (turn, far) = (TAU * draws.next(), 0.95 + 0.4 * draws.next());
    furnish(&mut room, turn + 0.5 * TAU, leaflets, &mut draws);
    let eye = Point3::new(far * turn.cos(), far * turn.sin(), TABLE_M + 0.55 + 0.35 * draws.next());
    let pose = looking(eye, Point3::new(0.0, 0.0, TABLE_M + 0.05));
    let mut view = room.look(&CAMERA, &pose, &pose, (0.0, 0.0), seed ^ 0x77);
    recolour(&mut view, &mut draws);
    Scene { view, things: things.into_iter().map(|(i, p, _)| (i, p)).collect() }
}

/// Places two pieces of furniture on the floor in a direction from the table's centre, and a box and leaflets
/// beyond the table's edge.
fn furnish(room: &mut Room, towards: f64, leaflets: usize, draws: &mut Draws) {
    let mut put = |low, high, far_m: f64, up_m: f64, wide: f64| {
        let body = furniture(low, high, (draws.next() * 1e12) as u64);
        let at = towards + wide * (2.0 * draws.next() - 1.0);
        let turned = standing(far_m * at.cos(), far_m * at.sin(), at + 0.6 * draws.next());
        room.put(&body, Isometry3::translation(0.0, 0.0, up_m - TABLE_M) * turned);
    };
    put([0.15, 0.2, 0.35], [0.3, 0.5, 0.65], 0.95, 0.0, 0.4);
    put([0.15, 0.2, 0.35], [0.3, 0.5, 0.65], 1.25, 0.0, 1.0);
    put([0.02, 0.1, 0.08], [0.06, 0.18, 0.2], 0.44, TABLE_M, 0.9);
    for k in 0..leaflets {
        put([0.0005, 0.06, 0.08], [0.002, 0.15, 0.16], 0.42 + 0.1 * k as f64, TABLE_M + 0.08 * k as f64, 1.0);
    }
}

/// Changes the lighting relative to learning, and shifts the colour image against the depth image.
fn recolour(view: &mut View, draws: &mut Draws) {
    let gains: [f64; 3] = std::array::from_fn(|_| 1.0 + 0.06 * draws.normal());
    let off = [0; 2].map(|_| (2.0 * draws.normal()).round() as isize);
    let (Some(colours), Some(grid)) = (&view.cloud.colours, view.cloud.grid) else { return };
    let moved = |k: usize, by: isize, of: usize| k.saturating_add_signed(by).min(of - 1);
    let beside = |i: usize| {
        let (u, v) = (moved(i % grid.width, off[0], grid.width), moved(i / grid.width, off[1], grid.height));
        let colour = colours[v * grid.width + u];
        std::array::from_fn(|c| (f64::from(colour[c]) * gains[c]).min(255.0) as u8)
    };
    view.cloud.colours = Some((0..colours.len()).map(beside).collect());
}

/// Model of a body (its index), in the frame of that body.
pub struct Model {
    pub body: usize,
    pub cloud: Cloud,
}

/// Options of recognition where z is up, in models and in scenes.
pub fn options() -> KnowOptions {
    KnowOptions { up: Some(Vector3::z_axis()), ..KnowOptions::default() }
}

/// Number of views on a turntable, from two heights.
const TURNTABLE: usize = 14;

/// Model from the first views of a turntable: close range, perfect poses, given pixel masks.
pub fn offline(body: &Body, number: usize, looks: usize, seed: u64) -> Result<Model, String> {
    let mut room = Room::new(RoomOptions { controlled: true, seed });
    let world_from_body = standing(0.0, 0.0, 0.0);
    room.put(body, world_from_body);
    let middle = Point3::new(0.0, 0.0, TABLE_M + 0.1);
    let views: Vec<View> = (0..looks.min(TURNTABLE))
        .map(|k| {
            let turn = TAU * k as f64 / TURNTABLE as f64;
            let eye = Point3::new(0.75 * turn.cos(), 0.75 * turn.sin(), TABLE_M + [0.35, 0.75][k % 2]);
            let pose = looking(eye, middle);
            room.look_at(&CAMERA, &pose, &pose, (0.0, 0.0), seed + k as u64, (middle, 0.24))
        })
        .collect();
    let labels = views[0].cloud.labels.as_deref().unwrap_or_default();
    let mask: Vec<bool> =
        labels.iter().zip(&views[0].cloud.points).map(|(l, p)| *l == 1 && p.z.is_finite()).collect();
    let model = learn(&views, &[], &mask, &LearnOptions::default()).map_err(|e| e.to_string())?;
    let body_from_model = world_from_body.inverse() * model.world_from_model;
    Ok(Model { body: number, cloud: model.cloud.transformed(&body_from_model) })
}

/// Models of a run from increasing numbers of views, registered onto the true body.
pub fn learned_steps(
    bodies: &[Body],
    body: usize,
    options: RunOptions,
    looks: &[usize],
) -> Result<Vec<Model>, String> {
    let run = run(&bodies[body], &bodies[(body + 5) % bodies.len()], options)?;
    let truth = truth(&bodies[body], &run.world_from_body);
    let model = |&count: &usize| {
        let count = count.min(run.views.len());
        let model = learn(&run.views[..count], &run.keyframes[..count], &run.mask, &LearnOptions::default())
            .map_err(|e| e.to_string())?;
        let found = model.cloud.transformed(&model.world_from_model);
        let cloud = found.transformed(&(run.world_from_body.inverse() * onto(&found, &truth)));
        Ok(Model { body, cloud })
    };
    looks.iter().map(model).collect()
}

/// Mean distance of a body's surface at the stated pose from that at the true pose, metres, so that symmetric
/// poses count as equal.
pub fn surface_off_m(surface: &Cloud, said: &Isometry3<f64>, truly: &Isometry3<f64>) -> f64 {
    let tree = Neighbours::new(&surface.points).expect("few points");
    let there = surface.transformed(&(truly.inverse() * said));
    let off = there
        .points
        .iter()
        .step_by(7)
        .map(|p| tree.nearest(p, 1.0).map_or(1.0, |n| f64::from(n.distance_sq).sqrt()));
    off.clone().sum::<f64>() / off.count().max(1) as f64
}

/// Maximum mean surface distance of a correct answer, metres.
pub const RIGHT_M: f64 = 0.01;

/// True if the answer's pose puts the surface of the body within [`RIGHT_M`] of the surface at the true
/// pose.
pub fn is_right(scene: &Scene, surfaces: &[Cloud], body: usize, found: &Recognised) -> bool {
    scene.things.iter().any(|(i, pose)| {
        *i == body && surface_off_m(&surfaces[body], &found.world_from_model, pose) < RIGHT_M
    })
}

/// Numbers of right and wrong answers, and of missed objects, for one model over all scenes.
#[derive(Default)]
pub struct Tally {
    pub right: usize,
    pub wrong: usize,
    pub missed: usize,
}

impl Tally {
    /// Adds a scene: true if the object was there, and for each answer true if it is right.
    pub fn add(&mut self, there: bool, answers: impl Iterator<Item = bool>) {
        let (mut right, mut all) = (0, 0);
        answers.for_each(|is_right| (right, all) = (right + usize::from(is_right), all + 1));
        self.right += right;
        self.wrong += all - right;
        self.missed += usize::from(there && right == 0);
    }

    pub fn f_score(&self) -> f64 {
        2.0 * self.right as f64 / (2 * self.right + self.wrong + self.missed).max(1) as f64
    }
}

/// Library of the models, in their order.
pub fn library(models: &[&Model]) -> Library {
    let mut library = Library::default();
    for model in models {
        library.add(&model.cloud, &options()).expect("a learned model has points");
    }
    library
}

/// Random distinct numbers below `of`.
pub fn some(draws: &mut Draws, of: usize, count: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..of).collect();
    (0..count.min(of)).map(|_| all.remove((draws.next() * all.len() as f64) as usize % all.len())).collect()
}
