//! Convex hull of points in a plane.

use crate::plane::Plane;
use crate::polygon::convex_hull;
use crate::spread::tangents;
use nalgebra::{Point2, Point3, Vector2, Vector3};

/// Convex polygon in a plane in space.
#[derive(Clone, Debug, PartialEq)]
pub struct Hull {
    /// Plane of the polygon.
    pub plane: Plane,
    /// Origin of the plane's coordinates.
    pub origin: Point3<f64>,
    /// First axis of the plane's coordinates, a unit vector.
    pub u: Vector3<f64>,
    /// Second axis, a unit vector; `u`, `v` and the normal are right-handed.
    pub v: Vector3<f64>,
    /// Corners in the plane's coordinates, metres, anticlockwise as seen from the side the normal points to; two for
    /// collinear points, one for coincident points.
    pub corners: Vec<Point2<f64>>,
}

impl Hull {
    /// Creates the convex hull of the finite points, projected along the normal; `None` without finite points.
    pub fn around<'a>(plane: Plane, points: impl IntoIterator<Item = &'a Point3<f32>>) -> Option<Hull> {
        let (u, v) = tangents(&plane.normal);
        let origin = Point3::from(plane.normal * plane.offset_m);
        let flat: Vec<Point2<f64>> = points
            .into_iter()
            .filter(|p| crate::cloud::is_finite(p))
            .map(|p| p.cast::<f64>() - origin)
            .map(|d| Point2::new(d.dot(&u), d.dot(&v)))
            .collect();
        (!flat.is_empty()).then(|| Hull { plane, origin, u, v, corners: convex(flat) })
    }

    /// Projection of a point onto the plane, in the plane's coordinates, metres.
    pub fn flatten(&self, p: &Point3<f64>) -> Point2<f64> {
        let d = p - self.origin;
        Point2::new(d.dot(&self.u), d.dot(&self.v))
    }

    /// Point in space with the given plane coordinates, metres.
    pub fn lift(&self, q: &Point2<f64>) -> Point3<f64> {
        self.origin + self.u * q.x + self.v * q.y
    }

    /// Corners of the polygon as points in space, metres.
    pub fn corners_in_space(&self) -> Vec<Point3<f64>> {
        self.corners.iter().map(|c| self.lift(c)).collect()
    }

    /// Distance of the projection of `p` from the border, metres: negative inside, positive outside.
    pub fn distance_m(&self, p: &Point3<f64>) -> f64 {
        let q = self.flatten(p);
        let mut inside = self.corners.len() > 2;
        let mut nearest = f64::INFINITY;
        for (a, b) in self.edges() {
            let (along, to) = (b - a, q - a);
            inside &= along.perp(&to) >= 0.0;
            let length_sq = along.norm_squared();
            let t = if length_sq > 0.0 { (to.dot(&along) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
            nearest = nearest.min((to - along * t).norm());
        }
        if inside { -nearest } else { nearest }
    }

    /// True if the projection of `p` lies in the polygon widened by `margin_m` (negative: shrunk).
    pub fn contains(&self, p: &Point3<f64>, margin_m: f64) -> bool {
        self.distance_m(p) <= margin_m
    }

    /// Area of the polygon, square metres.
    pub fn area_m2(&self) -> f64 {
        self.edges().map(|(a, b)| a.coords.perp(&b.coords)).sum::<f64>() / 2.0
    }

    /// Length of the border, metres.
    pub fn perimeter_m(&self) -> f64 {
        self.edges().map(|(a, b)| (b - a).norm()).sum()
    }

    /// Centroid of the polygon in plane coordinates, metres; mean of the corners if the area is zero.
    pub fn centre(&self) -> Point2<f64> {
        let first = self.corners.first().map_or(Vector2::zeros(), |c| c.coords);
        let (mut sum, mut twice_area) = (Vector2::zeros(), 0.0);
        for (a, b) in self.edges() {
            let (a, b) = (a.coords - first, b.coords - first);
            sum += (a + b) * a.perp(&b);
            twice_area += a.perp(&b);
        }
        if twice_area > 0.0 {
            return (first + sum / (3.0 * twice_area)).into();
        }
        let corners: Vector2<f64> = self.corners.iter().map(|c| c.coords).sum();
        (corners / self.corners.len().max(1) as f64).into()
    }

    fn edges(&self) -> impl Iterator<Item = (Point2<f64>, Point2<f64>)> {
        let n = self.corners.len();
        (0..n).map(move |i| (self.corners[i], self.corners[(i + 1) % n]))
    }
}

/// Corners of the convex hull of the finite points, anticlockwise, without points inside its edges.
pub fn convex(points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    let finite = points.iter().filter(|p| p.x.is_finite() && p.y.is_finite());
    convex_hull(finite.map(|p| [p.x, p.y]).collect()).into_iter().map(Point2::from).collect()
}
