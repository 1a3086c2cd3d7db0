//! Step 4, first half: partition of each view's points, and the up direction.

use super::merged::Step;
use super::prepare::{Prepared, in_world};
use crate::polygon::convex_hull;
use crate::spread::{self, Moments, tangents};
use crate::surface::{self, Outline};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use rustc_hash::FxHashMap;

/// Minimum share of all points that lie on a dominant plane. From: chosen.
const DOMINANT: f64 = 0.06;
/// Minimum cosine between up and the normal of a level plane. From: chosen, about 18°.
const LEVEL: f64 = 0.95;
/// Minimum and maximum height of objects on a surface, metres. From: chosen.
const STANDING_M: (f64, f64) = (0.01, 0.5);
/// Cell size for the surface's outline, metres. From: chosen.
const CELL_M: f64 = 0.05;
/// Maximum distance of a point from a dominant plane: standard deviations, plus metres.
/// From: chosen.
const PLANE: (f64, f64) = (3.0, 0.006);
/// Minimum cosine between a point's normal and its plane's. From: chosen, about 37°.
pub(super) const PLANE_FACING: f64 = 0.8;
/// Minimum number of object points of a view, or of points off the planes in a view without
/// objects, that determine the view's pose. From: chosen.
pub(super) const FEWEST: usize = 60;

/// Part of the scene that a view's point belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// A dominant plane.
    Plane,
    /// Object on the best measured surface. These points decide the alignment, because they are
    /// near and of interest; in a view without any, all points off the planes.
    Standing,
    /// Other object, usually farther away, where depth cameras distort.
    Around,
}

/// A dominant plane: `normal · p = offset_m`.
pub(super) type Plane = (Vector3<f64>, f64);

/// Parts of the points of all views.
#[derive(Debug)]
pub(super) struct Parts {
    /// Part of each point, by view.
    pub of: Vec<Vec<Part>>,
    /// Dominant planes, world frame.
    pub planes: Vec<Plane>,
    /// Up direction, if determined.
    pub up: Option<Unit<Vector3<f64>>>,
    /// Surface that the objects stand on; `None` if no level plane was found.
    standing: Option<Standing>,
}

impl Parts {
    /// Parts of the points of a further view.
    pub fn of_view(&self, view: &Prepared, pose: &Isometry3<f64>) -> Vec<Part> {
        let seen: Vec<PlaneOfView> = self.planes.iter().map(|plane| PlaneOfView::of(plane, pose)).collect();
        let on_plane = |k: usize| seen.iter().any(|plane| plane.holds(view, k));
        let part = |k: usize| if on_plane(k) { Part::Plane } else { Part::Standing };
        let mut parts: Vec<Part> = (0..view.points.len()).map(part).collect();
        if let Some(surface) = &self.standing {
            surface.part(&mut parts, &in_world(view, pose));
        }
        parts
    }
}

/// Partitions the points of the used views, and determines the up direction.
pub(super) fn find(
    prepared: &[Prepared],
    used: &[bool],
    poses: &[Isometry3<f64>],
    up: Option<Unit<Vector3<f64>>>,
    steps: &mut Vec<Step>,
) -> Parts {
    /// Minimum length of the mean up direction; shorter ones cancel out. From: rounding.
    const CANCELLED: f64 = 1e-6;
    let places: Vec<Vec<Point3<f64>>> = (0..prepared.len())
        .map(|i| if used[i] { in_world(&prepared[i], &poses[i]) } else { Vec::new() })
        .collect();
    let of_views = places.iter().zip(prepared).flat_map(|(places, view)| places.iter().zip(&view.points));
    let of_views = of_views.map(|(place, point)| (*place, f64::from(point.sigma_m)));
    let total = places.iter().map(Vec::len).sum();
    let planes = surface::dominant_planes(of_views, total, DOMINANT);
    let held: Vector3<f64> =
        poses.iter().zip(used).filter(|(_, u)| **u).map(|(p, _)| p.rotation * -Vector3::y()).sum();
    let held = up.or_else(|| Unit::try_new(held, CANCELLED));
    let upright = planes.iter().find(|n| held.is_none_or(|up| n.0.dot(&up).abs() > 0.5));
    let up = upright.map(|(normal, _)| match held {
        Some(held) if held.dot(normal) < 0.0 => Unit::new_normalize(-normal),
        _ => Unit::new_normalize(*normal),
    });
    let seen: Vec<Vec<PlaneOfView>> =
        poses.iter().map(|pose| planes.iter().map(|plane| PlaneOfView::of(plane, pose)).collect()).collect();
    let mut parts: Vec<Vec<Part>> = prepared.iter().map(|p| vec![Part::Standing; p.points.len()]).collect();
    for (i, view) in prepared.iter().enumerate().filter(|(i, _)| used[*i]) {
        for k in (0..view.points.len()).filter(|&k| seen[i].iter().any(|plane| plane.holds(view, k))) {
            parts[i][k] = Part::Plane;
        }
    }
    let on = |plane: usize, (i, k): (usize, usize)| {
        parts[i][k] == Part::Plane && seen[i][plane].holds(&prepared[i], k)
    };
    let standing = up.and_then(|up| Standing::on(&planes, &up, &places, prepared, on));
    if let Some(surface) = &standing {
        parts.iter_mut().zip(&places).for_each(|(parts, places)| surface.part(parts, places));
    }
    let left = parts.iter().flatten().filter(|part| **part != Part::Plane).count();
    let result = format!("{} dominant planes removed", planes.len());
    steps.push(Step { name: "plane removal".to_owned(), points: left, result });
    Parts { of: parts, planes, up, standing }
}

