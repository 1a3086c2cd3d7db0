//! Tests whether points lie above or below a surface's outline.

use super::level::Surface;
use nalgebra::{Point3, Vector3};

/// Half spaces whose intersection is the region above and below a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Unit normals into the surface, with the edges' offsets along them, metres.
    edges: Vec<(Vector3<f64>, f64)>,
}

impl Outline {
    /// Outline of a convex region with anticlockwise corners, seen from above.
    pub(crate) fn of(hull: &[Point3<f64>], up: &Vector3<f64>) -> Outline {
        let n = hull.len();
        let edge = |i: usize| {
            let (a, b) = (hull[i], hull[(i + 1) % n]);
            let inward = up.cross(&(b - a)).try_normalize(0.0)?;
            Some((inward, inward.dot(&a.coords)))
        };
        Outline { edges: if n < 3 { Vec::new() } else { (0..n).filter_map(edge).collect() } }
    }

    /// True if the point (in the hull's frame) lies above or below the outline widened by
    /// `margin_m`.
    pub fn covers(&self, p: &Point3<f64>, margin_m: f64) -> bool {
        self.edges.len() >= 3 && self.edges.iter().all(|(n, edge)| n.dot(&p.coords) - edge >= -margin_m)
    }
}

/// Outline as rows in the surface's frame, which decides most points without testing every edge.
pub struct Rows {
    outline: Outline,
    low_m: f64,
    rows: Vec<Row>,
}

/// Row of an outline, as intervals along x.
struct Row {
    /// Interval that is certainly covered, metres.
    inside: (f64, f64),
    /// Interval that is possibly covered, metres.
    around: (f64, f64),
}

/// Width of a row, metres. From: work.
const ROW_M: f64 = 0.01;
/// Distance from an edge within which the edge itself decides, metres. From: rounding.
const ROUNDING_M: f64 = 1e-6;

impl Rows {
    pub fn of(surface: &Surface) -> Rows {
        let outline = surface.outline();
        let hull: Vec<Point3<f64>> = surface.hull.iter().map(|p| surface.surface_from_world * p).collect();
        let flat = Outline::of(&hull, &Vector3::z());
        let ys = || hull.iter().map(|p| p.y);
        let low_m = ys().fold(f64::INFINITY, f64::min) - ROW_M;
        let width_m = ys().fold(f64::NEG_INFINITY, f64::max) + ROW_M - low_m;
        let count = if flat.edges.len() < 3 { 0 } else { (width_m / ROW_M).ceil() as usize };
        let row = |i: usize| Row::of(&flat, [i, i + 1].map(|end| low_m + end as f64 * ROW_M));
        Rows { outline, low_m, rows: (0..count).map(row).collect() }
    }

    /// True if a point, projected along the surface's normal, lies within the outline; `flat` is the
    /// point in the surface's frame, `place` the same point in the world frame, metres.
    #[inline(always)]
    pub fn covers(&self, flat: &Point3<f64>, place: &Point3<f64>) -> bool {
        let row = (flat.y - self.low_m) * (1.0 / ROW_M);
        if row < 0.0 {
            return false;
        }
        let Some(row) = self.rows.get(row as usize) else { return false };
        let within = |(from, to): (f64, f64)| flat.x > from && flat.x < to;
        within(row.inside) || within(row.around) && self.outline.covers(place, 0.0)
    }
}

impl Row {
    fn of(flat: &Outline, ends_m: [f64; 2]) -> Row {
        /// An edge is parallel to the row if its normal's component along the row is at most this.
        /// From: rounding.
        const ALONG: f64 = 1e-9;
        let everywhere = (f64::NEG_INFINITY, f64::INFINITY);
        let mut row = Row { inside: everywhere, around: everywhere };
        for (normal, edge) in &flat.edges {
            let [one, other] = ends_m.map(|y| (edge - normal.y * y) / normal.x);
            let (less, more) = (one.min(other), one.max(other));
            if normal.x.abs() < ALONG {
                // Along the row: what is nearer than the row's width is left to the edge itself.
                let clear = ends_m.iter().all(|y| normal.y * y - edge > ROUNDING_M);
                row.inside = if clear { row.inside } else { (0.0, 0.0) };
            } else if normal.x > 0.0 {
                row.inside.0 = row.inside.0.max(more + ROUNDING_M);
                row.around.0 = row.around.0.max(less - ROUNDING_M);
            } else {
                row.inside.1 = row.inside.1.min(less - ROUNDING_M);
                row.around.1 = row.around.1.min(more + ROUNDING_M);
            }
        }
        row
    }
}
