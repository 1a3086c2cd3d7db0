//! Household objects in a room, seen by an RGB-D camera: analytic rays, with exact ground truth.

#![allow(dead_code)]

mod bodies;
pub mod made;
mod solid;

pub use bodies::{Body, bodies};
pub use solid::{Paint, Part, Solid};

use super::tabletop::Draws;
use descry_perception::nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use descry_perception::noise::{STEEPEST_DEG, axial_sigma_m};
use descry_perception::{Cloud, Intrinsics, View};
use rayon::prelude::*;

/// Height of the table's top, metres.
pub const TABLE_M: f64 = 0.72;
/// Height of the camera (paper: 1.8 m), metres.
pub const CAMERA_M: f64 = 1.8;
/// An Xtion.
pub const CAMERA: Intrinsics =
    Intrinsics { width: 640, height: 480, fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5 };

/// Room with objects. `owner` of a hit is the index of the object, or `None` for the room.
pub struct Room {
    parts: Vec<Placed>,
    things: usize,
    seed: u64,
}

/// Part with its frame from the world, bounding ball (centre, radius), and owner.
type Placed = (Part, Isometry3<f64>, Point3<f64>, f64, Option<usize>);

/// The options of a room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoomOptions {
    /// True for a free-standing round table with a printed sheet; false for a plain desk with
    /// chairs.
    pub controlled: bool,
    /// Seed of the furniture's places.
    pub seed: u64,
}

impl Room {
    pub fn new(options: RoomOptions) -> Room {
        let mut room = Room { parts: Vec::new(), things: 0, seed: options.seed };
        let mut draws = Draws(options.seed ^ 0xf00d);
        let wall = Paint::Plain([205, 200, 190]);
        let floor = Paint::Cubes { base: [120, 105, 90], spread: 14.0, coarse_m: 0.3, fine_m: 0.1, seed: 5 };
        room.fixed(Solid::Block([3.0, 3.0, 0.05]), floor, Translation3::new(0.0, 0.0, -0.05).into());
        for (x, y, half) in [
            (3.0, 0.0, [0.05, 3.0, 1.3]),
            (-3.0, 0.0, [0.05, 3.0, 1.3]),
            (0.0, 3.0, [3.0, 0.05, 1.3]),
            (0.0, -3.0, [3.0, 0.05, 1.3]),
        ] {
            room.fixed(Solid::Block(half), wall, Translation3::new(x, y, 1.3).into());
        }
        let wood = Paint::Plain([170, 130, 90]);
        room.fixed(Solid::Block([0.4, 0.25, 0.5]), wood, Translation3::new(2.5, -1.8, 0.5).into());
        room.fixed(Solid::Block([0.25, 0.6, 0.9]), wood, Translation3::new(-2.7, 1.2, 0.9).into());
        if options.controlled {
            room.round_table();
        } else {
            room.desk(&mut draws);
        }
        room
    }

    fn round_table(&mut self) {
        let top = Solid::Cone { low_m: 0.5, high_m: 0.5, height_m: 0.03, wall_m: None };
        let white = Paint::Plain([215, 212, 205]);
        self.fixed(top, white, Translation3::new(0.0, 0.0, TABLE_M - 0.03).into());
        let leg = Solid::Cone { low_m: 0.04, high_m: 0.04, height_m: TABLE_M - 0.03, wall_m: None };
        self.fixed(leg, white, Isometry3::identity());
        let print =
            Paint::Cubes { base: [128, 128, 128], spread: 130.0, coarse_m: 0.05, fine_m: 0.02, seed: 9 };
        self.fixed(Solid::Block([0.3, 0.3, 0.0005]), print, Translation3::new(0.0, 0.0, TABLE_M).into());
    }

