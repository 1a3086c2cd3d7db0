//! Free spots on a surface for an object.

use descry_memory::space::Cell;
use descry_perception::nalgebra::{Point3, Vector3};

use crate::situation::Situation;

/// Radius assumed for an unknown object, that of a cup with its handle, metres.
pub(super) const USUAL_RADIUS_M: f64 = 0.06;
/// Minimum gap to other objects and to the surface's edge, metres.
const GAP_M: f64 = 0.05;
/// Spacing of the candidate places, metres.
const GRID_M: f64 = 0.04;
/// Heights above the surface at which a place must be observed free, metres.
const FREE_AT_M: [f64; 2] = [0.04, 0.10];

/// Point on surface `on` for an object of `radius_m`, within reach from candidate `from` and nearest to
/// it; `None` if there is none. Its space was observed free or, with `if_unseen`, not observed at all.
pub(super) fn free(
    s: &Situation,
    from: usize,
    on: usize,
    radius_m: f64,
    if_unseen: bool,
) -> Option<Point3<f64>> {
    let surface = &s.surfaces[on];
    let centre = surface.centre()?;
    let helper = if surface.up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let e1 = surface.up.cross(&helper).normalize();
    let e2 = surface.up.cross(&e1);
    let widest = surface.outline.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max);
    let steps = (widest / GRID_M).ceil() as i64;
    let is_empty = |p: &Point3<f64>| {
        FREE_AT_M.iter().all(|h| match s.spaces[on].cell(&(p + surface.up * *h)) {
            Cell::Free => true,
            Cell::Unseen => if_unseen,
            Cell::Occupied => false,
        })
    };
    let around = |p: &Point3<f64>| {
        [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
            .map(|(a, b)| p + (e1 * a + e2 * b) * radius_m)
    };
    let is_apart = |p: &Point3<f64>| {
        s.on_surface(on).all(|t| {
            let own = 0.5 * t.size_m[0].max(t.size_m[1]);
            (t.position_m - p).norm() >= own + radius_m + GAP_M
        })
    };
    let near = |p: &Point3<f64>| s.distance_m(from, p).filter(|_| s.reaches(from, p));
    (-steps..=steps)
        .flat_map(|i| (-steps..=steps).map(move |j| (i, j)))
        .map(|(i, j)| centre + (e1 * i as f64 + e2 * j as f64) * GRID_M)
        .filter(|p| surface.covers(p, -(radius_m + GAP_M)))
        .filter(|p| is_apart(p) && around(p).iter().all(is_empty))
        .filter_map(|p| near(&p).map(|d| (d, p)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, p)| p)
}
