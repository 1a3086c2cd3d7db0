//! Bodies that a ray may meet: frusta, open or closed at the top, and boxes.

use crate::outline::Rectangle;
use crate::round::Round;

/// An upright cone frustum, closed or open at the top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// Axis position along x, surface frame, metres.
    pub x: f64,
    /// Axis position along y, surface frame, metres.
    pub y: f64,
    /// Height of the foot above the surface, metres.
    pub base_m: f64,
    /// Height of the rim above the surface, metres.
    pub top_m: f64,
    /// Radius at the foot, metres.
    pub foot_m: f64,
    /// Radius at the rim, metres.
    pub rim_m: f64,
    /// Thickness of the wall and floor of an open vessel, metres; `None` if closed at the top.
    pub wall_m: Option<f64>,
}

/// An upright box, rotated about the vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// Reference point of the box along x, surface frame, metres.
    pub x: f64,
    /// Reference point of the box along y, surface frame, metres.
    pub y: f64,
    /// Sine and cosine of the rotation about the vertical.
    pub turn: (f64, f64),
    /// Lowest corner: coordinates along the box's own axes from the reference point, then height
    /// above the surface, metres.
    pub low: [f64; 3],
    /// Highest corner: coordinates along the box's own axes from the reference point, then height
    /// above the surface, metres.
    pub high: [f64; 3],
}

/// A camera ray in the surface's frame.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin, metres.
    pub from: [f64; 3],
    /// Shift along the ray per metre of depth.
    pub along: [f64; 3],
}

/// A body whose surface a ray may hit.
pub trait Body {
    /// Minimum depth at which a ray hits the body, metres; infinite if it misses.
    fn depth_m(&self, ray: &Ray) -> f64;

    /// Body shifted by `shift_m` along x and y of the surface, metres.
    fn moved(&self, shift_m: [f64; 2]) -> Self;
}

impl Frustum {
    /// Closed frustum with the side of a fitted body between two heights, surface frame, metres.
    pub fn around(round: &Round, base_m: f64, top_m: f64) -> Frustum {
        let [foot_m, rim_m] = [base_m, top_m].map(|z| round.radius_at(z));
        Frustum { x: round.x, y: round.y, base_m, top_m, foot_m, rim_m, wall_m: None }
    }

    /// Both depths, ascending, at which a ray (origin relative to the foot's centre) crosses the
    /// infinite cone of the side, narrowed by `wall_m`; `None` if it misses.
    #[inline(always)]
    fn cone(&self, from: [f64; 3], [dx, dy, dz]: [f64; 3], wall_m: f64) -> Option<[f64; 2]> {
        /// Minimum height of a body, metres. From: rounding.
        const LEAST_M: f64 = 1e-3;
        let slope = (self.rim_m - self.foot_m) / (self.top_m - self.base_m).max(LEAST_M);
        let (radius, widens) = (self.foot_m - wall_m + slope * from[2], slope * dz);
        let a = dx * dx + dy * dy - widens * widens;
        let b = from[0] * dx + from[1] * dy - radius * widens;
        let c = from[0] * from[0] + from[1] * from[1] - radius * radius;
        let root = b * b - a * c;
        if root <= 0.0 || a == 0.0 {
            return None;
        }
        let (root, per) = (root.sqrt(), 1.0 / a);
        let ends = [(-b - root) * per, (-b + root) * per];
        Some(if a > 0.0 { ends } else { [ends[1], ends[0]] })
    }
}

impl Body for Frustum {
    fn moved(&self, [dx, dy]: [f64; 2]) -> Frustum {
        Frustum { x: self.x + dx, y: self.y + dy, ..*self }
    }

    #[inline(always)]
    fn depth_m(&self, ray: &Ray) -> f64 {
        let from = [ray.from[0] - self.x, ray.from[1] - self.y, ray.from[2] - self.base_m];
        let (height, [dx, dy, fall]) = (self.top_m - self.base_m, ray.along);
        let is_side = |at: &f64| *at > 0.0 && (0.0..=height).contains(&(from[2] + at * fall));
        let over = (height - from[2]) / fall;
        let (x, y) = (from[0] + over * dx, from[1] + over * dy);
        if fall >= 0.0 || over < 0.0 || x * x + y * y > self.rim_m * self.rim_m {
            if fall > 0.0 && from[2] < 0.0 {
                let foot = -from[2] / fall;
                let (x, y) = (from[0] + foot * dx, from[1] + foot * dy);
                if x * x + y * y < self.foot_m * self.foot_m {
                    return foot;
                }
            }
            let ends = self.cone(from, ray.along, 0.0);
            return ends.and_then(|ends| ends.into_iter().find(is_side)).unwrap_or(f64::INFINITY);
        }
        let Some(wall_m) = self.wall_m else { return over };
        let ends = self.cone(from, ray.along, wall_m).unwrap_or([f64::INFINITY; 2]);
        let back = ends.into_iter().filter(|at| *at > over).fold(f64::INFINITY, f64::min);
        back.min((wall_m - from[2]) / fall).max(over)
    }
}

impl Cuboid {
    /// Box over a rectangle between two heights, surface frame, metres.
    pub fn around(rectangle: &Rectangle, base_m: f64, top_m: f64) -> Cuboid {
        let [half_x, half_y] = rectangle.along_m.map(|side| 0.5 * side);
        Cuboid {
            x: rectangle.x,
            y: rectangle.y,
            turn: rectangle.turn,
            low: [-half_x, -half_y, base_m],
            high: [half_x, half_y, top_m],
        }
    }

    /// Box extended by `by_m` metres at one end: 0 and 1 are the ends of its first side, 2 and 3 of
    /// its second.
    pub fn longer(&self, end: usize, by_m: f64) -> Cuboid {
        let mut longer = *self;
        match end % 2 {
            0 => longer.low[end / 2] -= by_m,
            _ => longer.high[end / 2] += by_m,
        }
        longer
    }

    /// Length of the side that ends at `end` (0 to 3, as for [`Cuboid::longer`]), metres.
    pub fn length_m(&self, end: usize) -> f64 {
        self.high[end / 2] - self.low[end / 2]
    }

    /// Box rotated about the vertical through its reference point.
    pub fn turned(&self, by_rad: f64) -> Cuboid {
        let ((sin, cos), (sin_by, cos_by)) = (self.turn, by_rad.sin_cos());
        Cuboid { turn: (sin * cos_by + cos * sin_by, cos * cos_by - sin * sin_by), ..*self }
    }
}

impl Body for Cuboid {
    fn moved(&self, [dx, dy]: [f64; 2]) -> Cuboid {
        Cuboid { x: self.x + dx, y: self.y + dy, ..*self }
    }

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
