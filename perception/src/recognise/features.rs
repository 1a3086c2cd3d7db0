//! What rays tell of a round body's handle and of its upper end.

use super::body::{Body, Cuboid, Frustum, Ray};
use super::rays::{self, Pixel, Rays, ViewRays, bounded, normal};

/// Headings at which a handle is looked for.
pub(super) const HEADINGS: usize = 24;
/// Where a handle is: how far out of the body, and between which shares of its height; half its width (set by hand, after mugs), metres.
const HANDLE_M: (f64, f64) = (0.006, 0.032);
const HANDLE_HEIGHTS: (f64, f64) = (0.2, 0.85);
const HALF_WIDTH_M: f64 = 0.007;
/// What views that lie beside each other leave of a side reaches from foot to rim, so far out, metres.
const BLUR_M: (f64, f64) = (0.006, 0.024);
const BLUR_HEIGHTS: (f64, f64) = (0.02, 0.98);
/// Share of such a place that a ray meets: a handle is a loop (set by hand).
const LOOP: f64 = 0.4;
/// Spread of where a ray meets it, metres.
const LOOP_M: f64 = 0.006;
/// Chance that what a view shows where a handle may be is neither for nor against one (set by hand).
const BAD_VIEW: f64 = 0.002;
/// All views together say no more than this of a handle at one heading.
const MOST: f64 = 20.0;
/// A heading at which less than this was said against a handle may hide one.
const HIDES: f64 = 1.0;

/// What is known of a handle: logs of how much likelier the views are with one, at any heading, and with what blurred views leave of a
/// side, than with neither.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grip {
    pub handle: f64,
    pub blur: f64,
    /// Headings at which one may hide.
    pub hides: [bool; HEADINGS],
    /// Number of the likeliest heading.
    pub heading: usize,
}

/// What is known of the upper end.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Upper {
    /// Log of how much likelier the views are if it is open.
    pub open_log: f64,
    /// Shares of the rays into it that met something below, and something at the rim's height.
    pub open: f64,
    pub lid: f64,
}

impl Default for Grip {
    fn default() -> Grip {
        Grip { handle: 0.0, blur: 0.0, hides: [true; HEADINGS], heading: 0 }
    }
}

impl Grip {
    pub fn of(rays: &Rays, body: &Frustum) -> Grip {
        let bodies: Vec<Vec<f64>> = rays.views.iter().map(|view| view.met(body)).collect();
        let logs = |reach_m: (f64, f64), heights: (f64, f64)| -> [f64; HEADINGS] {
            std::array::from_fn(|k| {
                let plate = plate(body, heading_rad(k), reach_m, heights);
                let each = rays.views.iter().zip(&bodies);
                each.map(|(view, met)| bounded(view.plate_log(&plate, met), BAD_VIEW))
                    .sum::<f64>()
                    .clamp(-MOST, MOST)
            })
        };
        let each = logs(HANDLE_M, HANDLE_HEIGHTS);
        let handle = mean(&each);
        let blur = if handle > 0.0 { mean(&logs(BLUR_M, BLUR_HEIGHTS)) } else { 0.0 };
        let heading = (0..HEADINGS).max_by(|&a, &b| each[a].total_cmp(&each[b])).unwrap_or_default();
        Grip { handle, blur, hides: each.map(|log| log > -HIDES), heading }
    }

    /// Share of the headings at which one may hide.
    pub fn unseen(&self) -> f64 {
        self.hides.iter().filter(|hides| **hides).count() as f64 / HEADINGS as f64
    }

    /// Log of how much likelier a handle is than none.
    pub fn log(&self) -> f64 {
        let [with, without] = self.logs();
        with - without
    }

    /// Logs of the likelihoods of what was seen with a handle and without.
    pub fn logs(&self) -> [f64; 2] {
        /// A handle that is there is missed in view now and then; something like one is none; views blur a side (set by hand).
        const MISSED: f64 = 0.04;
        const LIKE_ONE: f64 = 0.02;
        const BLURRED: f64 = 0.1;
        let handle = self.handle.exp();
        let with = MISSED + (1.0 - MISSED) * handle;
        let without = (1.0 - LIKE_ONE - BLURRED) + LIKE_ONE * handle + BLURRED * self.blur.exp();
        [with.ln(), without.ln()]
    }

    /// Whether a place lies at the likeliest heading of a body, outside of it.
    pub fn has(&self, body: &Frustum, x: f64, y: f64) -> bool {
        const CLEAR_M: f64 = 0.007;
        const HALF_M: f64 = 0.035;
        let (sin, cos) = heading_rad(self.heading).sin_cos();
        let (dx, dy) = (x - body.x, y - body.y);
        dx * cos + dy * sin > body.foot_m.min(body.rim_m)
            && (dy * cos - dx * sin).abs() < HALF_M
            && dx.hypot(dy) > body.foot_m.max(body.rim_m) + CLEAR_M
    }
}

fn heading_rad(k: usize) -> f64 {
    std::f64::consts::TAU * k as f64 / HEADINGS as f64
}