    fn desk(&mut self, draws: &mut Draws) {
        let plain = Paint::Plain([200, 190, 170]);
        self.fixed(
            Solid::Block([0.6, 0.4, 0.015]),
            plain,
            Translation3::new(0.0, 0.0, TABLE_M - 0.015).into(),
        );
        for (x, y) in [(0.55, 0.35), (-0.55, 0.35), (0.55, -0.35), (-0.55, -0.35)] {
            let leg = Solid::Block([0.025, 0.025, 0.35]);
            self.fixed(leg, plain, Translation3::new(x, y, 0.35).into());
        }
        let from = std::f64::consts::TAU * draws.next();
        for k in 0..2 {
            let turn = from + 1.7 * f64::from(k) + 0.4 * draws.next();
            let far = 0.8 + 0.1 * draws.next();
            let place = Isometry3::from_parts(
                Translation3::new(far * turn.cos(), far * turn.sin(), 0.0),
                UnitQuaternion::from_scaled_axis(Vector3::z() * turn),
            );
            let cloth = Paint::Plain([60, 65, 80]);
            self.fixed(
                Solid::Block([0.21, 0.21, 0.03]),
                cloth,
                place * Isometry3::translation(0.0, 0.0, 0.45),
            );
            self.fixed(
                Solid::Block([0.02, 0.2, 0.22]),
                cloth,
                place * Isometry3::translation(0.2, 0.0, 0.72),
            );
            self.fixed(
                Solid::Block([0.02, 0.02, 0.21]),
                cloth,
                place * Isometry3::translation(0.0, 0.0, 0.21),
            );
        }
    }

    fn fixed(&mut self, solid: Solid, paint: Paint, world_from_part: Isometry3<f64>) {
        self.add(Part { solid, paint, here_from_part: Isometry3::identity() }, world_from_part, None);
    }

    fn add(&mut self, part: Part, world_from_here: Isometry3<f64>, owner: Option<usize>) {
        let pose = world_from_here * part.here_from_part;
        let middle = Point3::from(pose.translation.vector);
        self.parts.push((part, pose.inverse(), middle, part.solid.reach_m(), owner));
    }

    /// Adds an object to the room; returns its index.
    pub fn put(&mut self, body: &Body, world_from_body: Isometry3<f64>) -> usize {
        for part in &body.parts {
            self.add(*part, world_from_body, Some(self.things));
        }
        self.things += 1;
        self.things - 1
    }

    fn meet(&self, eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<Met> {
        Room::meet_of(self.parts.iter(), eye, ray)
    }

    fn meet_of<'a>(
        parts: impl Iterator<Item = &'a Placed>,
        eye: &Point3<f64>,
        ray: &Vector3<f64>,
    ) -> Option<Met> {
        let mut best: Option<Met> = None;
        let length_sq = ray.norm_squared();
        for (part, part_from_world, middle, reach_m, owner) in parts {
            let to = middle - eye;
            let along = to.dot(ray) / length_sq;
            if (to - ray * along).norm_squared() > reach_m * reach_m {
                continue;
            }
            let (o, d) = (part_from_world * eye, part_from_world * ray);
            if let Some(hit) = part.solid.meet(&o, &d).filter(|h| best.as_ref().is_none_or(|b| h.t < b.t)) {
                let normal = part_from_world.rotation.inverse() * hit.normal;
                best = Some(Met { t: hit.t, normal, colour: part.paint.at(&hit.at), owner: *owner });
            }
        }
        best
    }

    /// RGB-D view from the true pose, with the spatially correlated noise of Nguyen et al.; the
    /// cloud's `labels` are ground truth: 0 for the room, else object index plus one.
    pub fn look(
        &self,
        camera: &Intrinsics,
        truth: &Isometry3<f64>,
        stated: &Isometry3<f64>,
        sigmas: (f64, f64),
        seed: u64,
    ) -> View {
        self.look_at(camera, truth, stated, sigmas, seed, (Point3::origin(), f64::INFINITY))
    }

