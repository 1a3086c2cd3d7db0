//! Unobserved space above a surface, as points on a grid.

use descry_memory::space::Cell;
use descry_perception::nalgebra::{Point3, Vector3};

use super::policy::Look;
use crate::situation::Situation;
use crate::surface::KnownSurface;

/// Spacing of the grid points, metres.
const GRID_M: f64 = 0.05;
/// Height up to which space counts, metres: that of the tallest published object.
const HEIGHT_M: f64 = 0.28;

/// Number of unobserved grid points accepted by `counts` that a view would show past known occluders; 0
/// for a view without a camera pose.
pub(super) fn visible(situation: &Situation, look: &Look, counts: impl Fn(&Point3<f64>) -> bool) -> f64 {
    let Some(map_from_camera) = situation.camera(look.from, look.on) else { return 0.0 };
    let eye = Point3::from(map_from_camera.translation.vector);
    let shown = |p: &Point3<f64>| {
        situation.spaces[look.on].cell(p) == Cell::Unseen
            && counts(p)
            && situation.in_view(&map_from_camera, p)
            && situation.spaces[look.on].line_of_sight(&eye, p, &|_| false)
    };
    above(&situation.surfaces[look.on]).iter().filter(|p| shown(p)).count() as f64
}

/// Grid points above a surface, up to [`HEIGHT_M`]; map frame.
pub fn above(surface: &KnownSurface) -> Vec<Point3<f64>> {
    let Some(centre) = surface.centre() else { return Vec::new() };
    let helper = if surface.up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let e1 = surface.up.cross(&helper).normalize();
    let e2 = surface.up.cross(&e1);
    let reach_m = surface.outline.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max);
    let (steps, levels) = ((reach_m / GRID_M).ceil() as i64, (HEIGHT_M / GRID_M).ceil() as i64);
    let mut points = Vec::new();
    for i in -steps..=steps {
        for j in -steps..=steps {
            let foot = centre + (e1 * i as f64 + e2 * j as f64) * GRID_M;
            if covers(surface, &foot) {
                points.extend((0..levels).map(|l| foot + surface.up * (GRID_M * (l as f64 + 0.5))));
            }
        }
    }
    points
}

fn covers(surface: &KnownSurface, point: &Point3<f64>) -> bool {
    let n = surface.outline.len();
    let inside = |i: usize| {
        let (a, b) = (surface.outline[i], surface.outline[(i + 1) % n]);
        surface.up.cross(&(b - a)).dot(&(point - a)) >= 0.0
    };
    n >= 3 && (0..n).all(inside)
}
