//! A patrol run: the empty place, the place with a new object, the views around it.

use crate::household::{Body, CAMERA, CAMERA_M, Room, RoomOptions, TABLE_M, looking, standing};
use crate::tabletop::{Draws, disturbed};
use descry_perception::learning::{
    Keyframe, LearnOptions, LearnedModel, LearningError, MetaRoom, NoticeOptions, keyframes, learn, register,
};
use descry_perception::nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use descry_perception::{Cloud, View};
use std::time::Instant;

/// Options of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    pub controlled: bool,
    /// Standard deviation of each keyframe's pose, metres and radians.
    pub noise: (f64, f64),
    /// True if another object touches the new one.
    pub touching: bool,
    /// Angle between keyframes, radians.
    pub step_rad: f64,
    pub seed: u64,
}

/// A run with its ground truth.
pub struct Run {
    /// Views; the first is the one that detected the object.
    pub views: Vec<View>,
    pub truths: Vec<Isometry3<f64>>,
    pub keyframes: Vec<Keyframe>,
    pub mask: Vec<bool>,
    pub world_from_body: Isometry3<f64>,
    pub model: LearnedModel,
    pub notice_s: f64,
    pub learn_s: f64,
}

/// Camera positions of the keyframes around an object, world frame, metres.
fn stands(object: &Point3<f64>, from: f64, options: &RunOptions, draws: &mut Draws) -> Vec<Point3<f64>> {
    let mut stands = Vec::new();
    let steps = 72;
    // Uncontrolled, chairs leave two arcs of the way, and it is farther away.
    let open = |turn: f64| options.controlled || (turn % std::f64::consts::PI) < 0.8;
    let radius_m = if options.controlled { 1.0 } else { 1.25 };
    for k in 1..steps {
        let turn = std::f64::consts::TAU * f64::from(k) / f64::from(steps);
        if open(turn) {
            let r = radius_m + 0.1 * draws.next();
            let at = from + turn;
            stands.push(Point3::new(object.x + r * at.cos(), object.y + r * at.sin(), CAMERA_M - 0.35));
        }
    }
    stands
}

/// The three views of a visit from the waypoint, with a common localisation error.
fn visit(
    room: &Room,
    waypoint: &Point3<f64>,
    noise: (f64, f64),
    seed: u64,
) -> (Vec<View>, Vec<Isometry3<f64>>) {
    let mut draws = Draws(seed ^ 0x715);
    let error = disturbed(&Isometry3::identity(), noise.0, noise.1, &mut draws);
    let side = Vector3::z().cross(&waypoint.coords).normalize();
    let mut views = Vec::new();
    let mut truths = Vec::new();
    for (k, off) in [0.0, -0.55, 0.55].into_iter().enumerate() {
        let target = Point3::new(0.0, 0.0, TABLE_M) + side * off;
        let truth = looking(*waypoint, target);
        views.push(room.look(&CAMERA, &truth, &(error * truth), noise, seed.wrapping_add(17 * k as u64)));
        truths.push(truth);
    }
    (views, truths)
}

