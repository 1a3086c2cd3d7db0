//! Simulated building with a driven stereo camera: upright walls, tables and cylinders rendered by
//! column, with exact ground truth.

#![allow(dead_code)]

pub mod measure;

use super::tabletop::Draws;
use descry_perception::Intrinsics;
use descry_perception::mapping::{FieldOfView, Station};
use descry_perception::nalgebra::{Isometry2, Point2, Point3, Vector2};
use std::f64::consts::{FRAC_PI_2, PI};

/// Height of the rooms, metres.
pub const CEILING_M: f64 = 2.6;
/// Height of an open door, metres.
pub const DOOR_M: f64 = 2.1;
/// Width of a door, metres.
pub const DOOR_WIDE_M: f64 = 0.9;
/// Width of a corridor, metres.
pub const WIDE_M: f64 = 2.2;
/// Side of wall patches with or without texture, metres.
const TEXTURE_M: f64 = 0.3;

/// An upright rectangle.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    pub a: Point2<f64>,
    pub b: Point2<f64>,
    /// Lower and upper end, metres.
    pub z: (f64, f64),
    /// Share of the wall with texture.
    pub texture: f64,
}

/// Table: half sides along the axes, and height, metres.
#[derive(Clone, Copy, Debug)]
pub struct Table {
    pub middle: Point2<f64>,
    pub half: [f64; 2],
    pub height: f64,
}

/// A round pillar from floor to ceiling.
#[derive(Clone, Copy, Debug)]
pub struct Pillar {
    pub middle: Point2<f64>,
    pub radius_m: f64,
    /// Share of the cylinder with texture.
    pub texture: f64,
}

/// A gap in a wall.
#[derive(Clone, Copy, Debug)]
pub struct Opening {
    pub a: Point2<f64>,
    pub b: Point2<f64>,
}

/// The contents of a building.
#[derive(Clone, Debug, Default)]
pub struct Building {
    pub panels: Vec<Panel>,
    pub tables: Vec<Table>,
    pub pillars: Vec<Pillar>,
    /// Open doors.
    pub openings: Vec<Opening>,
    /// Walls of the corridor itself, for measuring, without lintels, rooms behind doors and
    /// furniture.
    pub walls: Vec<(Point2<f64>, Point2<f64>)>,
}

impl Building {
    /// Adds a wall from floor to ceiling that counts as a wall when measured.
    pub fn wall(&mut self, a: Point2<f64>, b: Point2<f64>, texture: f64) {
        self.panels.push(Panel { a, b, z: (0.0, CEILING_M), texture });
        self.walls.push((a, b));
    }

    /// Adds a wall with open doors at the given distances from `a`; behind each is a small room on
    /// the side of `behind`.
    fn wall_with_doors(
        &mut self,
        (a, b): (Point2<f64>, Point2<f64>),
        doors_m: &[f64],
        behind: Vector2<f64>,
        draws: &mut Draws,
    ) {
        let along = (b - a).normalize();
        let mut from = 0.0;
        for &door in doors_m {
            let (left, right) = (door - 0.5 * DOOR_WIDE_M, door + 0.5 * DOOR_WIDE_M);
            self.wall(a + along * from, a + along * left, 0.3 + 0.3 * draws.next());
            let (p, q) = (a + along * left, a + along * right);
            self.panels.push(Panel { a: p, b: q, z: (DOOR_M, CEILING_M), texture: 0.5 });
            self.openings.push(Opening { a: p, b: q });
            let back = behind * 2.5;
            let (wide, deep) = (along * 0.8, back);
            let corners = [p, p - wide, p - wide + deep, q + wide + deep, q + wide, q];
            for pair in corners[1..5].windows(2) {
                self.panels.push(Panel { a: pair[0], b: pair[1], z: (0.0, CEILING_M), texture: 0.4 });
            }
            from = right;
        }
        self.wall(a + along * from, b, 0.3 + 0.3 * draws.next());
    }

