//! Table with cups and boxes, seen by a depth camera: analytic rays, with exact ground truth.

#![allow(dead_code)]

pub mod device;
pub mod pile;

use descry_perception::View;
use descry_perception::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use device::KINECT;

/// Height of the table's top, metres.
pub const TABLE_M: f64 = 0.72;

/// Object on the table; positions are base centres, metres on the table.
#[derive(Clone, Copy, Debug)]
pub enum Thing {
    /// Open cup with a 3 mm wall, and a handle at an angle if there is one.
    Cup { x: f64, y: f64, radius: f64, height: f64, handle_rad: Option<f64> },
    /// Closed round body.
    Tin { x: f64, y: f64, radius: f64, height: f64 },
    /// A piece of a round side: `half_rad` to both sides of a direction.
    Sherd { x: f64, y: f64, radius: f64, height: f64, towards_rad: f64, half_rad: f64 },
    /// Box with half sides along its own rotated axes.
    Block { x: f64, y: f64, half: [f64; 2], height: f64, turn_rad: f64 },
    /// Body of revolution with a scaled profile of heights and radii; open ones have a 3 mm wall.
    /// With a handle at an angle and a spout opposite to it.
    Turned {
        x: f64,
        y: f64,
        knots: &'static [[f64; 2]],
        scale: f64,
        open: bool,
        handle_rad: Option<f64>,
        spout: bool,
    },
    /// Open cup with its foot at a height above the table, on or in another object.
    Raised { x: f64, y: f64, radius: f64, height: f64, base: f64 },
    /// Cup (or closed tin) lying on its side, with foot and rim on opposite ends along a direction,
    /// and a handle at its side.
    Lying { x: f64, y: f64, radius: f64, height: f64, towards_rad: f64, open: bool, handle: bool },
}

impl Thing {
    /// Centre of the base, metres on the table.
    pub fn place(&self) -> (f64, f64) {
        match *self {
            Thing::Cup { x, y, .. }
            | Thing::Tin { x, y, .. }
            | Thing::Sherd { x, y, .. }
            | Thing::Block { x, y, .. }
            | Thing::Turned { x, y, .. }
            | Thing::Raised { x, y, .. }
            | Thing::Lying { x, y, .. } => (x, y),
        }
    }

    /// Horizontal extent of the object from its centre, metres.
    pub fn reach_m(&self) -> f64 {
        let grip = |handle_rad: Option<f64>| if handle_rad.is_some() { 0.03 } else { 0.0 };
        match *self {
            Thing::Cup { radius, handle_rad, .. } => radius + grip(handle_rad),
            Thing::Tin { radius, .. } | Thing::Sherd { radius, .. } | Thing::Raised { radius, .. } => radius,
            Thing::Block { half, .. } => half[0].hypot(half[1]),
            Thing::Lying { radius, height, handle, .. } => {
                (radius + grip(handle.then_some(0.0))).hypot(0.5 * height)
            }
            Thing::Turned { knots, scale, handle_rad, .. } => {
                scale * knots.iter().map(|k| k[1]).fold(0.0, f64::max) + grip(handle_rad)
            }
        }
    }

    /// Free space between two objects, metres; negative if they may overlap.
    pub fn gap_m(&self, other: &Thing) -> f64 {
        let ((ax, ay), (bx, by)) = (self.place(), other.place());
        (ax - bx).hypot(ay - by) - self.reach_m() - other.reach_m()
    }
}

/// Repeatable draws.
pub struct Draws(pub u64);

impl Draws {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let a = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let b = (a ^ (a >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((b ^ (b >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.next()).ln()).sqrt() * (std::f64::consts::TAU * self.next()).cos()
    }

    pub fn normal3(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal())
    }
}

/// Camera on a ring around the table's centre (the origin), looking at it.
pub fn on_ring(angle_rad: f64, radius_m: f64, height_m: f64) -> Isometry3<f64> {
    let eye = Point3::new(radius_m * angle_rad.cos(), radius_m * angle_rad.sin(), height_m);
    let forward = (Point3::new(0.0, 0.0, TABLE_M + 0.05) - eye).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let down = forward.cross(&right);
    let turn = descry_perception::nalgebra::Rotation3::from_basis_unchecked(&[right, down, forward]);
    Isometry3::from_parts(Translation3::from(eye.coords), UnitQuaternion::from_rotation_matrix(&turn))
}

/// A pose as localisation errs: spreads in metres and radians.
pub fn disturbed(pose: &Isometry3<f64>, sigma_m: f64, sigma_rad: f64, draws: &mut Draws) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(draws.normal3() * sigma_rad);
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector + draws.normal3() * sigma_m),
        turn * pose.rotation,
    )
}

/// View of the paper's camera from the true pose, with the noise of Nguyen et al., labelled with
/// the stated pose.
pub fn look(things: &[Thing], truth: &Isometry3<f64>, stated: &Isometry3<f64>, draws: &mut Draws) -> View {
    KINECT.look(things, truth, stated, draws)
}

