//! A table with cups and boxes, seen by a depth camera: analytic rays, so that the truth is exact.

#![allow(dead_code)]

use descry_perception::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use descry_perception::{Intrinsics, View};

/// Height of the table's top, metres.
pub const TABLE_M: f64 = 0.72;
/// The camera of paper 004.
pub const CAMERA: Intrinsics =
    Intrinsics { width: 640, height: 480, fx: 589.0, fy: 609.0, cx: 319.5, cy: 239.5 };

/// Something on the table. Places are of the middle of the base, metres on the table.
#[derive(Clone, Copy, Debug)]
pub enum Thing {
    /// Open at the top, wall 3 mm; with a handle towards an angle if there is one.
    Cup { x: f64, y: f64, radius: f64, height: f64, handle_rad: Option<f64> },
    /// Closed round body.
    Tin { x: f64, y: f64, radius: f64, height: f64 },
    /// What is left of a round side: so far to both sides of a direction.
    Sherd { x: f64, y: f64, radius: f64, height: f64, towards_rad: f64, half_rad: f64 },
    /// Half sides along its own axes, turned.
    Block { x: f64, y: f64, half: [f64; 2], height: f64, turn_rad: f64 },
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

/// A camera on a ring around the table's middle (the origin), looking at it.
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

/// What the camera sees from its true pose, with the noise of Nguyen et al., told with the stated pose.
pub fn look(things: &[Thing], truth: &Isometry3<f64>, stated: &Isometry3<f64>, draws: &mut Draws) -> View {
    let eye = Point3::from(truth.translation.vector);
    let mut depths = vec![f32::NAN; CAMERA.width * CAMERA.height];
    for (i, depth) in depths.iter_mut().enumerate() {
        let (u, v) = ((i % CAMERA.width) as f64, (i / CAMERA.width) as f64);
        // The ray wanders by less than a pixel: noise across it, and frayed edges.
        let (du, dv) = (0.4 * draws.normal(), 0.4 * draws.normal());
        let ray = truth.rotation * CAMERA.unproject(u + du, v + dv, 1.0).coords;
        if let Some(z) = nearest(things, &eye, &ray) {
            let sigma = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
            let noisy = z + sigma * draws.normal();
            // Disparity in eighths of a pixel, base 7.5 cm.
            let disparity = (8.0 * CAMERA.fx * 0.075 / noisy).round() / 8.0;
            *depth = (CAMERA.fx * 0.075 / disparity) as f32;
        }
    }
    View {
        stamp_ns: 0,
        cloud: CAMERA.cloud_from_depth(&depths).expect("the camera is sound"),
        intrinsics: Some(CAMERA),
        world_from_camera: *stated,
        pose_sigma_m: 0.03,
        pose_sigma_rad: 0.035,
    }
}

/// Ray parameter of the nearest surface (the ray has depth 1 along the optical axis).
fn nearest(things: &[Thing], eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    let mut best = f64::INFINITY;
    let mut offer = |t: f64| {
        if t > 0.1 && t < best {
            best = t;
        }
    };
    for (z, half) in [(TABLE_M, Some([0.8, 0.4])), (0.0, None)] {
        let t = (z - eye.z) / ray.z;
        let p = eye + ray * t;
        if half.is_none_or(|h| p.x.abs() < h[0] && p.y.abs() < h[1]) {
            offer(t);
        }
    }
    for thing in things {
        match *thing {
            Thing::Cup { x, y, radius, height, handle_rad } => {
                tube(eye, ray, x, y, radius, height).for_each(&mut offer);
                tube(eye, ray, x, y, radius - 0.003, height).for_each(&mut offer);
                disc(eye, ray, x, y, radius, TABLE_M + 0.004).for_each(&mut offer);
                if let Some(angle) = handle_rad {
                    handle(eye, ray, x, y, radius, height, angle).for_each(&mut offer);
                }
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
        }
    }
    best.is_finite().then_some(best)
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