    /// A table against a wall.
    fn table(&mut self, middle: Point2<f64>, half: [f64; 2]) {
        let height = 0.74;
        self.tables.push(Table { middle, half, height });
        let [x, y] = half;
        let corner = |u: f64, v: f64| middle + Vector2::new(u * x, v * y);
        let corners = [corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
        for i in 0..4 {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            self.panels.push(Panel { a, b, z: (0.0, height), texture: 0.7 });
        }
    }

    /// Rectangular corridor loop, `long_m` by `short_m` along its centre line, centred at the
    /// origin, with doors on both sides and some tables.
    pub fn corridor_loop(long_m: f64, short_m: f64, seed: u64) -> Building {
        let mut building = Building::default();
        let mut draws = Draws(seed);
        for (outer, sign) in [(true, 1.0), (false, -1.0)] {
            let (x, y) = (0.5 * (long_m + sign * WIDE_M), 0.5 * (short_m + sign * WIDE_M));
            let corners = [Point2::new(-x, -y), Point2::new(x, -y), Point2::new(x, y), Point2::new(-x, y)];
            for i in 0..4 {
                let (a, b) = (corners[i], corners[(i + 1) % 4]);
                let length = (b - a).norm();
                let along = (b - a) / length;
                let behind = Vector2::new(along.y, -along.x) * sign;
                let doors = (length / 6.0).floor() as usize;
                let mut doors_m = Vec::new();
                for d in 0..doors {
                    let at = (d as f64 + 0.5) * length / doors as f64 + 1.6 * (draws.next() - 0.5);
                    if at > 2.6 && at < length - 2.6 && (outer || draws.next() < 0.6) {
                        doors_m.push(at);
                    }
                }
                building.wall_with_doors((a, b), &doors_m, behind, &mut draws);
            }
        }
        let y = 0.5 * (short_m - WIDE_M) + 0.3;
        for x in [-0.3, 0.22] {
            building.table(Point2::new(x * long_m, y), [0.6, 0.3]);
        }
        building
    }

    /// Adds a box from the floor up that counts as no wall when measured: a square post or a
    /// cupboard.
    pub fn post(&mut self, middle: Point2<f64>, half: [f64; 2], turn_rad: f64, height_m: f64) {
        let at = Isometry2::new(middle.coords, turn_rad);
        let [x, y] = half;
        let corners = [(x, y), (-x, y), (-x, -y), (x, -y)].map(|(u, v)| at * Point2::new(u, v));
        for i in 0..4 {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            self.panels.push(Panel { a, b, z: (0.0, height_m), texture: 0.5 });
        }
    }

    /// A hall of 12 by 8 m with two rows of posts, each round or square by the seed, some with a table or a cupboard against the walls.
    pub fn hall(seed: u64) -> Building {
        let mut draws = Draws(seed);
        let at = Point2::new;
        let mut hall = Building::room(&[at(6.0, -4.0), at(6.0, 4.0), at(-6.0, 4.0), at(-6.0, -4.0)], |_| 0.5);
        for (x, y) in [-4.0, -1.4, 1.4, 4.0].into_iter().flat_map(|x| [(x, -1.7), (x, 1.7)]) {
            let middle = at(x + 0.5 * (draws.next() - 0.5), y + 0.5 * (draws.next() - 0.5));
            let half_m = 0.12 + 0.3 * draws.next();
            if draws.next() < 0.6 {
                hall.pillars.push(Pillar { middle, radius_m: half_m, texture: 0.4 + 0.3 * draws.next() });
            } else {
                let longer_m = half_m * (1.0 + 0.5 * draws.next());
                hall.post(middle, [half_m, longer_m], draws.next(), CEILING_M);
            }
        }
        hall.post(at(5.7, 2.5 * draws.next()), [0.3, 0.5], 0.0, 1.8);
        hall.table(at(-5.4, -1.0 + 2.0 * draws.next()), [0.5, 0.4]);
        hall
    }

    /// Closed room with anticlockwise corners.
    pub fn room(corners: &[Point2<f64>], texture: impl Fn(usize) -> f64) -> Building {
        let mut building = Building::default();
        for (i, a) in corners.iter().enumerate() {
            building.wall(*a, corners[(i + 1) % corners.len()], texture(i));
        }
        building
    }
}

/// The errors of the camera and the wheels, and the path that is driven.
#[derive(Clone, Copy, Debug)]
pub struct Rig {
    /// Stride of sampled columns and rows.
    pub stride: usize,
    /// Standard deviation of disparities, pixels.
    pub disparity_sigma_px: f64,
    /// Share of pixels whose disparity is anything.
    pub mismatched: f64,
    /// Odometry error, as a share of the step.
    pub drift: f64,
    /// Standard deviation of the heading's error a step, radians.
    pub turn_sigma_rad: f64,
}

impl Default for Rig {
    fn default() -> Rig {
        Rig { stride: 4, disparity_sigma_px: 0.3, mismatched: 0.005, drift: 0.035, turn_sigma_rad: 0.026 }
    }
}

/// Camera of a triclops: 640 x 480, base 10 cm, 1.2 m above the floor, level.
pub const CAMERA: Intrinsics =
    Intrinsics { width: 640, height: 480, fx: 550.0, fy: 550.0, cx: 319.5, cy: 239.5 };
const BASE_M: f64 = 0.1;
pub const CAMERA_HEIGHT_M: f64 = 1.2;
/// Maximum stereo range, metres.
pub const FAR_M: f64 = 8.0;

/// Camera's field of view as used for rectification.
pub fn field_of_view() -> FieldOfView {
    let half_rad = (320.0_f64 / 550.0).atan();
    FieldOfView { right_rad: -half_rad, left_rad: half_rad, near_m: 0.5, far_m: FAR_M }
}

/// Number of textured levels: floor, ceiling and tables.
const LEVELS: usize = 3;

/// Deterministic pseudo-random number from 0 to 1 for a place.
fn hash(panel: usize, u: i64, v: i64) -> f64 {
    let key = (panel as u64) << 48 ^ ((u as u64) & 0xff_ffff) << 24 ^ ((v as u64) & 0xff_ffff);
    Draws(key.wrapping_mul(0x9E37_79B9_7F4A_7C15)).next()
}

fn is_textured(panel: usize, share: f64, u_m: f64, v_m: f64) -> bool {
    hash(panel, (u_m / TEXTURE_M).floor() as i64, (v_m / TEXTURE_M).floor() as i64) < share
}

/// Hit of a column's ray on a panel or pillar; pillars are numbered after panels and level
/// surfaces.
struct Hit {
    depth: f64,
    number: usize,
    along_m: f64,
    z: (f64, f64),
    texture: f64,
}

impl Building {
    /// Points that the camera measures from a pose, in the levelled frame of the camera.
    pub fn look(&self, truth: &Isometry2<f64>, rig: &Rig, draws: &mut Draws) -> Vec<Point3<f32>> {
        let mut points = Vec::new();
        for column in (0..CAMERA.width).step_by(rig.stride) {
            // Ahead 1, to the left `side`.
            let side = -(column as f64 - CAMERA.cx) / CAMERA.fx;
            let hits = self.hits(truth, side);
            for row in (0..CAMERA.height).step_by(rig.stride) {
                let up = -(row as f64 - CAMERA.cy) / CAMERA.fy;
                let Some(depth) = self.depth(truth, side, up, &hits) else { continue };
                let exact = CAMERA.fx * BASE_M / depth;
                let disparity = if draws.next() < rig.mismatched {
                    5.0 + 60.0 * draws.next()
                } else {
                    exact + rig.disparity_sigma_px * draws.normal()
                };
                let z = CAMERA.fx * BASE_M / disparity;
                if z > 0.3 && z < FAR_M {
                    points.push(Point3::new(z, z * side, CAMERA_HEIGHT_M + z * up).cast());
                }
            }
        }
        points
    }