    /// View with returns only from rays that pass within a distance (metres) of a point.
    pub fn look_at(
        &self,
        camera: &Intrinsics,
        truth: &Isometry3<f64>,
        stated: &Isometry3<f64>,
        sigmas: (f64, f64),
        seed: u64,
        only: (Point3<f64>, f64),
    ) -> View {
        let eye = Point3::from(truth.translation.vector);
        let mut draws = Draws(seed ^ 0xca3e);
        let field = Field::new(camera, &mut draws);
        let gain = 1.0 + 0.05 * draws.normal();
        let rows: Vec<Vec<(f32, [u8; 3], u32)>> = (0..camera.height)
            .into_par_iter()
            .map(|v| {
                let mut draws = Draws(seed.wrapping_mul(1_000_003) ^ (v as u64) << 20);
                // The rays of a row lie in a plane, but for noise of a few pixels.
                let ends = [0.0, camera.width as f64]
                    .map(|u| truth.rotation * camera.unproject(u, v as f64, 1.0).coords);
                let across = ends[0].cross(&ends[1]).normalize();
                let near = |p: &&Placed| {
                    let to = p.2 - eye;
                    to.dot(&across).abs() <= p.3 + 0.01 * to.norm()
                };
                let parts: Vec<&Placed> = self.parts.iter().filter(near).collect();
                let to = only.0 - eye;
                let passes = |u: usize| {
                    let ray = (truth.rotation * camera.unproject(u as f64, v as f64, 1.0).coords).normalize();
                    only.1.is_infinite() || (to - ray * to.dot(&ray)).norm() <= only.1
                };
                let pixel = |u| match passes(u) {
                    true => pixel(&parts, camera, truth, &eye, &field, gain, (u, v), &mut draws),
                    false => (f32::NAN, [0; 3], 0),
                };
                (0..camera.width).map(pixel).collect()
            })
            .collect();
        let pixels: Vec<(f32, [u8; 3], u32)> = rows.into_iter().flatten().collect();
        let depths: Vec<f32> = pixels.iter().map(|p| p.0).collect();
        let cloud = camera.cloud_from_depth(&depths).expect("the camera is sound");
        View {
            stamp_ns: 0,
            cloud: Cloud {
                colours: Some(pixels.iter().map(|p| p.1).collect()),
                labels: Some(pixels.iter().map(|p| p.2).collect()),
                ..cloud
            },
            intrinsics: Some(*camera),
            world_from_camera: *stated,
            pose_sigma_m: sigmas.0.max(0.002),
            pose_sigma_rad: sigmas.1.max(0.002),
        }
    }

    /// Outer surface points of an object with their normals in the world, about `step_m` apart.
    pub fn surface(body: &Body, step_m: f64) -> Cloud {
        let mut room = Room { parts: Vec::new(), things: 0, seed: 0 };
        room.put(body, Isometry3::identity());
        let (mut points, mut normals, mut colours) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..60 {
            // A spiral of directions over the upper side and a little below.
            let z = 1.0 - 1.25 * (f64::from(k) + 0.5) / 60.0;
            let turn = 2.399_963 * f64::from(k);
            let r = (1.0 - z * z).max(0.0).sqrt();
            let away = Vector3::new(r * turn.cos(), r * turn.sin(), z);
            let side = away.cross(&Vector3::new(0.3, 0.2, -0.9)).normalize();
            let up = side.cross(&away);
            let steps = (0.5 / step_m) as i32 / 2;
            for i in -steps..=steps {
                for j in -steps..=steps {
                    let off = side * (f64::from(i) * step_m) + up * (f64::from(j) * step_m);
                    let eye = Point3::new(0.0, 0.0, 0.12) + away + off;
                    if let Some(met) = room.meet(&eye, &-away).filter(|m| m.normal.dot(&away) > 0.3) {
                        points.push((eye - away * met.t).cast::<f32>());
                        normals.push(met.normal.cast::<f32>());
                        colours.push(met.colour.map(|c| c as u8));
                    }
                }
            }
        }
        let cloud = Cloud { points, normals: Some(normals), colours: Some(colours), ..Cloud::default() };
        descry_perception::voxel::downsample(&cloud, step_m as f32).expect("a step is a length")
    }
}

