//! Likelihood of the depths measured around a body, given the body.
//!
//! Each pixel shows the body, something nearer, the background, or is a stray return. The
//! likelihood of a body is that of all pixels together, relative to no body. Neighbouring pixels
//! have correlated errors, so each counts as a part of a measurement, and the evidence of a view
//! against a body is bounded, as the view may be a bad one.

use super::asker::{Asker, Lying};
use super::body::{Body, Ray};
use crate::noise::{CELL_PX, KINECT, Sensor};
use crate::round::distance;
use crate::scale::{EDGE_M, PLACE_M, SHAPE_M, SPREADS};
use crate::surface::floor;
use nalgebra::{Isometry3, Point3, Vector3};
use rustc_hash::FxHashSet;

/// Approximate number of pixels sampled per view to test whether a body exists. From: work.
pub(super) const PIXELS: f64 = 300.0;
/// Approximate number of pixels sampled per view to measure a body's extent. From: work.
pub const EDGE_PIXELS: f64 = 1200.0;
/// Probability that the return is from an occluder before the body. From: chosen.
const NEARER: f64 = 0.1;
/// Probability that the background is the surface. From: chosen.
const SURFACE: f64 = 0.6;
/// Probability that the background is another object. From: chosen.
const ELSE: f64 = 0.3;
/// Depth range over which another object is uniformly distributed, metres. From: chosen.
const ANYWHERE_M: f64 = 1.0;
/// Bound of the log likelihood ratio of one pixel. From: chosen.
pub(super) const MOST: f64 = 10.0;
/// Probability that a view is uninformative about a body. From: chosen.
pub(super) const BAD_VIEW: f64 = 0.05;
/// Maximum number of independent measurements that a block of pixels counts for: errors of the pose
/// are common to all. From: chosen.
const MOST_LOOKS: f64 = 2.3;
/// Offsets of a displaced ray, in standard deviations across the ray: columns and rows.
/// From: derived, three directions that balance each other.
const WANDER: [[f64; 2]; 3] = [[0.0, 1.0], [0.87, -0.5], [-0.87, -0.5]];

/// Pixels of all views that carry evidence about one body.
pub struct Rays {
    pub views: Vec<ViewRays>,
}

/// Pixels of one view.
pub struct ViewRays {
    /// Position of the camera, metres.
    pub from: [f64; 3],
    /// Shifts of a ray's direction by the lateral noise, in three balanced directions.
    pub wander: [[f64; 3]; 3],
    pub pixels: Vec<Pixel>,
    /// Number of independent measurements that each pixel counts for, at most 1.
    pub looks: f64,
}

/// A pixel with a return.
#[derive(Clone, Copy)]
pub struct Pixel {
    /// Shift along the ray per metre of depth.
    pub along: [f64; 3],
    /// Measured depth, metres.
    pub depth_m: f64,
    /// Standard deviation of the depth, metres.
    pub sigma_m: f64,
    /// Probability density of the depth without a body, per metre.
    pub without: f64,
    /// True if the pixel shows another object.
    pub other: bool,
}

/// Region whose pixels are evidence about a body; surface frame, metres.
pub struct Around {
    pub x: f64,
    pub y: f64,
    /// Half width of the region along x and y, metres.
    pub reach_m: f64,
    pub base_m: f64,
    pub top_m: f64,
    /// Approximate number of sampled pixels of a view.
    pub pixels: f64,
}

impl Rays {
    /// Pixels of the views around a place; `others`: points of other objects, `own`: those of the
    /// body, surface frame.
    pub fn of<'p>(
        asker: &Asker,
        sensor: &Sensor,
        around: &Around,
        own: &[Point3<f64>],
        others: impl Iterator<Item = &'p Point3<f64>>,
    ) -> Rays {
        let near = |p: &&Point3<f64>| {
            (p.x - around.x).abs() < around.reach_m && (p.y - around.y).abs() < around.reach_m
        };
        let mut other: FxHashSet<[i32; 2]> = others.filter(near).map(cell).collect();
        if !other.is_empty() {
            own.iter().for_each(|p| {
                other.remove(&cell(p));
            });
        }
        let view = |lying: &Lying| ViewRays::of(lying, sensor, around, &other);
        Rays { views: asker.views.iter().filter_map(view).collect() }
    }

    /// Rays transformed from the surface's frame to another.
    pub fn moved(&self, there_from_surface: &Isometry3<f64>) -> Rays {
        let turn = |way: &[f64; 3]| (there_from_surface.rotation * Vector3::from(*way)).into();
        let pixel = |pixel: &Pixel| Pixel { along: turn(&pixel.along), ..*pixel };
        let view = |view: &ViewRays| ViewRays {
            from: (there_from_surface * Point3::from(view.from)).into(),
            wander: view.wander.each_ref().map(turn),
            pixels: view.pixels.iter().map(pixel).collect(),
            looks: view.looks,
        };
        Rays { views: self.views.iter().map(view).collect() }
    }
}