    fn hits(&self, truth: &Isometry2<f64>, side: f64) -> Vec<Hit> {
        let from = Point2::from(truth.translation.vector);
        let ray = truth.rotation * Vector2::new(1.0, side);
        let mut hits: Vec<Hit> = Vec::new();
        for (number, p) in self.panels.iter().enumerate() {
            let along = p.b - p.a;
            let to = p.a - from;
            let across = ray.perp(&along);
            let (t, s) = (to.perp(&along) / across, to.perp(&ray) / across);
            if t > 0.05 && t < FAR_M && (0.0..=1.0).contains(&s) {
                let along_m = s * along.norm();
                hits.push(Hit { depth: t, number, along_m, z: p.z, texture: p.texture });
            }
        }
        for (number, p) in (self.panels.len() + LEVELS..).zip(&self.pillars) {
            let to = from - p.middle;
            let (square, half) = (ray.norm_squared(), ray.dot(&to));
            let root = (half * half - square * (to.norm_squared() - p.radius_m * p.radius_m)).sqrt();
            let t = (-half - root) / square;
            // No number: the ray passes by.
            if t > 0.05 && t < FAR_M {
                let off = to + ray * t;
                let along_m = off.y.atan2(off.x) * p.radius_m;
                hits.push(Hit { depth: t, number, along_m, z: (0.0, CEILING_M), texture: p.texture });
            }
        }
        hits.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        hits
    }

