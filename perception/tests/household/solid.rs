//! Solids with closed-form ray intersection, and their surface colours.

use descry_perception::nalgebra::{Isometry3, Point3, Vector3};

/// Solid in its own frame.
#[derive(Clone, Copy, Debug)]
pub enum Solid {
    /// Half sides, about the origin.
    Block([f64; 3]),
    /// Frustum along z from 0 to its height; open at the top if it has a wall.
    Cone { low_m: f64, high_m: f64, height_m: f64, wall_m: Option<f64> },
    /// Half axes, about the origin.
    Ball([f64; 3]),
    /// Rod between two points, with round ends.
    Rod { from: [f64; 3], to: [f64; 3], radius_m: f64 },
}

/// Colour by position on the solid.
#[derive(Clone, Copy, Debug)]
pub enum Paint {
    /// Uniform colour.
    Plain([u8; 3]),
    /// Random cubes of colours around a mean, of two sizes, metres.
    Cubes { base: [u8; 3], spread: f64, coarse_m: f64, fine_m: f64, seed: u64 },
}

/// A solid placed in a frame.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub solid: Solid,
    pub paint: Paint,
    pub here_from_part: Isometry3<f64>,
}

/// Intersection of a ray with a surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Ray parameter.
    pub t: f64,
    /// In the solid's frame.
    pub at: Point3<f64>,
    pub normal: Vector3<f64>,
}

const NEAREST: f64 = 1e-6;

/// The nearer of two hits.
fn nearer(best: Option<Hit>, hit: Hit) -> Option<Hit> {
    if hit.t > NEAREST && best.is_none_or(|b| hit.t < b.t) { Some(hit) } else { best }
}

impl Solid {
    /// Radius of a bounding ball about the solid's origin, metres.
    pub fn reach_m(&self) -> f64 {
        match *self {
            Solid::Block(half) | Solid::Ball(half) => Vector3::from(half).norm(),
            Solid::Cone { low_m, high_m, height_m, .. } => low_m.max(high_m).hypot(height_m),
            Solid::Rod { from, to, radius_m } => {
                Vector3::from(from).norm().max(Vector3::from(to).norm()) + radius_m
            }
        }
    }

