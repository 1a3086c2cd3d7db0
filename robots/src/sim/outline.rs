//! Outlines of objects seen from above, and gaps between them.

use nalgebra::{Isometry2, Isometry3, Point2, Translation3, UnitQuaternion, Vector2, Vector3};

/// Outline of an object on its surface, used for gaps between objects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    /// Disc around the origin.
    Disc {
        /// Radius, metres.
        radius_m: f64,
    },
    /// Rectangle around the origin, aligned with the axes.
    Rectangle {
        /// Half the sides, metres.
        half_m: [f64; 2],
    },
}

/// Upright pose in the map with the origin at a point.
pub(crate) fn upright(x_m: f64, y_m: f64, z_m: f64, yaw_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x_m, y_m, z_m),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad),
    )
}

/// Discs whose convex hull is the outline, as centre in the map and radius in metres: four corners of radius
/// zero, or one disc.
pub(crate) fn corners(outline: &Outline, at: &Isometry2<f64>) -> Vec<(Point2<f64>, f64)> {
    match *outline {
        Outline::Disc { radius_m } => vec![(at * Point2::origin(), radius_m)],
        Outline::Rectangle { half_m: [x, y] } => {
            [(-x, -y), (x, -y), (x, y), (-x, y)].iter().map(|&(x, y)| (at * Point2::new(x, y), 0.0)).collect()
        }
    }
}

/// Gap between two outlines, metres; zero or negative where they overlap. For two rectangles, a lower bound
/// by separating axes.
pub(crate) fn gap_between(a: &Outline, at_a: &Isometry2<f64>, b: &Outline, at_b: &Isometry2<f64>) -> f64 {
    match (a, b) {
        (Outline::Disc { radius_m: ra }, Outline::Disc { radius_m: rb }) => {
            (at_a.translation.vector - at_b.translation.vector).norm() - ra - rb
        }
        (Outline::Rectangle { half_m }, Outline::Disc { radius_m }) => {
            let p = at_a.inverse_transform_point(&(at_b * Point2::origin()));
            let (dx, dy) = (p.x.abs() - half_m[0], p.y.abs() - half_m[1]);
            if dx <= 0.0 && dy <= 0.0 {
                dx.max(dy) - radius_m
            } else {
                dx.max(0.0).hypot(dy.max(0.0)) - radius_m
            }
        }
        (Outline::Disc { .. }, Outline::Rectangle { .. }) => gap_between(b, at_b, a, at_a),
        (Outline::Rectangle { .. }, Outline::Rectangle { .. }) => {
            let (ca, cb) = (corners(a, at_a), corners(b, at_b));
            let axes = [at_a, at_b]
                .into_iter()
                .flat_map(|at| [at.rotation * Vector2::x(), at.rotation * Vector2::y()]);
            let spread = |points: &[(Point2<f64>, f64)], axis: &Vector2<f64>| {
                points
                    .iter()
                    .map(|(p, _)| p.coords.dot(axis))
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
            };
            axes.map(|axis| {
                let (a, b) = (spread(&ca, &axis), spread(&cb, &axis));
                (b.0 - a.1).max(a.0 - b.1)
            })
            .fold(f64::NEG_INFINITY, f64::max)
        }
    }
}