    /// Depth at a pixel; `None` without texture.
    fn depth(&self, truth: &Isometry2<f64>, side: f64, up: f64, hits: &[Hit]) -> Option<f64> {
        let upright = hits.iter().find(|h| {
            let z = CAMERA_HEIGHT_M + h.depth * up;
            z >= h.z.0 && z <= h.z.1
        });
        let place = |t: f64| truth * (Point2::new(1.0, side) * t);
        let level = |z: f64| (z - CAMERA_HEIGHT_M) / up;
        let ground = if up < 0.0 { level(0.0) } else { level(CEILING_M) };
        let table = self.tables.iter().filter_map(|table| {
            let t = level(table.height);
            let off = (t > 0.0).then(|| place(t) - table.middle)?;
            (off.x.abs() < table.half[0] && off.y.abs() < table.half[1]).then_some(t)
        });
        let flat = table.fold(ground, f64::min);
        match upright {
            Some(hit) if hit.depth < flat => {
                let z = CAMERA_HEIGHT_M + hit.depth * up;
                is_textured(hit.number, hit.texture, hit.along_m, z).then_some(hit.depth)
            }
            _ if flat < FAR_M => {
                let p = place(flat);
                let (id, share) = match (flat < ground, up > 0.0) {
                    (true, _) => (2, 0.8),
                    (false, true) => (1, 0.5),
                    (false, false) => (0, 0.5),
                };
                is_textured(self.panels.len() + id, share, p.x, p.y).then_some(flat)
            }
            _ => None,
        }
    }

    /// The stations of a drive along true poses, with odometry that errs.
    pub fn drive(&self, truths: &[Isometry2<f64>], rig: &Rig, seed: u64) -> Vec<Station> {
        let mut draws = Draws(seed);
        let mut odometry = truths[0];
        let mut stations = Vec::new();
        for (i, truth) in truths.iter().enumerate() {
            if i > 0 {
                odometry *= rig.measured(&truths[i - 1].inv_mul(truth), &mut draws);
            }
            stations.push(Station { points: self.look(truth, rig, &mut draws), odom_from_level: odometry });
        }
        stations
    }
}

impl Rig {
    /// Step as measured by the wheels.
    pub fn measured(&self, step: &Isometry2<f64>, draws: &mut Draws) -> Isometry2<f64> {
        let way = step.translation.vector;
        let off = Vector2::new(draws.normal(), 0.5 * draws.normal()) * (self.drift * way.norm());
        Isometry2::new(way + off, step.rotation.angle() + self.turn_sigma_rad * draws.normal())
    }
}

/// Poses along straight lines between corners, every `step_m`, with turns on the spot of at most `turn_rad` a step.
pub fn along(corners: &[Point2<f64>], step_m: f64, turn_rad: f64) -> Vec<Isometry2<f64>> {
    let mut poses: Vec<Isometry2<f64>> = Vec::new();
    for pair in corners.windows(2) {
        let way = pair[1] - pair[0];
        let heading = way.y.atan2(way.x);
        let before = poses.last().map_or(heading, |p| p.rotation.angle());
        let turn = (heading - before + PI).rem_euclid(2.0 * PI) - PI;
        let turns = (turn.abs() / turn_rad - 1e-9).ceil().max(0.0) as usize;
        for i in 1..=turns {
            poses.push(Isometry2::new(pair[0].coords, before + turn * i as f64 / turns as f64));
        }
        let steps = (way.norm() / step_m).ceil() as usize;
        let first = usize::from(!poses.is_empty());
        for i in first..=steps {
            poses.push(Isometry2::new((pair[0] + way * (i as f64 / steps as f64)).coords, heading));
        }
    }
    poses
}

/// Poses once around the loop, anticlockwise from the middle of a long side, plus a repeated
/// stretch.
pub fn around(long_m: f64, short_m: f64, again_m: f64, step_m: f64) -> Vec<Isometry2<f64>> {
    let (x, y) = (0.5 * long_m, 0.5 * short_m);
    let at = Point2::new;
    let corners = [at(0.0, -y), at(x, -y), at(x, y), at(-x, y), at(-x, -y), at(again_m, -y)];
    along(&corners, step_m, FRAC_PI_2 / 6.0)
}

/// Moves a share of the points onto people standing at random in the view, different in each view.
pub fn with_people(points: &[Point3<f32>], share: f64, draws: &mut Draws) -> Vec<Point3<f32>> {
    const POINTS_EACH: usize = 400;
    let mut points = points.to_vec();
    let field = field_of_view();
    let mut left = (share * points.len() as f64) as usize;
    let mut order: Vec<(f64, usize)> = (0..points.len()).map(|i| (draws.next(), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken = order.into_iter().map(|(_, i)| i);
    while left > 0 {
        let depth = 1.0 + (field.far_m - 1.5) * draws.next();
        let middle = Point2::new(depth, depth * field.left_rad.tan() * (2.0 * draws.next() - 1.0));
        for at in taken.by_ref().take(POINTS_EACH.min(left)) {
            let angle = PI * (0.5 + draws.next());
            let off = Vector2::new(angle.cos(), angle.sin()) * 0.25;
            let noise = depth * depth * 0.3 / 55.0 * draws.normal();
            points[at] = Point3::new(middle.x + off.x + noise, middle.y + off.y, 1.8 * draws.next()).cast();
        }
        left -= POINTS_EACH.min(left);
    }
    points
}