    /// First surface that the ray meets.
    pub fn meet(&self, eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<Hit> {
        match *self {
            Solid::Block(half) => block(half, eye, ray),
            Solid::Ball(half) => ball(half, eye, ray),
            Solid::Cone { low_m, high_m, height_m, wall_m } => {
                let mut best = side(low_m, high_m, height_m, 0.0, eye, ray);
                best = disc(0.0, 0.0, low_m, eye, ray, best);
                match wall_m {
                    None => disc(height_m, 0.0, high_m, eye, ray, best),
                    Some(wall) => {
                        let slope = (high_m - low_m) / height_m;
                        let (low, high) = (low_m + slope * wall - wall, high_m - wall);
                        if let Some(hit) = side_from(low, high, height_m, wall, eye, ray) {
                            best = nearer(best, hit);
                        }
                        best = disc(wall, 0.0, low, eye, ray, best);
                        disc(height_m, high_m - wall, high_m, eye, ray, best)
                    }
                }
            }
            Solid::Rod { from, to, radius_m } => rod(from, to, radius_m, eye, ray),
        }
    }
}

fn block(half: [f64; 3], eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<Hit> {
    let (mut enter, mut leave, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    for k in 0..3 {
        let (a, b) = ((-half[k] - eye[k]) / ray[k], (half[k] - eye[k]) / ray[k]);
        if a.min(b) > enter {
            (enter, axis) = (a.min(b), k);
        }
        leave = leave.min(a.max(b));
    }
    (enter <= leave && enter > NEAREST).then(|| {
        let mut normal = Vector3::zeros();
        normal[axis] = -ray[axis].signum();
        Hit { t: enter, at: eye + ray * enter, normal }
    })
}

fn ball(half: [f64; 3], eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<Hit> {
    let half = Vector3::from(half);
    let (o, d) = (eye.coords.component_div(&half), ray.component_div(&half));
    let (a, b, c) = (d.norm_squared(), o.dot(&d), o.norm_squared() - 1.0);
    let root = (b * b - a * c).max(-1.0);
    let t = if root >= 0.0 { (-b - root.sqrt()) / a } else { return None };
    let at = eye + ray * t;
    let normal = at.coords.component_div(&half).component_div(&half).normalize();
    (t > NEAREST).then_some(Hit { t, at, normal })
}

/// The intersection with both surfaces of a frustum's side, the nearest in front.
fn side(low: f64, high: f64, height: f64, from: f64, eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<Hit> {
    side_from(low, high, height, from, eye, ray)
}

/// Side between the heights `from` and `height`, with radii `low` and `high`.
fn side_from(
    low: f64,
    high: f64,
    height: f64,
    from: f64,
    eye: &Point3<f64>,
    ray: &Vector3<f64>,
) -> Option<Hit> {
    let slope = (high - low) / (height - from);
    // r(z) = low + slope (z - from): x² + y² = r².
    let (r0, k) = (low + slope * (eye.z - from), slope * ray.z);
    let a = ray.x * ray.x + ray.y * ray.y - k * k;
    let b = eye.x * ray.x + eye.y * ray.y - r0 * k;
    let c = eye.x * eye.x + eye.y * eye.y - r0 * r0;
    let root = b * b - a * c;
    if root < 0.0 || a.abs() < 1e-12 {
        return None;
    }
    let mut best = None;
    for t in [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a] {
        let at = eye + ray * t;
        if at.z < from || at.z > height || low + slope * (at.z - from) < 0.0 {
            continue;
        }
        let normal = Vector3::new(at.x, at.y, -slope * at.xy().coords.norm()).normalize();
        let normal = if normal.dot(ray) > 0.0 { -normal } else { normal };
        best = nearer(best, Hit { t, at, normal });
    }
    best
}

/// Ring at a height, with inner and outer radius.
fn disc(
    z: f64,
    inner: f64,
    outer: f64,
    eye: &Point3<f64>,
    ray: &Vector3<f64>,
    best: Option<Hit>,
) -> Option<Hit> {
    let t = (z - eye.z) / ray.z;
    let at = eye + ray * t;
    let r = at.xy().coords.norm();
    if !(t.is_finite() && r >= inner && r <= outer) {
        return best;
    }
    nearer(best, Hit { t, at, normal: Vector3::new(0.0, 0.0, -ray.z.signum()) })
}

fn rod(from: [f64; 3], to: [f64; 3], radius: f64, eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<Hit> {
    let (from, to) = (Point3::from(from), Point3::from(to));
    let mut best = None;
    for end in [from, to] {
        let moved = Point3::from(eye - end);
        if let Some(hit) = ball([radius; 3], &moved, ray) {
            best = nearer(best, Hit { at: eye + ray * hit.t, ..hit });
        }
    }
    let (length, axis) = ((to - from).norm(), (to - from).normalize());
    let off = eye - from;
    let (d, o) = (ray - axis * ray.dot(&axis), off - axis * off.dot(&axis));
    let (a, b, c) = (d.norm_squared(), o.dot(&d), o.norm_squared() - radius * radius);
    let root = b * b - a * c;
    if root >= 0.0 && a > 1e-12 {
        let t = (-b - root.sqrt()) / a;
        let at = eye + ray * t;
        let along = (at - from).dot(&axis);
        if (0.0..=length).contains(&along) {
            let normal = ((at - from) - axis * along).normalize();
            best = nearer(best, Hit { t, at, normal });
        }
    }
    best
}

impl Paint {
    /// Colour at a point of the solid's frame, 0 to 255.
    pub fn at(&self, p: &Point3<f64>) -> [f64; 3] {
        match *self {
            Paint::Plain(colour) => colour.map(f64::from),
            Paint::Cubes { base, spread, coarse_m, fine_m, seed } => {
                let coarse = cube(p, coarse_m, seed);
                let fine = cube(p, fine_m, seed ^ 0x5bd1);
                std::array::from_fn(|k| {
                    let off = 0.7 * coarse[k] + 0.5 * fine[0];
                    (f64::from(base[k]) + spread * off).clamp(4.0, 250.0)
                })
            }
        }
    }
}

/// Three pseudo-random numbers from -1 to 1 for the cube at a point.
fn cube(p: &Point3<f64>, size_m: f64, seed: u64) -> [f64; 3] {
    let mut key = seed;
    for c in p.iter() {
        key = key.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ ((c / size_m + 1000.37).floor() as u64);
    }
    let mut draws = crate::tabletop::Draws(key);
    [0; 3].map(|_| 2.0 * draws.next() - 1.0)
}
