//! Piles of touching, stacked objects that hide most of the table.

use super::device::{Device, KINECT};
use super::{Draws, HALF_M, Thing, bare, meets, on_ring};
use descry_perception::nalgebra::{Isometry3, Point3, Vector3};
use descry_perception::{Intrinsics, View};

/// Half side of the square that contains the objects, metres.
const HEAP_M: f64 = 0.33;
/// Half sides of a table whose border is out of view, metres.
const DESK_M: [f64; 2] = [2.5, 2.5];
/// Minimum share of the visible returns on objects.
const COVERED: f64 = 0.7;
/// Profile of a bowl: height and radius from the foot up, metres.
const BOWL: [[f64; 2]; 4] = [[0.0, 0.035], [0.015, 0.055], [0.04, 0.072], [0.06, 0.08]];

/// Object with the height of its support above the table, metres.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    pub thing: Thing,
    pub base_m: f64,
}

/// Objects on a table.
pub struct Pile {
    pub things: Vec<Placed>,
    /// Half sides of the table's top, metres.
    pub half_m: [f64; 2],
}

impl Placed {
    fn top_m(&self) -> f64 {
        self.base_m
            + match self.thing {
                Thing::Cup { height, .. }
                | Thing::Tin { height, .. }
                | Thing::Sherd { height, .. }
                | Thing::Block { height, .. } => height,
                Thing::Raised { height, base, .. } => base + height,
                Thing::Turned { knots, scale, .. } => scale * knots[knots.len() - 1][0],
                Thing::Lying { radius, .. } => 2.0 * radius,
            }
    }

    /// Corners seen from above, anticlockwise, metres.
    fn footprint(&self) -> Vec<[f64; 2]> {
        let (x, y) = self.thing.place();
        match self.thing {
            Thing::Block { half: [a, b], turn_rad, .. } => {
                let (sin, cos) = turn_rad.sin_cos();
                let corners = [[-a, -b], [a, -b], [a, b], [-a, b]];
                corners.map(|[u, v]| [x + cos * u - sin * v, y + sin * u + cos * v]).into()
            }
            _ => {
                let corner = |k: usize| (std::f64::consts::TAU * k as f64 / 16.0).sin_cos();
                let reach = self.thing.reach_m();
                (0..16).map(corner).map(|(sin, cos)| [x + reach * cos, y + reach * sin]).collect()
            }
        }
    }

    /// True if two objects would overlap.
    fn meets(&self, other: &Placed) -> bool {
        const TOUCH_M: f64 = 0.003;
        let level = self.base_m < other.top_m() - 1e-6 && other.base_m < self.top_m() - 1e-6;
        let (a, b) = (self.footprint(), other.footprint());
        level && furthest(&a, &b) < TOUCH_M && furthest(&b, &a) < TOUCH_M
    }

    /// True if an object rests on the other's top with hardly any overhang.
    fn rests_on(&self, other: &Placed) -> bool {
        const OVER_M: f64 = 0.02;
        let own = self.footprint();
        let under = other.footprint();
        own.iter().all(|p| furthest(&under, std::slice::from_ref(p)) < OVER_M)
    }
}

/// Maximum separation of two outlines over the edge normals of the first (separating axis), metres.
fn furthest(of: &[[f64; 2]], other: &[[f64; 2]]) -> f64 {
    let edges = of.iter().zip(of.iter().cycle().skip(1));
    let beyond = |(a, b): (&[f64; 2], &[f64; 2])| {
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0].hypot(along[1]);
        let out = |p: &[f64; 2]| (along[1] * (p[0] - a[0]) - along[0] * (p[1] - a[1])) / length;
        other.iter().map(out).fold(f64::INFINITY, f64::min)
    };
    edges.map(beyond).fold(f64::NEG_INFINITY, f64::max)
}

/// Random object of a pile at a random place; flat boxes first.
fn drawn(placed: usize, draws: &mut Draws) -> Thing {
    const FLAT: usize = 7;
    let [x, y] = [0, 1].map(|_| HEAP_M * (2.0 * draws.next() - 1.0));
    let turn_rad = std::f64::consts::TAU * draws.next();
    let kind = draws.next();
    let mut size = |low: f64, high: f64| low + (high - low) * draws.next();
    match kind {
        k if placed < FLAT || k < 0.3 => {
            let half = [size(0.08, 0.17), size(0.06, 0.12)];
            Thing::Block { x, y, half, height: size(0.03, 0.08), turn_rad }
        }
        k if k < 0.65 => {
            let half = [size(0.03, 0.1), size(0.025, 0.06)];
            Thing::Block { x, y, half, height: size(0.08, 0.24), turn_rad }
        }
        k if k < 0.82 => Thing::Tin { x, y, radius: size(0.033, 0.05), height: size(0.06, 0.16) },
        k if k < 0.94 => {
            Thing::Cup { x, y, radius: size(0.035, 0.045), height: size(0.08, 0.12), handle_rad: None }
        }
        _ => {
            let scale = size(0.8, 1.1);
            Thing::Turned { x, y, knots: &BOWL, scale, open: true, handle_rad: None, spout: false }
        }
    }
}