/// Log of the mean of what some logs are of.
fn mean(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + (logs.iter().map(|log| (log - most).exp()).sum::<f64>() / logs.len() as f64).ln()
}

/// The place of what sticks out of a body at a heading, between shares of its height.
fn plate(body: &Frustum, heading_rad: f64, (near_m, far_m): (f64, f64), (low, high): (f64, f64)) -> Cuboid {
    let height_m = body.top_m - body.base_m;
    let side_m = 0.5 * (body.foot_m + body.rim_m);
    Cuboid {
        x: body.x,
        y: body.y,
        turn: heading_rad.sin_cos(),
        low: [side_m + near_m, -HALF_WIDTH_M, body.base_m + low * height_m],
        high: [side_m + far_m, HALF_WIDTH_M, body.base_m + high * height_m],
    }
}

impl ViewRays {
    /// At which depth each pixel meets a body.
    fn met(&self, body: &Frustum) -> Vec<f64> {
        self.pixels.iter().map(|p| body.depth_m(&Ray { from: self.from, along: p.along })).collect()
    }

    /// Log of how much likelier the view is with something at a place beside a body that its pixels meet at some depths.
    fn plate_log(&self, plate: &Cuboid, bodies_m: &[f64]) -> f64 {
        let (sin, cos) = plate.turn;
        let out_m = 0.5 * (plate.low[0] + plate.high[0]);
        let (x, y) = (plate.x + out_m * cos - self.from[0], plate.y + out_m * sin - self.from[1]);
        let half_m = 0.5 * (plate.high[0] - plate.low[0]) + HALF_WIDTH_M;
        let mut sum = 0.0;
        for (pixel, &body_m) in self.pixels.iter().zip(bodies_m) {
            let [dx, dy, _] = pixel.along;
            // Seen from above, it passes by.
            if (x * dy - y * dx).powi(2) > half_m * half_m * (dx * dx + dy * dy) {
                continue;
            }
            let at_m = plate.depth_m(&Ray { from: self.from, along: pixel.along });
            if at_m < body_m {
                sum += pixel.loop_log(at_m, body_m);
            }
        }
        self.looks * sum
    }
}

impl Pixel {
    /// Log of how much likelier its depth is if it may meet a loop at a depth, and else a body at another or none.
    fn loop_log(&self, at_m: f64, body_m: f64) -> f64 {
        let sigma_m = self.sigma_m.hypot(LOOP_M);
        let off_m = self.depth_m - at_m;
        if off_m < -3.0 * sigma_m || (self.other && off_m < 3.0 * sigma_m) {
            return 0.0;
        }
        let without = if body_m.is_finite() { self.with_body(body_m) } else { self.without };
        let with = LOOP * normal(off_m, sigma_m) + (1.0 - LOOP) * without;
        (with / without).ln().clamp(-rays::MOST, rays::MOST)
    }
}

impl Upper {
    pub fn of(rays: &Rays, body: &Frustum) -> Upper {
        /// So near to the rim a ray does not tell, and what is no lower than the first is a lid, than the second no inside, metres.
        const RIM_M: f64 = 0.006;
        const INSIDE_M: f64 = 0.012;
        /// Spread of how high a lid is, metres.
        const LID_M: f64 = 0.004;
        let height_m = body.top_m - body.base_m;
        let (mut all, mut open, mut lid, mut open_log) = (0.0, 0.0, 0.0, 0.0);
        for view in &rays.views {
            let mut sum = 0.0;
            for pixel in view.pixels.iter().filter(|p| !p.other && p.along[2] < -1e-3) {
                let at_m = (body.top_m - view.from[2]) / pixel.along[2];
                let [x, y] = [body.x, body.y];
                let (dx, dy) =
                    (view.from[0] + at_m * pixel.along[0] - x, view.from[1] + at_m * pixel.along[1] - y);
                if dx.hypot(dy) > body.rim_m - RIM_M {
                    continue;
                }
                let (fall, sigma_m) = (-pixel.along[2], pixel.sigma_m.hypot(LID_M));
                let off_m = pixel.depth_m - at_m;
                if off_m < -3.0 * sigma_m {
                    continue;
                }
                let within = off_m * fall > INSIDE_M - 2.0 * pixel.sigma_m && off_m * fall < height_m + 0.02;
                let below = if within { fall / height_m } else { 0.0 };
                let rest = 0.02;
                let level = normal(off_m, sigma_m);
                sum += ((0.9 * below + rest) / (0.9 * level + rest)).ln();
                all += view.looks;
                open += if off_m * fall > INSIDE_M { view.looks } else { 0.0 };
                lid += if off_m * fall < 0.75 * INSIDE_M { view.looks } else { 0.0 };
            }
            let log = view.looks * sum;
            open_log += bounded(log, rays::BAD_VIEW);
        }
        let share = |looks: f64| looks / f64::max(all, 1e-9);
        Upper { open_log, open: share(open), lid: share(lid) }
    }
}