/// Carries out a run; the error is the reason why nothing was learned.
pub fn run(body: &Body, beside: &Body, options: RunOptions) -> Result<Run, String> {
    let mut draws = Draws(options.seed ^ 0xb0d1);
    let mut room = Room::new(RoomOptions { controlled: options.controlled, seed: options.seed });
    let from = std::f64::consts::TAU * draws.next();
    let far_m = if options.controlled { 1.25 } else { 1.5 };
    let waypoint = Point3::new(far_m * from.cos(), far_m * from.sin(), CAMERA_M);
    let reach = if options.controlled { 0.18 } else { 0.2 };
    let (x, y) = (reach * (2.0 * draws.next() - 1.0), reach * (2.0 * draws.next() - 1.0));
    let turn = std::f64::consts::TAU * draws.next();
    let world_from_body = standing(x, y, turn);
    if options.touching {
        let (near, other) = (std::f64::consts::TAU * draws.next(), std::f64::consts::TAU * draws.next());
        let apart = 0.9 * (radius_m(body) + radius_m(beside));
        room.put(beside, standing(x + apart * near.cos(), y + apart * near.sin(), other));
    }
    let (before, _) = visit(&room, &waypoint, options.noise, options.seed ^ 0x1);
    let mut meta = MetaRoom::new(&before, NoticeOptions::default()).map_err(|e| e.to_string())?;
    room.put(body, world_from_body);
    let (after, truths) = visit(&room, &waypoint, options.noise, options.seed ^ 0x2);
    let start = Instant::now();
    let noticed = meta.visit(&after).map_err(|e| e.to_string())?;
    let notice_s = start.elapsed().as_secs_f64();
    let middle = world_from_body * Point3::new(0.0, 0.0, 0.1);
    let off_m = |a: &&descry_perception::learning::Appeared| (a.centre() - middle).norm();
    let appeared = noticed
        .appeared
        .iter()
        .min_by(|a, b| off_m(a).total_cmp(&off_m(b)))
        .filter(|a| off_m(a) < 0.15)
        .ok_or("nothing noticed")?;
    let first = appeared.view;
    let (mut poses, mut views) = (vec![truths[first]], vec![after[first].clone()]);
    views[0].world_from_camera = noticed.poses[first];
    let mask = appeared.mask.clone();
    let stands = stands(&appeared.centre(), from, &options, &mut draws);
    let looks: Vec<Isometry3<f64>> = std::iter::once(truths[first])
        .chain(stands.iter().map(|eye| looking(*eye, appeared.centre())))
        .collect();
    for k in keyframes(&looks, &appeared.centre(), options.step_rad).into_iter().skip(1) {
        let stated = disturbed(&looks[k], options.noise.0, options.noise.1, &mut draws);
        views.push(room.look(
            &CAMERA,
            &looks[k],
            &stated,
            options.noise,
            options.seed.wrapping_mul(31) + k as u64,
        ));
        poses.push(looks[k]);
    }
    let start = Instant::now();
    let keyframes = register(&views, Some(Vector3::z_axis()), 2.5).map_err(|e| e.to_string())?;
    let model = learn(&views, &keyframes, &mask, &LearnOptions::default()).map_err(|e| e.to_string())?;
    let learn_s = start.elapsed().as_secs_f64();
    Ok(Run { views, truths: poses, keyframes, mask, world_from_body, model, notice_s, learn_s })
}

/// Modelling method, for comparison with the usual one.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// True if keyframes are registered; false: their stated poses are used.
    pub registered: bool,
    /// True if the model is smoothed, as by [`LearnOptions::smooth`].
    pub smooth: bool,
    pub name: &'static str,
}

/// Model of a run's views by another modelling method.
pub fn modelled(run: &Run, way: &Way) -> Result<LearnedModel, LearningError> {
    let keyframes: &[Keyframe] = if way.registered { &run.keyframes } else { &[] };
    let options = LearnOptions { smooth: way.smooth, ..LearnOptions::default() };
    learn(&run.views, keyframes, &run.mask, &options)
}

/// Maximum distance of the surface of a body from its vertical axis, metres.
pub fn radius_m(body: &Body) -> f64 {
    let surface = Room::surface(body, 0.01);
    surface.points.iter().map(|p| f64::from(p.xy().coords.norm())).fold(0.0, f64::max)
}

/// True surface of a body, world frame.
pub fn truth(body: &Body, world_from_body: &Isometry3<f64>) -> Cloud {
    Room::surface(body, 0.003).transformed(world_from_body)
}

/// Distance between two poses: metres and radians.
pub fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let turn: UnitQuaternion<f64> = a.rotation.inverse() * b.rotation;
    ((a.translation.vector - b.translation.vector).norm(), turn.angle())
}
