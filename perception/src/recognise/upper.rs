//! What rays tell of a round body's upper end.

use super::body::Frustum;
use super::rays::{BEYOND, Rays, bounded, normal};

/// Chance that a view says nothing of an upper end, whatever it seems to show. From: chosen.
const BAD_VIEW: f64 = 0.002;

/// What is known of the upper end.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Upper {
    /// Log of how much likelier the views are if it is open.
    pub open_log: f64,
    /// Shares of the rays into it that met something below, and something at the rim's height.
    pub open: f64,
    pub lid: f64,
}

impl Upper {
    pub fn of(rays: &Rays, body: &Frustum) -> Upper {
        /// So near to the rim a ray does not tell, and what is no lower than the first is a lid, than the second no inside, metres. From: chosen.
        const RIM_M: f64 = 0.006;
        const INSIDE_M: f64 = 0.012;
        /// Spread of how high a lid is, metres. From: chosen.
        const LID_M: f64 = 0.004;
        /// A ray that falls less tells of no end. From: rounding.
        const LEVEL: f64 = 1e-3;
        /// What lies deeper than the body by this is not of it, metres. From: chosen.
        const BELOW_M: f64 = 0.02;
        /// Share of the rays into it that tell, and the density of what the others say. From: chosen.
        const TELL: f64 = 0.9;
        const REST: f64 = 0.02;
        /// No lid is deeper than this share of the least inside. From: chosen.
        const LID: f64 = 0.75;
        let height_m = body.top_m - body.base_m;
        let (mut all, mut open, mut lid, mut open_log) = (0.0, 0.0, 0.0, 0.0);
        for view in &rays.views {
            let mut sum = 0.0;
            for pixel in view.pixels.iter().filter(|p| !p.other && p.along[2] < -LEVEL) {
                let at_m = (body.top_m - view.from[2]) / pixel.along[2];
                let [x, y] = [body.x, body.y];
                let (dx, dy) =
                    (view.from[0] + at_m * pixel.along[0] - x, view.from[1] + at_m * pixel.along[1] - y);
                if dx.hypot(dy) > body.rim_m - RIM_M {
                    continue;
                }
                let (fall, sigma_m) = (-pixel.along[2], pixel.sigma_m.hypot(LID_M));
                let off_m = pixel.depth_m - at_m;
                if off_m < -BEYOND * sigma_m {
                    continue;
                }
                let within =
                    off_m * fall > INSIDE_M - 2.0 * pixel.sigma_m && off_m * fall < height_m + BELOW_M;
                let below = if within { fall / height_m } else { 0.0 };
                let level = normal(off_m, sigma_m);
                sum += ((TELL * below + REST) / (TELL * level + REST)).ln();
                all += view.looks;
                open += if off_m * fall > INSIDE_M { view.looks } else { 0.0 };
                lid += if off_m * fall < LID * INSIDE_M { view.looks } else { 0.0 };
            }
            let log = view.looks * sum;
            open_log += bounded(log, BAD_VIEW);
        }
        let share = |looks: f64| looks / f64::max(all, f64::MIN_POSITIVE);
        Upper { open_log, open: share(open), lid: share(lid) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::body::{Body, Ray};
    use super::super::rays::{Pixel, ViewRays};
    use super::*;

    /// A view of a body from above and aside, a pixel a step of a hundredth, as if every ray met just that; some share of them another thing.
    fn view(body: &Frustum, other: usize) -> Rays {
        let from = [0.8, 0.0, 0.7];
        let steps = (-12..=12).flat_map(|i| (-12..=12).map(move |j| (f64::from(i), f64::from(j))));
        let pixels = steps.enumerate().filter_map(|(k, (i, j))| {
            let along = [-1.0, 0.01 * i, -0.75 + 0.01 * j];
            let depth_m = body.depth_m(&Ray { from, along });
            depth_m.is_finite().then_some(Pixel {
                along,
                depth_m,
                sigma_m: 0.002,
                without: 1.0,
                other: k % 10 < other,
            })
        });
        let pixels = pixels.collect();
        Rays { views: vec![ViewRays { from, wander: [[0.0; 3]; 3], pixels, looks: 0.04 }] }
    }

    #[test]
    fn an_open_cup_a_tin_and_a_hidden_end_are_told_apart() {
        let cup = Frustum {
            x: 0.0,
            y: 0.0,
            base_m: 0.0,
            top_m: 0.1,
            foot_m: 0.035,
            rim_m: 0.04,
            wall_m: Some(0.003),
        };
        let tin = Frustum { wall_m: None, ..cup };
        let [open, closed] = [cup, tin].map(|body| Upper::of(&view(&body, 0), &body));
        assert!(open.open_log > 2.0 && open.open > 0.7 && open.lid < 0.2, "{open:?}");
        assert!(closed.open_log < -2.0 && closed.lid > 0.9 && closed.open == 0.0, "{closed:?}");
        let hidden = Upper::of(&view(&cup, 10), &cup);
        assert_eq!((hidden.open_log, hidden.open, hidden.lid), (0.0, 0.0, 0.0));
    }
}
