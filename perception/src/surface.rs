//! The surface that the objects stand on: its plane and its convex hull.

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};

/// A horizontal-enough face with its outline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Unit normal in the world, away from the side that carries the objects' weight: up.
    pub up: Unit<Vector3<f64>>,
    /// `up · p` of its points, metres.
    pub offset_m: f64,
    /// Convex outline in the world, anticlockwise seen from above, metres.
    pub hull: Vec<Point3<f64>>,
    /// Area of the outline, square metres.
    pub area_m2: f64,
    /// Points of the cloud that lie on it.
    pub points: usize,
    /// Root mean square distance of those points from the plane, metres.
    pub residual_m: f64,
    /// World to the surface's frame: z up with 0 on the surface, origin at the middle of the hull.
    pub surface_from_world: Isometry3<f64>,
}

impl Surface {
    /// Height of a point of the world above the plane, metres.
    pub fn height_m(&self, p: &Point3<f64>) -> f64 {
        self.up.dot(&p.coords) - self.offset_m
    }

    /// True if the point lies above or below the outline widened by `margin_m`.
    pub fn covers(&self, p: &Point3<f64>, margin_m: f64) -> bool {
        let n = self.hull.len();
        n >= 3
            && (0..n).all(|i| {
                let (a, b) = (self.hull[i], self.hull[(i + 1) % n]);
                let inward = self.up.cross(&(b - a));
                inward.dot(&(p - a)) >= -margin_m * inward.norm()
            })
    }
}
