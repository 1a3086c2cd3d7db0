//! Evidence of rays on a round body's upper end.

use super::body::{Body, Frustum, Ray};
use super::likelihood::log_sum;
use super::rays::{ViewRays, bounded, normal};
use super::verify::WALL_M;
use crate::noise::normal_cdf;
use crate::scale::{EDGE_M, PLACE_M, SPREADS};

/// Probability that a view is uninformative about an upper end. From: chosen.
const BAD_VIEW: f64 = 0.002;

/// Evidence of rays about a body's upper end.
#[derive(Clone, Copy, Debug, Default)]
pub struct Upper {
    /// Log likelihood ratio of an open against a closed end.
    pub open_log: f64,
    /// Share of the rays towards the upper end that met something below the rim's height; 0 without rays.
    pub open: f64,
    /// Share of the rays towards the upper end that met something at or above the rim's height; 0 without rays.
    pub lid: f64,
}

impl Upper {
    /// Evidence about the upper end from views of a body.
    pub fn of<'v>(views: impl IntoIterator<Item = &'v ViewRays>, body: &Frustum) -> Upper {
        /// Distance from the rim within which a ray is uninformative, metres. From: chosen.
        const RIM_M: f64 = 0.006;
        /// Minimum descent of a ray that tests an end, per metre of depth. From: rounding.
        const LEVEL: f64 = 1e-3;
        /// Share of informative rays into the end. From: chosen.
        const TELL: f64 = 0.9;
        /// Probability density of the depth of an uninformative ray, per metre. From: chosen.
        const REST: f64 = 0.02;
        /// Probability that a ray into an open body meets its wall or floor rather than contents.
        /// From: chosen.
        const EMPTY: f64 = 0.5;
        /// Depths of a lid below the apparent top, in standard deviations, equally likely: noise
        /// raises the top. From: derived, the highest but one in a hundred lies two spreads above
        /// the middle.
        const LOWER: [f64; 3] = [0.0, 1.0, 2.0];
        let hollow = Frustum { wall_m: Some(WALL_M), ..*body };
        let (mut all, mut open, mut lid, mut open_logs) = (0.0, 0.0, 0.0, [0.0; LOWER.len()]);
        for view in views {
            let mut sums = [0.0; LOWER.len()];
            for pixel in view.pixels.iter().filter(|p| !p.other && p.along[2] < -LEVEL) {
                let at_m = (body.top_m - view.from[2]) / pixel.along[2];
                let [x, y] = [body.x, body.y];
                let (dx, dy) =
                    (view.from[0] + at_m * pixel.along[0] - x, view.from[1] + at_m * pixel.along[1] - y);
                // What lies may be seen from behind its rim.
                if at_m < 0.0 || dx.hypot(dy) > body.rim_m - RIM_M {
                    continue;
                }
                let (fall, sigma_m) = (-pixel.along[2], pixel.sigma_m.hypot(EDGE_M));
                let off_m = pixel.depth_m - at_m;
                let deep_m = hollow.depth_m(&Ray { from: view.from, along: pixel.along }) - at_m;
                if off_m < -SPREADS * sigma_m || !(deep_m > 0.0 && deep_m.is_finite()) {
                    continue;
                }
                let on_the_way =
                    (normal_cdf(off_m / sigma_m) - normal_cdf((off_m - deep_m) / sigma_m)) / deep_m;
                let within = EMPTY * normal(off_m - deep_m, sigma_m) + (1.0 - EMPTY) * on_the_way;
                for (sum, lower) in sums.iter_mut().zip(LOWER) {
                    let level = normal(off_m - lower * pixel.sigma_m, sigma_m);
                    *sum += ((TELL * within + REST) / (TELL * level + REST)).ln();
                }
                if deep_m * fall < PLACE_M {
                    continue;
                }
                all += view.looks;
                open += if off_m * fall > PLACE_M { view.looks } else { 0.0 };
                lid += if off_m * fall < PLACE_M { view.looks } else { 0.0 };
            }
            for (log, sum) in open_logs.iter_mut().zip(sums) {
                *log += bounded(view.looks * sum, BAD_VIEW);
            }
        }
        let open_log = (LOWER.len() as f64).ln() - log_sum(&open_logs.map(|log| -log));
        let share = |looks: f64| looks / f64::max(all, f64::MIN_POSITIVE);
        Upper { open_log, open: share(open), lid: share(lid) }
    }
}