/// Half sides of the table's top, metres.
pub const HALF_M: [f64; 2] = [0.8, 0.4];

/// Ray parameter of the nearest surface (the ray has depth 1 along the optical axis).
fn nearest(things: &[Thing], eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    let hits = things.iter().filter_map(|thing| meets(thing, eye, ray));
    let best = hits.fold(bare(HALF_M, eye, ray), f64::min);
    best.is_finite().then_some(best)
}

/// Distance along a ray to the table's top or the floor; infinite if the ray meets neither.
fn bare(half_m: [f64; 2], eye: &Point3<f64>, ray: &Vector3<f64>) -> f64 {
    let level = |(z, half): (f64, Option<[f64; 2]>)| {
        let t = (z - eye.z) / ray.z;
        let p = eye + ray * t;
        (t > 0.1 && half.is_none_or(|h| p.x.abs() < h[0] && p.y.abs() < h[1])).then_some(t)
    };
    [(TABLE_M, Some(half_m)), (0.0, None)].into_iter().filter_map(level).fold(f64::INFINITY, f64::min)
}

/// Distance along a ray to its first hit on an object.
fn meets(thing: &Thing, eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    // What a ray passes by, seen from above, it does not meet.
    let across = (ray.x * ray.x + ray.y * ray.y).sqrt();
    let (x, y) = thing.place();
    if ((x - eye.x) * ray.y - (y - eye.y) * ray.x).abs() > across * (thing.reach_m() + 0.001) {
        return None;
    }
    let mut best = f64::INFINITY;
    let mut offer = |t: f64| {
        if t > 0.1 && t < best {
            best = t;
        }
    };
    match *thing {
        Thing::Cup { x, y, radius, height, handle_rad } => {
            tube(eye, ray, x, y, radius, height).for_each(&mut offer);
            tube(eye, ray, x, y, radius - 0.003, height).for_each(&mut offer);
            disc(eye, ray, x, y, radius, TABLE_M + 0.004).for_each(&mut offer);
            if let Some(angle) = handle_rad {
                handle(eye, ray, x, y, radius, height, angle).for_each(&mut offer);
            }
        }
        Thing::Raised { x, y, radius, height, base } => {
            let cup = Thing::Cup { x, y, radius, height, handle_rad: None };
            return meets(&cup, &(eye - base * Vector3::z()), ray);
        }
        Thing::Tin { x, y, radius, height } => {
            tube(eye, ray, x, y, radius, height).for_each(&mut offer);
            disc(eye, ray, x, y, radius, TABLE_M + height).for_each(&mut offer);
        }
        Thing::Sherd { x, y, radius, height, towards_rad, half_rad } => {
            let is_left = |t: &f64| {
                let p = eye + ray * *t;
                let (sin, cos) = towards_rad.sin_cos();
                (p.x - x) * cos + (p.y - y) * sin > radius * half_rad.cos()
            };
            tube(eye, ray, x, y, radius, height).filter(is_left).for_each(&mut offer);
        }
        Thing::Block { x, y, half, height, turn_rad } => {
            let low = Point3::new(-half[0], -half[1], TABLE_M);
            let high = Point3::new(half[0], half[1], TABLE_M + height);
            cuboid(eye, ray, x, y, turn_rad, &low, &high).for_each(&mut offer);
        }
        Thing::Turned { .. } => meets_turned(thing, eye, ray, &mut offer),
        Thing::Lying { x, y, radius, height, towards_rad, open, handle: has_handle } => {
            // Across it, up from its axis, along it from its foot.
            let (sin, cos) = towards_rad.sin_cos();
            let own = |v: Vector3<f64>| Vector3::new(cos * v.y - sin * v.x, v.z, cos * v.x + sin * v.y);
            let axis = Point3::new(x, y, TABLE_M + radius);
            let eye = Point3::from(own(eye - axis)) + Vector3::new(0.0, 0.0, TABLE_M + 0.5 * height);
            let ray = own(*ray);
            tube(&eye, &ray, 0.0, 0.0, radius, height).for_each(&mut offer);
            disc(&eye, &ray, 0.0, 0.0, radius, TABLE_M).for_each(&mut offer);
            if open {
                tube(&eye, &ray, 0.0, 0.0, radius - 0.003, height).for_each(&mut offer);
            } else {
                disc(&eye, &ray, 0.0, 0.0, radius, TABLE_M + height).for_each(&mut offer);
            }
            if has_handle {
                handle(&eye, &ray, 0.0, 0.0, radius, height, 0.0).for_each(&mut offer);
            }
        }
    }
    best.is_finite().then_some(best)
}