#[allow(clippy::too_many_arguments)]
fn pixel(
    parts: &[&Placed],
    camera: &Intrinsics,
    truth: &Isometry3<f64>,
    eye: &Point3<f64>,
    field: &Field,
    gain: f64,
    (u, v): (usize, usize),
    draws: &mut Draws,
) -> (f32, [u8; 3], u32) {
    let (du, dv) = (0.4 * quick(draws), 0.4 * quick(draws));
    let ray = truth.rotation * camera.unproject(u as f64 + du, v as f64 + dv, 1.0).coords;
    let Some(met) = Room::meet_of(parts.iter().copied(), eye, &ray) else { return (f32::NAN, [0; 3], 0) };
    let angle = (-met.normal.dot(&ray) / ray.norm()).clamp(-1.0, 1.0).acos();
    let light = Vector3::new(0.25, -0.35, 0.9).normalize();
    let shade = gain * (0.65 + 0.35 * met.normal.dot(&light).max(0.0));
    let colour = met.colour.map(|c| (c * shade + 3.0 * quick(draws)).clamp(0.0, 255.0) as u8);
    let owner = met.owner.map_or(0, |o| o as u32 + 1);
    let Some(sigma) =
        axial_sigma_m(met.t, angle).filter(|_| met.t < 4.5 && angle.to_degrees() < STEEPEST_DEG)
    else {
        return (f32::NAN, colour, owner);
    };
    let noisy = met.t + sigma * (0.8 * field.at(u, v) + 0.6 * quick(draws));
    // Disparity in eighths of a pixel, base 7.5 cm.
    let disparity = (8.0 * camera.fx * 0.075 / noisy).round() / 8.0;
    ((camera.fx * 0.075 / disparity) as f32, colour, owner)
}

/// Approximately normal random number with unit variance, from three uniform ones.
fn quick(draws: &mut Draws) -> f64 {
    let whole = (draws.next() * (1_u64 << 51) as f64) as u64;
    let part = |k: u32| ((whole >> (17 * k)) & 0x1ffff) as f64 / 131_072.0;
    2.0 * (part(0) + part(1) + part(2) - 1.5)
}

struct Met {
    t: f64,
    normal: Vector3<f64>,
    colour: [f64; 3],
    owner: Option<usize>,
}

/// Spatially correlated noise of unit variance: interpolated from a coarse grid.
struct Field {
    values: Vec<f64>,
    columns: usize,
}

impl Field {
    const STEP: usize = 4;

    fn new(camera: &Intrinsics, draws: &mut Draws) -> Field {
        let (columns, rows) = (camera.width / Field::STEP + 2, camera.height / Field::STEP + 2);
        Field { values: (0..columns * rows).map(|_| draws.normal()).collect(), columns }
    }

    fn at(&self, u: usize, v: usize) -> f64 {
        let (x, y) = (u as f64 / Field::STEP as f64, v as f64 / Field::STEP as f64);
        let (i, j) = (x as usize, y as usize);
        let (a, b) = (x - i as f64, y - j as f64);
        let at = |di: usize, dj: usize| self.values[(j + dj) * self.columns + i + di];
        let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
        let sum =
            weights[0] * at(0, 0) + weights[1] * at(1, 0) + weights[2] * at(0, 1) + weights[3] * at(1, 1);
        sum / weights.iter().map(|w| w * w).sum::<f64>().sqrt()
    }
}

/// Pose of a camera at a point that looks at another.
pub fn looking(eye: Point3<f64>, target: Point3<f64>) -> Isometry3<f64> {
    let forward = (target - eye).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let turn = Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
    Isometry3::from_parts(Translation3::from(eye.coords), UnitQuaternion::from_rotation_matrix(&turn))
}

/// An object upright on the table.
pub fn standing(x: f64, y: f64, turn_rad: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * turn_rad);
    Isometry3::from_parts(Translation3::new(x, y, TABLE_M), turn)
}
