//! Planar laser in the scene: horizontal rays against room and solids at one height, and the noise of a SICK
//! LMS 200.

use crate::body::Pose2;
use crate::parts;
use crate::sim::scene::RoomSpec;
use crate::sim::world::{Scene, Solid};
use descry_perception::laser::Scan;
use nalgebra::{Isometry2, Isometry3, Point3, Vector3};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// A laser that sweeps in a horizontal plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserModel {
    /// Angle of the first reading, anticlockwise from straight ahead, radians.
    pub first_rad: f64,
    /// Angle from one reading to the next, radians.
    pub step_rad: f64,
    /// Number of readings in a sweep.
    pub readings: usize,
    /// Height of the plane above the floor, metres.
    pub height_m: f64,
    /// Maximum range, metres.
    pub reach_m: f64,
    /// Standard deviation of a range, metres.
    pub sigma_m: f64,
    /// Resolution of ranges, metres; 0 for exact ones.
    pub precision_m: f64,
}

impl Default for LaserModel {
    /// A SICK LMS 200, 40 cm above the floor (Modayil and Kuipers, section V).
    fn default() -> Self {
        LaserModel {
            first_rad: -std::f64::consts::FRAC_PI_2,
            step_rad: std::f64::consts::PI / 180.0,
            readings: 181,
            height_m: 0.4,
            reach_m: 8.0,
            sigma_m: 0.005,
            precision_m: 0.01,
        }
    }
}

impl LaserModel {
    /// The laser as a part of a body, above the centre of its base.
    pub fn part(&self) -> parts::Laser {
        parts::Laser {
            frame: "laser".into(),
            base_from_laser: Isometry3::translation(0.0, 0.0, self.height_m),
            first_rad: self.first_rad,
            step_rad: self.step_rad,
            readings: self.readings,
            reach_m: self.reach_m,
        }
    }
}

/// Simulates a sweep of a laser whose true pose is `map_from_laser`; the scan carries the pose `stated`.
/// Readings without a return are infinite.
pub fn sweep(
    scene: &Scene,
    laser: &LaserModel,
    map_from_laser: &Pose2,
    stated: &Pose2,
    rng: &mut impl Rng,
) -> Scan {
    let solids = crossing(scene, laser.height_m);
    let angles_rad: Vec<f64> =
        (0..laser.readings).map(|i| laser.first_rad + laser.step_rad * i as f64).collect();
    let eye = Point3::new(map_from_laser.x_m, map_from_laser.y_m, laser.height_m);
    let range = |angle: &f64| {
        let heading = map_from_laser.yaw_rad + angle;
        let along = Vector3::new(heading.cos(), heading.sin(), 0.0);
        let exact = nearest_m(&scene.room, &solids, &eye, &along, laser.reach_m);
        // Drawn whether something returns or not, so that a reading's noise does not depend on the others.
        let noise: f64 = StandardNormal.sample(rng);
        told(laser, exact, noise)
    };
    Scan {
        ranges_m: angles_rad.iter().map(range).collect(),
        angles_rad,
        map_from_laser: Isometry2::new(nalgebra::Vector2::new(stated.x_m, stated.y_m), stated.yaw_rad),
    }
}

fn told(laser: &LaserModel, exact_m: f64, noise: f64) -> f64 {
    if exact_m > laser.reach_m {
        return f64::INFINITY;
    }
    let noisy = exact_m + laser.sigma_m * noise;
    let steps =
        if laser.precision_m > 0.0 { (noisy / laser.precision_m).round() * laser.precision_m } else { noisy };
    steps.max(laser.precision_m)
}

/// Solids that intersect the horizontal plane at a height, with the transform from the map into their own
/// frames.
fn crossing(scene: &Scene, height_m: f64) -> Vec<(Isometry3<f64>, Solid)> {
    scene
        .solids()
        .into_iter()
        .filter(|solid| {
            // All solids of a scene stand upright.
            let base = solid.map_from_solid.translation.z;
            (base + solid.bounds.0.z..=base + solid.bounds.1.z).contains(&height_m)
        })
        .map(|solid| (solid.map_from_solid.inverse(), solid))
        .collect()
}

/// Range of a horizontal ray from `eye`, metres; infinite without a hit.
fn nearest_m(
    room: &RoomSpec,
    solids: &[(Isometry3<f64>, Solid)],
    eye: &Point3<f64>,
    along: &Vector3<f64>,
    reach_m: f64,
) -> f64 {
    let wall = if eye.z <= room.wall_height_m { wall_m(room, eye, along) } else { f64::INFINITY };
    solids.iter().fold(wall, |nearest, (solid_from_map, solid)| {
        let (o, d) = (solid_from_map * eye, solid_from_map * along);
        solid.hit(&o, &d, nearest.min(reach_m)).map_or(nearest, |hit| hit.t)
    })
}

/// Range from inside the room to its outer walls, metres; infinite from outside.
fn wall_m(room: &RoomSpec, eye: &Point3<f64>, along: &Vector3<f64>) -> f64 {
    let (low, high) = (room.low(), room.high());
    let to = |axis: usize| match along[axis] {
        d if d > 0.0 => (high[axis] - eye[axis]) / d,
        d if d < 0.0 => (low[axis] - eye[axis]) / d,
        _ => f64::INFINITY,
    };
    let nearest = to(0).min(to(1));
    if nearest > 0.0 { nearest } else { f64::INFINITY }
}
