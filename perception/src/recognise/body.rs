//! Bodies that a ray may meet: upright frusta, open or closed, and boxes.

use crate::round::Round;

/// An upright frustum; metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frustum {
    /// Axis, surface frame.
    pub x: f64,
    pub y: f64,
    /// Height of its foot and of its rim above the surface.
    pub base_m: f64,
    pub top_m: f64,
    /// Radius at both.
    pub foot_m: f64,
    pub rim_m: f64,
    /// Thickness of wall and floor; none if it is closed.
    pub wall_m: Option<f64>,
}

/// An upright box; metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cuboid {
    /// What its sides are told from, surface frame.
    pub x: f64,
    pub y: f64,
    /// Sine and cosine of the angle by which it is turned.
    pub turn: (f64, f64),
    /// Least and greatest place along its own axes and height.
    pub low: [f64; 3],
    pub high: [f64; 3],
}

/// A ray: where it begins, and how far it comes for each metre of depth; surface frame, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub from: [f64; 3],
    pub along: [f64; 3],
}

/// What a ray can meet.
pub(super) trait Body {
    /// The least depth at which a ray meets it, infinite if it passes by, metres.
    fn depth_m(&self, ray: &Ray) -> f64;
}

impl Frustum {
    /// The closed frustum whose side was fitted, between two heights.
    pub fn around(round: &Round, base_m: f64, top_m: f64) -> Frustum {
        let [foot_m, rim_m] = [base_m, top_m].map(|z| round.radius_at(z));
        Frustum { x: round.x, y: round.y, base_m, top_m, foot_m, rim_m, wall_m: None }
    }

    /// The depths at which a ray enters and leaves the infinite cone about its side, drawn in by `wall_m`.
    #[inline(always)]
    fn cone(&self, from: [f64; 3], [dx, dy, dz]: [f64; 3], wall_m: f64) -> Option<[f64; 2]> {
        /// Nothing is lower, metres. From: rounding.
        const LEAST_M: f64 = 1e-3;
        let slope = (self.rim_m - self.foot_m) / (self.top_m - self.base_m).max(LEAST_M);
        let (radius, widens) = (self.foot_m - wall_m + slope * from[2], slope * dz);
        let a = dx * dx + dy * dy - widens * widens;
        let b = from[0] * dx + from[1] * dy - radius * widens;
        let root = b * b - a * (from[0] * from[0] + from[1] * from[1] - radius * radius);
        (root > 0.0 && a > 0.0).then(|| [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a])
    }
}

impl Body for Frustum {
    fn depth_m(&self, ray: &Ray) -> f64 {
        let from = [ray.from[0] - self.x, ray.from[1] - self.y, ray.from[2] - self.base_m];
        let (height, fall) = (self.top_m - self.base_m, ray.along[2]);
        let Some([enters, leaves]) = self.cone(from, ray.along, 0.0) else { return f64::INFINITY };
        let at = from[2] + enters * fall;
        if (0.0..=height).contains(&at) {
            return enters;
        }
        let over = (height - from[2]) / fall;
        if at < height || fall >= 0.0 || over > leaves {
            return f64::INFINITY;
        }
        let Some(wall_m) = self.wall_m else { return over };
        let back = self.cone(from, ray.along, wall_m).map_or(leaves, |[_, leaves]| leaves);
        back.min((wall_m - from[2]) / fall).max(over)
    }
}

impl Body for Cuboid {
    fn depth_m(&self, ray: &Ray) -> f64 {
        let (sin, cos) = self.turn;
        let own = |x: f64, y: f64, z: f64| [cos * x + sin * y, cos * y - sin * x, z];
        let from = own(ray.from[0] - self.x, ray.from[1] - self.y, ray.from[2]);
        let along = own(ray.along[0], ray.along[1], ray.along[2]);
        let (mut enters, mut leaves) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            let (a, b) = ((self.low[k] - from[k]) / along[k], (self.high[k] - from[k]) / along[k]);
            enters = enters.max(a.min(b));
            leaves = leaves.min(a.max(b));
        }
        if enters < leaves { enters } else { f64::INFINITY }
    }
}