/// Bounds the log likelihood ratio of a view that is uninformative with probability `bad`.
pub fn bounded(log: f64, bad: f64) -> f64 {
    let against = |log: f64| ((1.0 - bad) * log.exp() + bad).ln();
    if log < 0.0 { against(log) } else { -against(-log) }
}

fn cell(p: &Point3<f64>) -> [i32; 2] {
    [p.x, p.y].map(|m| floor(m / PLACE_M))
}

impl ViewRays {
    fn of(lying: &Lying, sensor: &Sensor, around: &Around, other: &FxHashSet<[i32; 2]>) -> Option<ViewRays> {
        let camera = &lying.map.intrinsics;
        let surface_from_camera = lying.surface_from_camera;
        let [columns, rows] = window(lying, &surface_from_camera.inverse(), around)?;
        let step = ((columns.len() * rows.len()) as f64 / around.pixels).sqrt().ceil().max(1.0) as usize;
        let from: [f64; 3] = surface_from_camera.translation.vector.into();
        let turn = surface_from_camera.rotation.to_rotation_matrix();
        let ray = |u: f64, v: f64| {
            turn * Vector3::new((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0)
        };
        let mut pixels = Vec::with_capacity(columns.len() * rows.len() / (step * step) + 1);
        for v in rows.step_by(step) {
            for u in columns.clone().step_by(step) {
                let depth_m = f64::from(lying.map.depths_m[v * camera.width + u]);
                if !depth_m.is_finite() {
                    continue;
                }
                let along: [f64; 3] = ray(u as f64, v as f64).into();
                let sigma_m = distance(sensor.frontal_sigma_m(depth_m), SHAPE_M);
                let p = Point3::from([0, 1, 2].map(|k: usize| from[k] + depth_m * along[k]));
                let behind_m = (around.base_m - from[2]) / along[2];
                let density = SURFACE * normal(depth_m - behind_m, sigma_m) + ELSE / ANYWHERE_M;
                let other = !other.is_empty() && other.contains(&cell(&p));
                pixels.push(Pixel { along, depth_m, sigma_m, without: density, other });
            }
        }
        let wander = WANDER.map(|[du, dv]| {
            let [du, dv] = [du / camera.fx, dv / camera.fy].map(|by| by * sensor.lateral_px);
            (turn * Vector3::new(du, dv, 0.0)).into()
        });
        let looks =
            (sensor.looks.min(MOST_LOOKS) * (step * step) as f64 / (CELL_PX * CELL_PX) as f64).min(1.0);
        (!pixels.is_empty()).then_some(ViewRays { from, wander, pixels, looks })
    }

    /// Log likelihood ratio of this view with a body against without, at the best common depth
    /// error.
    pub fn log_likelihood(&self, body: &impl Body) -> f64 {
        let mut met: Vec<f64> = Vec::with_capacity(self.pixels.len());
        let (mut sum, mut weight) = (0.0, 0.0);
        for pixel in &self.pixels {
            let at_m = body.depth_m(&Ray { from: self.from, along: pixel.along });
            let off_m = pixel.depth_m - at_m;
            if off_m.abs() < SPREADS * (pixel.sigma_m + EDGE_M) && !pixel.other {
                let w = self.looks / (pixel.sigma_m * pixel.sigma_m);
                (sum, weight) = (sum + w * off_m, weight + w);
            }
            met.push(at_m);
        }
        let shared_m = sum / (weight + EDGE_M.powi(-2));
        let bodies = self.pixels.iter().zip(met).filter(|(_, at_m)| at_m.is_finite());
        let ratios = bodies.map(|(pixel, at_m)| self.ratio(pixel, body, at_m, shared_m));
        self.looks * log_product(ratios) - 0.5 * (shared_m / EDGE_M).powi(2)
    }

    /// Likelihood ratio of a pixel's depth given a body at `at_m` against no body; a contradicting
    /// ray may have passed the body's edge.
    #[inline(always)]
    fn ratio(&self, pixel: &Pixel, body: &impl Body, at_m: f64, shared_m: f64) -> f64 {
        let mut with = pixel.with_body(at_m + shared_m);
        if with < pixel.without {
            let aside = self.wander.map(|by| {
                let along = [0, 1, 2].map(|k| pixel.along[k] + by[k]);
                match body.depth_m(&Ray { from: self.from, along }) {
                    at_m if at_m.is_finite() => pixel.with_body(at_m + shared_m),
                    _ => pixel.without,
                }
            });
            with = (with + aside.iter().sum::<f64>()) / (1.0 + aside.len() as f64);
        }
        with / pixel.without
    }
}

/// Log of a product of ratios, each clamped to e^±[`MOST`]; takes one logarithm for many ratios.
fn log_product(ratios: impl Iterator<Item = f64>) -> f64 {
    /// Exponent, in units of [`MOST`], beyond which one more factor could overflow a product.
    /// From: rounding.
    const WITHIN: f64 = 40.0;
    let (least, most) = ((-MOST).exp(), MOST.exp());
    let (low, high) = ((-WITHIN * MOST).exp(), (WITHIN * MOST).exp());
    let (mut log, mut product) = (0.0, 1.0_f64);
    for ratio in ratios {
        product *= ratio.clamp(least, most);
        if product < low || product > high {
            log += product.ln();
            product = 1.0;
        }
    }
    log + product.ln()
}

impl Pixel {
    /// Probability density of the measured depth given a body at depth `at_m`, per metre.
    #[inline(always)]
    pub fn with_body(&self, at_m: f64) -> f64 {
        /// Probability of a stray return. From: derived, the sensor's.
        const STRAY: f64 = KINECT.stray;
        /// Range of the error of a stray depth, metres. From: chosen.
        const RANGE_M: f64 = 5.0;
        let off_m = self.depth_m - at_m;
        let nearer = if off_m < 0.0 { NEARER / ANYWHERE_M } else { 0.0 };
        if self.other && off_m < SPREADS * self.sigma_m {
            return self.without;
        }
        (1.0 - NEARER - STRAY) * normal(off_m, self.sigma_m) + nearer + STRAY / RANGE_M
    }
}

/// Integral of a Gaussian of height and standard deviation 1. From: derived, the root of two pi.
pub(super) const BELL: f64 = 2.506_628_274_631_000_2;

#[inline(always)]
pub fn normal(off: f64, sigma: f64) -> f64 {
    /// Number of standard deviations beyond which the density is zero. From: rounding.
    const NONE: f64 = 6.0;
    let spreads = off / sigma;
    if spreads.abs() > NONE { 0.0 } else { (-0.5 * spreads * spreads).exp() / (sigma * BELL) }
}

/// Pixel window (columns and rows) of a region; `None` if out of view, or partly behind the camera.
fn window(
    lying: &Lying,
    camera_from_surface: &Isometry3<f64>,
    around: &Around,
) -> Option<[std::ops::Range<usize>; 2]> {
    let camera = &lying.map.intrinsics;
    let mut reach = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for corner in 0..8 {
        let side = |bit: usize| if corner >> bit & 1 == 0 { -around.reach_m } else { around.reach_m };
        let z = if corner >> 2 & 1 == 0 { around.base_m } else { around.top_m };
        let (u, v) = camera
            .project(&(camera_from_surface * Point3::new(around.x + side(0), around.y + side(1), z)))?;
        for (reach, at) in reach.iter_mut().zip([u, v]) {
            *reach = [reach[0].min(at), reach[1].max(at)];
        }
    }
    let sizes = [camera.width, camera.height];
    let mut ranges = reach.into_iter().zip(sizes).map(|([low, high], size)| {
        let within = |at: f64| at.clamp(0.0, size as f64) as usize;
        within(low.floor())..within(high.ceil() + 1.0)
    });
    Some([ranges.next()?, ranges.next()?])
}
