//! Invalidates observed space around an object that was moved, by the body or by a person.

use descry_perception::View;
use descry_perception::nalgebra::{Point3, Vector3};
use serde::Serialize;

/// Place where an object has moved: an upright cylinder.
#[derive(Debug, Clone, Serialize)]
pub struct Change {
    /// Time before which observations of the place are invalid, nanoseconds.
    pub stamp_ns: i64,
    /// Centre of the foot, map frame.
    pub foot: Point3<f64>,
    /// Axis of the cylinder, a unit vector.
    pub up: Vector3<f64>,
    /// Radius of the cylinder, metres.
    pub radius_m: f64,
    /// Height of the cylinder, metres.
    pub height_m: f64,
}

impl Change {
    /// Blanks the returns of a view whose rays cross the place.
    pub fn blank(&self, view: &mut View) {
        let eye = Point3::from(view.world_from_camera.translation.vector);
        for p in view.cloud.points.iter_mut().filter(|p| p.x.is_finite()) {
            if self.is_crossed(&eye, &(view.world_from_camera * p.cast::<f64>())) {
                *p = Point3::new(f32::NAN, f32::NAN, f32::NAN);
            }
        }
    }

    /// True if a straight line between two points crosses the cylinder.
    pub fn is_crossed(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
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