/// Offers the distances along a ray of all hits on a body of revolution.
fn meets_turned(thing: &Thing, eye: &Point3<f64>, ray: &Vector3<f64>, offer: &mut dyn FnMut(f64)) {
    let Thing::Turned { x, y, knots, scale, open, handle_rad, spout } = *thing else { return };
    let here = Point3::new(eye.x - x, eye.y - y, eye.z - TABLE_M);
    turned(&here, ray, knots, scale, 0.0).for_each(&mut *offer);
    let [foot, rim] = [0, knots.len() - 1].map(|k| knots[k].map(|m| m * scale));
    if open {
        turned(&here, ray, knots, scale, 0.003).for_each(&mut *offer);
        disc(eye, ray, x, y, foot[1], TABLE_M + 0.004).for_each(&mut *offer);
    } else {
        disc(eye, ray, x, y, rim[1], TABLE_M + rim[0]).for_each(&mut *offer);
    }
    if let Some(angle) = handle_rad {
        handle(eye, ray, x, y, foot[1], rim[0], angle).for_each(&mut *offer);
        if spout {
            let low = Point3::new(-rim[1] - 0.025, -0.012, TABLE_M + 0.85 * rim[0]);
            let high = Point3::new(-rim[1], 0.012, TABLE_M + rim[0]);
            cuboid(eye, ray, x, y, angle, &low, &high).for_each(&mut *offer);
        }
    }
}

fn tube(
    eye: &Point3<f64>,
    ray: &Vector3<f64>,
    x: f64,
    y: f64,
    radius: f64,
    height: f64,
) -> impl Iterator<Item = f64> {
    let (ox, oy) = (eye.x - x, eye.y - y);
    let a = ray.x * ray.x + ray.y * ray.y;
    let b = ox * ray.x + oy * ray.y;
    let root = b * b - a * (ox * ox + oy * oy - radius * radius);
    let (eye_z, ray_z) = (eye.z, ray.z);
    let times = (root > 0.0).then(|| [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a]);
    times.into_iter().flatten().filter(move |t| {
        let z = eye_z + ray_z * t;
        (TABLE_M..TABLE_M + height).contains(&z)
    })
}

/// Side of a body of revolution about the origin, with its wall: frusta between the profile's
/// points.
fn turned<'a>(
    eye: &'a Point3<f64>,
    ray: &'a Vector3<f64>,
    knots: &'static [[f64; 2]],
    scale: f64,
    wall: f64,
) -> impl Iterator<Item = f64> + 'a {
    knots.windows(2).flat_map(move |pair| {
        let [[low, at_low], [high, at_high]] =
            [0, 1].map(|k| [pair[k][0] * scale, pair[k][1] * scale - wall]);
        let slope = (at_high - at_low) / (high - low);
        let (radius, widens) = (at_low + slope * (eye.z - low), slope * ray.z);
        let a = ray.x * ray.x + ray.y * ray.y - widens * widens;
        let b = eye.x * ray.x + eye.y * ray.y - radius * widens;
        let root = b * b - a * (eye.x * eye.x + eye.y * eye.y - radius * radius);
        let times = (root > 0.0).then(|| [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a]);
        times
            .into_iter()
            .flatten()
            .filter(move |t| (low..high).contains(&(eye.z + ray.z * t)) && radius + widens * t > 0.0)
    })
}

fn disc(
    eye: &Point3<f64>,
    ray: &Vector3<f64>,
    x: f64,
    y: f64,
    radius: f64,
    z: f64,
) -> impl Iterator<Item = f64> {
    let t = (z - eye.z) / ray.z;
    let p = eye + ray * t;
    ((p.x - x).hypot(p.y - y) < radius).then_some(t).into_iter()
}

/// Three bars: up at the outside, in at the top and at the bottom.
fn handle(
    eye: &Point3<f64>,
    ray: &Vector3<f64>,
    x: f64,
    y: f64,
    radius: f64,
    height: f64,
    angle: f64,
) -> impl Iterator<Item = f64> {
    let bar = |r0: f64, r1: f64, z0: f64, z1: f64| {
        (Point3::new(r0, -0.006, TABLE_M + z0 * height), Point3::new(r1, 0.006, TABLE_M + z1 * height))
    };
    let bars = [
        bar(radius + 0.02, radius + 0.03, 0.25, 0.8),
        bar(radius, radius + 0.03, 0.72, 0.82),
        bar(radius, radius + 0.03, 0.22, 0.32),
    ];
    let (eye, ray) = (*eye, *ray);
    bars.into_iter()
        .flat_map(move |(low, high)| cuboid(&eye, &ray, x, y, angle, &low, &high).collect::<Vec<_>>())
}

fn cuboid(
    eye: &Point3<f64>,
    ray: &Vector3<f64>,
    x: f64,
    y: f64,
    turn_rad: f64,
    low: &Point3<f64>,
    high: &Point3<f64>,
) -> impl Iterator<Item = f64> {
    let (sin, cos) = turn_rad.sin_cos();
    let o = [cos * (eye.x - x) + sin * (eye.y - y), -sin * (eye.x - x) + cos * (eye.y - y), eye.z];
    let d = [cos * ray.x + sin * ray.y, -sin * ray.x + cos * ray.y, ray.z];
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for k in 0..3 {
        let (a, b) = ((low[k] - o[k]) / d[k], (high[k] - o[k]) / d[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter < leave).then_some(enter).into_iter()
}
