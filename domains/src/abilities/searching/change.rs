//! What somebody or something has moved voids what was seen of the place.

use descry_perception::View;
use descry_perception::nalgebra::{Point3, Vector3};
use serde::Serialize;

/// A place where something has moved: an upright cylinder.
#[derive(Debug, Clone, Serialize)]
pub struct Change {
    /// Until when what was seen there is void.
    pub stamp_ns: i64,
    /// The middle of its foot, in the map.
    pub foot: Point3<f64>,
    /// Its axis, a unit vector.
    pub up: Vector3<f64>,
    /// Of the cylinder, metres.
    pub radius_m: f64,
    /// Of the cylinder, metres.
    pub height_m: f64,
}

impl Change {
    /// Takes what a view shows of the place out of it, and what it saw through the place, as if the camera had no return there.
    pub fn blank(&self, view: &mut View) {
        let eye = Point3::from(view.world_from_camera.translation.vector);
        for p in view.cloud.points.iter_mut().filter(|p| p.x.is_finite()) {
            if self.is_crossed(&eye, &(view.world_from_camera * p.cast::<f64>())) {
                *p = Point3::new(f32::NAN, f32::NAN, f32::NAN);
            }
        }
    }

    /// Whether the way from one point to another leads through the cylinder.
    fn is_crossed(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        let split = |v: Vector3<f64>| (v.dot(&self.up), v - self.up * v.dot(&self.up));
        let (low, aside) = split(from - self.foot);
        let (rise, along) = split(to - from);
        // Where the way, seen from above, enters and leaves the circle, as shares of it.
        let (a, b) = (along.norm_squared(), aside.dot(&along));
        let root = b * b - a * (aside.norm_squared() - self.radius_m * self.radius_m);
        if root <= 0.0 || a <= 0.0 {
            return a <= 0.0 && aside.norm() < self.radius_m;
        }
        let (enters, leaves) = (((-b - root.sqrt()) / a).max(0.0), ((-b + root.sqrt()) / a).min(1.0));
        let heights = [enters, leaves].map(|share| low + rise * share);
        enters < leaves && heights[0].min(heights[1]) < self.height_m && heights[0].max(heights[1]) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_seen_of_a_changed_place_or_through_it_is_void() {
        let foot = Point3::new(1.0, 0.0, 0.7);
        let change = Change { stamp_ns: 0, foot, up: Vector3::z(), radius_m: 0.3, height_m: 0.2 };
        let eye = Point3::new(0.0, 0.0, 1.4);
        for (to, crossed, what) in [
            ((1.0, 0.0, 0.8), true, "within"),
            ((2.0, 0.0, 0.3), true, "through it to the floor behind"),
            ((1.0, 0.0, 0.7), true, "the table under it"),
            ((1.0, 0.5, 0.7), false, "the table beside it"),
            ((3.0, 0.0, 1.3), false, "over it"),
            ((0.5, 0.0, 0.9), false, "before it"),
            ((-1.0, 0.0, 0.7), false, "away from it"),
        ] {
            assert_eq!(change.is_crossed(&eye, &Point3::new(to.0, to.1, to.2)), crossed, "{what}");
        }
    }
}