impl Pile {
    /// Random pile of 12 to 20 objects; the table's border may be visible in every third.
    pub fn drawn(draws: &mut Draws) -> Pile {
        let half_m = if draws.next() < 0.33 { HALF_M } else { DESK_M };
        let count = 12 + (9.0 * draws.next()) as usize;
        let mut things: Vec<Placed> = Vec::new();
        for _ in 0..3000 {
            let thing = drawn(things.len(), draws);
            let fits = |placed: &Placed| !things.iter().any(|other| placed.meets(other));
            let tops = things.iter().filter(|under| matches!(under.thing, Thing::Block { .. }));
            let on_top = |under: &Placed| Placed { thing, base_m: under.top_m() };
            let stacked = tops.map(|under| (on_top(under), under)).filter(|(own, on)| own.rests_on(on));
            let on_table = std::iter::once(Placed { thing, base_m: 0.0 });
            let placed = on_table.chain(stacked.map(|(own, _)| own)).find(fits);
            things.extend(placed);
            if things.len() == count {
                break;
            }
        }
        Pile { things, half_m }
    }

    /// View of the paper's camera, cropped to the area dominated by objects. Labels: 10 the table,
    /// 0 the floor, and ten times the number for objects, from 2 on.
    pub fn look(&self, draws: &mut Draws) -> View {
        let angle = std::f64::consts::TAU * draws.next();
        let pose = on_ring(angle, 0.7 + 0.3 * draws.next(), super::TABLE_M + 0.5 + 0.4 * draws.next());
        let crops = [1.0, 0.9, 0.8, 0.7, 0.6];
        let camera = crops.into_iter().map(cropped).find(|camera| self.covers(camera, &pose) > COVERED);
        let device = Device { camera: camera.unwrap_or(cropped(0.6)), ..KINECT };
        let (mut view, labels) = device.see(|eye, ray| self.nearest(eye, ray), &pose, &pose, draws);
        view.cloud.labels = Some(labels);
        view
    }

    /// Distance along a ray to its hit, and the label of the hit.
    fn nearest(&self, eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<(f64, u32)> {
        let on_thing = (2..).zip(&self.things).filter_map(|(number, placed)| {
            let lowered = eye - Vector3::z() * placed.base_m;
            Some((meets(&placed.thing, &lowered, ray)?, 10 * number))
        });
        let below = bare(self.half_m, eye, ray);
        let on_table = eye.z + ray.z * below > super::TABLE_M - 1e-6;
        let below = (below, if on_table { 10 } else { 0 });
        let first = on_thing.fold(below, |best, hit| if hit.0 < best.0 { hit } else { best });
        first.0.is_finite().then_some(first)
    }

    /// Share of the image that shows objects.
    fn covers(&self, camera: &Intrinsics, pose: &Isometry3<f64>) -> f64 {
        const STEP: usize = 16;
        let eye = Point3::from(pose.translation.vector);
        let pixels = (0..camera.height)
            .step_by(STEP)
            .flat_map(|v| (0..camera.width).step_by(STEP).map(move |u| (u as f64, v as f64)));
        let is_thing = |(u, v): &(f64, f64)| {
            let ray = pose.rotation * camera.unproject(*u, *v, 1.0).coords;
            self.nearest(&eye, &ray).is_some_and(|(_, label)| label >= 20)
        };
        pixels.clone().filter(is_thing).count() as f64 / pixels.count().max(1) as f64
    }
}

/// Central crop of the camera's image, a share of each side.
fn cropped(share: f64) -> Intrinsics {
    let camera = KINECT.camera;
    let [width, height] = [camera.width, camera.height].map(|n| (n as f64 * share) as usize);
    let shift = |whole: usize, part: usize| (whole - part) as f64 / 2.0;
    let (cx, cy) = (camera.cx - shift(camera.width, width), camera.cy - shift(camera.height, height));
    Intrinsics { width, height, cx, cy, ..camera }
}
