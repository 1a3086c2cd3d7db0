//! Step 4, first half: what the points of each view belong to, and which way is up.

use super::Step;
use super::joint::in_world;
use super::prepare::Prepared;
use crate::spread::tangents;
use crate::surface::{self, Outline};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use rustc_hash::FxHashMap;

/// A plane is dominant from this share of all points.
const DOMINANT: f64 = 0.06;
/// A plane is level if its normal is this near to up: the cosine of the angle between them.
const LEVEL: f64 = 0.95;
/// Between these heights above a surface lies what stands on it, metres.
const STANDING_M: (f64, f64) = (0.01, 0.5);
/// Side of the cells in which the outline of the surface is sought, metres.
const CELL_M: f64 = 0.05;
/// Fewest points of what stands on the surface in a view for these to decide where it belongs.
const FEWEST: usize = 60;

/// What a point of a view belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// A dominant plane.
    Plane,
    /// What stands on the surface that was measured best. These decide: they are what is looked at, and near. In a view that shows none
    /// of it all that is off the planes.
    Standing,
    /// Other things: farther off as a rule, where depth cameras bend the world.
    Around,
}

/// A dominant plane: `normal · p = offset_m`.
type Plane = (Vector3<f64>, f64);

/// Sorts the points of the used views, and tells which way is up.
pub(super) fn find(
    prepared: &[Prepared],
    used: &[bool],
    poses: &[Isometry3<f64>],
    up: Option<Unit<Vector3<f64>>>,
    steps: &mut Vec<Step>,
) -> (Vec<Vec<Part>>, Option<Unit<Vector3<f64>>>) {
    let places: Vec<Vec<Point3<f64>>> = (0..prepared.len())
        .map(|i| if used[i] { in_world(&prepared[i], &poses[i]) } else { Vec::new() })
        .collect();
    let planes = surface::dominant_planes(&places, prepared.iter().map(|p| p.sigmas_m.as_slice()), DOMINANT);
    let held: Vector3<f64> =
        poses.iter().zip(used).filter(|(_, u)| **u).map(|(p, _)| p.rotation * -Vector3::y()).sum();
    let held = up.or_else(|| Unit::try_new(held, 1e-6));
    let upright = planes.iter().find(|n| held.is_none_or(|up| n.0.dot(&up).abs() > 0.5));
    let up = upright.map(|(normal, _)| match held {
        Some(held) if held.dot(normal) < 0.0 => Unit::new_normalize(-normal),
        _ => Unit::new_normalize(*normal),
    });
    let lies_on = |(normal, offset_m): &Plane, i: usize, k: usize| {
        let near =
            (normal.dot(&places[i][k].coords) - offset_m).abs() < 3.0 * prepared[i].sigmas_m[k] + 0.006;
        near && normal.dot(&(poses[i].rotation * prepared[i].normals[k])).abs() > 0.8
    };
    let mut parts: Vec<Vec<Part>> = prepared.iter().map(|p| vec![Part::Standing; p.points.len()]).collect();
    for (i, places) in places.iter().enumerate() {
        for k in (0..places.len()).filter(|&k| planes.iter().any(|plane| lies_on(plane, i, k))) {
            parts[i][k] = Part::Plane;
        }
    }
    if let Some(surface) = up.and_then(|up| Standing::on(&planes, &up, &places, prepared, lies_on)) {
        parts.iter_mut().zip(&places).for_each(|(parts, places)| surface.part(parts, places));
    }
    let left = parts.iter().flatten().filter(|part| **part != Part::Plane).count();
    let result = format!("{} dominant planes removed", planes.len());
    steps.push(Step { name: "plane removal".to_owned(), points: left, result });
    (parts, up)
}

/// The level plane that was measured best, and its outline.
struct Standing {
    up: Vector3<f64>,
    offset_m: f64,
    outline: Outline,
}

impl Standing {
    fn on(
        planes: &[Plane],
        up: &Unit<Vector3<f64>>,
        places: &[Vec<Point3<f64>>],
        prepared: &[Prepared],
        lies_on: impl Fn(&Plane, usize, usize) -> bool,
    ) -> Option<Standing> {
        let on = |plane: &Plane| -> Vec<(usize, usize)> {
            let all = (0..places.len()).flat_map(|i| (0..places[i].len()).map(move |k| (i, k)));
            all.filter(|&(i, k)| lies_on(plane, i, k)).collect()
        };
        let known = |points: &[(usize, usize)]| -> f64 {
            points.iter().map(|&(i, k)| prepared[i].sigmas_m[k].powi(-2)).sum()
        };
        let level = planes.iter().filter(|(normal, _)| normal.dot(up).abs() > LEVEL);
        let (plane, points) =
            level.map(|plane| (plane, on(plane))).max_by(|a, b| known(&a.1).total_cmp(&known(&b.1)))?;
        let side = plane.0.dot(up).signum();
        let (up, offset_m) = (plane.0 * side, plane.1 * side);
        let (across, along) = tangents(&up);
        let mut cells = FxHashMap::default();
        for (i, k) in points {
            let p = &places[i][k].coords;
            *cells.entry([across, along].map(|axis| (axis.dot(p) / CELL_M).floor() as i32)).or_default() += 1;
        }
        let part = surface::largest_part(&cells);
        let corners = part.iter().flat_map(|&[x, y]| [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]);
        let hull =
            surface::convex_hull(corners.map(|corner| corner.map(|c| f64::from(c) * CELL_M)).collect());
        let corner = |&[x, y]: &[f64; 2]| Point3::from(across * x + along * y + up * offset_m);
        let hull: Vec<Point3<f64>> = hull.iter().map(corner).collect();
        Some(Standing { up, offset_m, outline: Outline::of(&hull, &up) })
    }

    fn holds(&self, p: &Point3<f64>) -> bool {
        let height = self.up.dot(&p.coords) - self.offset_m;
        height > STANDING_M.0 && height < STANDING_M.1 && self.outline.covers(p, 0.0)
    }

    /// Tells what stands on the surface from what is around, if a view shows enough of the first.
    fn part(&self, parts: &mut [Part], places: &[Point3<f64>]) {
        let around: Vec<usize> =
            (0..places.len()).filter(|&k| parts[k] == Part::Standing && !self.holds(&places[k])).collect();
        let off_planes = parts.iter().filter(|part| **part == Part::Standing).count();
        if off_planes - around.len() >= FEWEST {
            around.into_iter().for_each(|k| parts[k] = Part::Around);
        }
    }
}
