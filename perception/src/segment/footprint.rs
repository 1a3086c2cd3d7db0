//! Extent and outline of points as seen from above.

use crate::polygon::{convex_hull, holds};
use nalgebra::Point3;

/// Maximum share of points outside an outline that counts as enclosing them: numerator and
/// denominator. From: chosen.
pub const OUTSIDE: (usize, usize) = (3, 10);

#[doc(hidden)]
pub fn middle(points: &[Point3<f64>]) -> [f64; 2] {
    let n = points.len().max(1) as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.x, y + p.y));
    [x / n, y / n]
}

/// Lowest and highest corner of the bounding box of points.
pub fn bounds(points: &[Point3<f64>]) -> (Point3<f64>, Point3<f64>) {
    let first = points.first().copied().unwrap_or_else(Point3::origin);
    let (mut low, mut high) = (first, first);
    for p in points {
        for k in 0..3 {
            low[k] = if p[k] < low[k] { p[k] } else { low[k] };
            high[k] = if p[k] > high[k] { p[k] } else { high[k] };
        }
    }
    (low, high)
}

/// Corners of the convex hull of points seen from above.
pub fn hull_from_above(points: &[Point3<f64>]) -> Vec<[f64; 2]> {
    convex_hull(points.iter().map(|p| [p.x, p.y]).collect())
}

/// True if a convex anticlockwise outline holds most of the places: all but [`OUTSIDE`].
pub fn most_within<T>(hull: &[[f64; 2]], of: &[T], place: impl Fn(&T) -> [f64; 2]) -> bool {
    let outside = of.iter().filter(|p| !holds(hull, place(p)));
    // The first that is too many settles it.
    outside.take(of.len() * OUTSIDE.0 / OUTSIDE.1 + 1).count() * OUTSIDE.1 <= of.len() * OUTSIDE.0
}