/// Refits the level planes by least squares at the current poses.
pub(super) fn level_again(
    planes: &[Plane],
    up: Option<Unit<Vector3<f64>>>,
    prepared: &[Prepared],
    used: &[bool],
    parts: &[Vec<Part>],
    poses: &[Isometry3<f64>],
) -> Vec<Plane> {
    let again = |plane: &Plane| {
        let (normal, offset_m) = plane;
        let mut moments = Moments::about(&Point3::from(normal * *offset_m).cast());
        for (i, view) in prepared.iter().enumerate().filter(|(i, _)| used[*i]) {
            let seen = PlaneOfView::of(plane, &poses[i]);
            let (turn, shift) = (poses[i].rotation.to_rotation_matrix(), poses[i].translation.vector);
            for k in (0..view.points.len()).filter(|&k| parts[i][k] == Part::Plane && seen.holds(view, k)) {
                moments.add(&Point3::from(turn * view.points[k].at().coords + shift).cast());
            }
        }
        let least = Vector3::from(spread::least(&moments.covariance())?.normal);
        let least = if least.dot(normal) < 0.0 { -least } else { least };
        Some((least, least.dot(&moments.mean().coords)))
    };
    let is_level = |plane: &&Plane| up.is_some_and(|up| plane.0.dot(&up).abs() > LEVEL);
    planes.iter().filter(is_level).filter_map(again).collect()
}

/// A plane in the frame of a camera.
struct PlaneOfView {
    normal: Vector3<f64>,
    offset_m: f64,
}

impl PlaneOfView {
    fn of((normal, offset_m): &Plane, pose: &Isometry3<f64>) -> PlaneOfView {
        PlaneOfView {
            normal: pose.rotation.inverse() * normal,
            offset_m: offset_m - normal.dot(&pose.translation.vector),
        }
    }

    /// True if a point of the view lies on the plane with a similar normal.
    #[inline(always)]
    fn holds(&self, view: &Prepared, k: usize) -> bool {
        let near = PLANE.0 * f64::from(view.points[k].sigma_m) + PLANE.1;
        (self.normal.dot(&view.points[k].at().coords) - self.offset_m).abs() < near
            && self.normal.dot(&view.points[k].normal()).abs() > PLANE_FACING
    }
}

/// Best measured level plane, with its outline.
#[derive(Debug)]
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
        lies_on: impl Fn(usize, (usize, usize)) -> bool,
    ) -> Option<Standing> {
        let on = |plane: usize| -> Vec<(usize, usize)> {
            let all = (0..places.len()).flat_map(|i| (0..places[i].len()).map(move |k| (i, k)));
            all.filter(|&point| lies_on(plane, point)).collect()
        };
        let known = |points: &[(usize, usize)]| -> f64 {
            points.iter().map(|&(i, k)| f64::from(prepared[i].points[k].sigma_m).powi(-2)).sum()
        };
        let level = (0..planes.len()).filter(|&plane| planes[plane].0.dot(up).abs() > LEVEL);
        let (plane, points) = level
            .map(|plane| (&planes[plane], on(plane)))
            .max_by(|a, b| known(&a.1).total_cmp(&known(&b.1)))?;
        let side = plane.0.dot(up).signum();
        let (up, offset_m) = (plane.0 * side, plane.1 * side);
        let (across, along) = tangents(&up);
        let mut cells: FxHashMap<[i32; 2], u32> = FxHashMap::default();
        for (i, k) in points {
            let p = &places[i][k].coords;
            *cells.entry([across, along].map(|axis| surface::floor(axis.dot(p) / CELL_M))).or_default() += 1;
        }
        let part = surface::largest_part(cells.into_iter().collect());
        let corners = part.iter().flat_map(|&[x, y]| [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]);
        let hull = convex_hull(corners.map(|corner| corner.map(|c| f64::from(c) * CELL_M)).collect());
        let corner = |&[x, y]: &[f64; 2]| Point3::from(across * x + along * y + up * offset_m);
        let hull: Vec<Point3<f64>> = hull.iter().map(corner).collect();
        Some(Standing { up, offset_m, outline: Outline::of(&hull, &up) })
    }

    fn holds(&self, p: &Point3<f64>) -> bool {
        let height = self.up.dot(&p.coords) - self.offset_m;
        height > STANDING_M.0 && height < STANDING_M.1 && self.outline.covers(p, 0.0)
    }

    /// Marks points off the planes that do not stand on the surface as [`Part::Around`], if the
    /// view shows enough points that do.
    fn part(&self, parts: &mut [Part], places: &[Point3<f64>]) {
        let around: Vec<usize> =
            (0..places.len()).filter(|&k| parts[k] == Part::Standing && !self.holds(&places[k])).collect();
        let off_planes = parts.iter().filter(|part| **part == Part::Standing).count();
        if off_planes - around.len() >= FEWEST {
            around.into_iter().for_each(|k| parts[k] = Part::Around);
        }
    }
}
