//! Rays of one look at a level surface: those that hit the surface, and those that pass its edge.

use super::MapSurface;
use crate::camera::Intrinsics;
use crate::cloud::is_finite;
use crate::plane::Plane;
use crate::view::View;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

/// Rays of a look that are asked. From: chosen.
const ASKED: usize = 1200;
/// Maximum distance from the stated height at which the surface is looked for, metres. From: derived, depth
/// 10 % off at 1.2 m, and a little.
const BAND_M: f64 = 0.15;
/// Margin around the outline in which points of the surface may lie, metres. From: chosen.
const BESIDE_M: f64 = 0.4;
/// Maximum distance of the plane's points from the fitted plane, pass by pass, metres. From: chosen.
const NEAR_M: [f64; 5] = [0.04, 0.03, 0.02, 0.015, 0.012];
/// Depth below the plane from which a return was seen past the surface, metres. From: chosen, thicker than a
/// board is rough.
const PAST_M: f64 = 0.04;
/// Maximum distance between the two pixels on either side of a depth edge, pixels; more than one because returns are
/// missing beside edges. From: chosen.
const GAP_PX: usize = 4;
/// Minimum number of points for fitting a plane. From: chosen.
const FEWEST: usize = 40;
/// Minimum number of rays that say anything of the surface. From: chosen.
const FEWEST_RAYS: usize = 80;

/// Ray of a look, with its intersection with the surface plane in the optical frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub at: Vector3<f64>,
    /// True if the ray hit the surface; false if it passed.
    pub met: bool,
}

/// Rays of one look at the surface.
#[derive(Clone, Debug)]
pub(super) struct Sight {
    pub rays: Vec<Ray>,
    /// Points of the surface's edge, where neighbouring rays hit and pass, in the optical frame.
    pub edge: Vec<Vector3<f64>>,
    pub camera: Intrinsics,
    pub world_from_camera: Isometry3<f64>,
    pub sigma_m: f64,
    pub sigma_rad: f64,
}

impl Sight {
    /// Rays of a view at the surface with all depths divided by a factor; `None` if the view has no
    /// pixels, or too few on the surface.
    pub(super) fn of(
        view: &View,
        world_from_camera: &Isometry3<f64>,
        surface: &MapSurface,
        depth_times: f64,
    ) -> Option<Sight> {
        let image = Image::of(view, depth_times)?;
        let (columns, rows) = image.asked();
        let asked: Vec<Option<Point3<f64>>> = rows
            .iter()
            .flat_map(|&row| columns.iter().map(move |&column| (row, column)))
            .map(|at| image.point(at))
            .collect();
        let points: Vec<Point3<f64>> = asked.iter().flatten().copied().collect();
        let plane = plane(&points, world_from_camera, surface);
        let eye_m = -plane.offset_m;
        let is_near = |n: Option<usize>| {
            let asked = n.and_then(|n| asked.get(n).copied().flatten());
            asked.is_some_and(|p| plane.height_m(&p).abs() < NEAR_M[NEAR_M.len() - 1])
        };
        let ray = |(n, p): (usize, &Option<Point3<f64>>)| {
            let p = p.as_ref()?;
            let height_m = plane.height_m(p);
            let fall_m = eye_m - height_m;
            // Where a wall has the height of the surface, its points lie in the plane along a line alone.
            let beside = |step: usize| is_near(n.checked_sub(step)) || is_near(Some(n + step));
            let met = is_near(Some(n)) && beside(1) && beside(columns.len());
            let is_past = height_m < -PAST_M;
            ((met || is_past) && fall_m > 0.0).then(|| Ray { at: p.coords * (eye_m / fall_m), met })
        };
        let each: Vec<Option<Ray>> = asked.iter().enumerate().map(ray).collect();
        let met = |n: usize| each[n].map(|ray| ray.met);
        let pixel = |n: usize| (rows[n / columns.len()], columns[n % columns.len()]);
        let beside = |n: usize| {
            let right = (n % columns.len() + 1 < columns.len()).then_some(n + 1);
            let below = Some(n + columns.len()).filter(|&n| n < each.len());
            right.into_iter().chain(below).map(move |other| (n, other))
        };
        let ends = (0..each.len()).flat_map(beside).filter_map(|(a, b)| match (met(a)?, met(b)?) {
            (true, false) => Some((pixel(a), pixel(b))),
            (false, true) => Some((pixel(b), pixel(a))),
            _ => None,
        });
        let edge = ends.filter_map(|(from, to)| image.edge(from, to, &plane)).collect();
        let rays: Vec<Ray> = each.into_iter().flatten().collect();
        (eye_m > 0.0 && rays.len() >= FEWEST_RAYS).then(|| Sight {
            rays,
            edge,
            camera: image.camera,
            world_from_camera: *world_from_camera,
            sigma_m: view.pose_sigma_m.max(1e-3),
            sigma_rad: view.pose_sigma_rad.max(1e-3),
        })
    }
}

/// Points of a view by pixel, with all depths divided by a factor.
struct Image<'a> {
    camera: Intrinsics,
    width: usize,
    height: usize,
    points: &'a [Point3<f32>],
    depth_times: f64,
}

impl Image<'_> {
    fn of(view: &View, depth_times: f64) -> Option<Image<'_>> {
        let (camera, grid) = view.intrinsics.zip(view.cloud.grid)?;
        Some(Image {
            camera,
            width: grid.width,
            height: grid.height,
            points: &view.cloud.points,
            depth_times,
        })
    }

    /// Columns and rows of the asked pixels.
    fn asked(&self) -> (Vec<usize>, Vec<usize>) {
        let side = ((self.width * self.height) as f64 / ASKED as f64).sqrt().max(1.0) as usize;
        let each = |size: usize| (side / 2..size).step_by(side).collect();
        (each(self.width), each(self.height))
    }

    fn point(&self, (row, column): (usize, usize)) -> Option<Point3<f64>> {
        let point = self.points.get(row * self.width + column)?;
        is_finite(point).then(|| point.cast::<f64>() / self.depth_times)
    }

    /// Point of the surface's edge between a pixel on the surface and one past it, in one row or column: on the side of
    /// the board where that is seen, else in the plane; `None` where too many pixels between have no return.
    fn edge(&self, from: (usize, usize), to: (usize, usize), plane: &Plane) -> Option<Vector3<f64>> {
        let steps = from.0.abs_diff(to.0).max(from.1.abs_diff(to.1));
        let along = |a: usize, b: usize, n: usize| {
            if b >= a { a + (b - a) * n / steps } else { a - (a - b) * n / steps }
        };
        let points = (0..=steps).map(|n| self.point((along(from.0, to.0, n), along(from.1, to.1, n))));
        let heights: Vec<(usize, Point3<f64>, f64)> =
            points.enumerate().filter_map(|(n, p)| p.map(|p| (n, p, plane.height_m(&p)))).collect();
        let last = heights.iter().rposition(|(_, _, height_m)| height_m.abs() < NEAR_M[NEAR_M.len() - 1])?;
        let ((n, on, height_m), (next, past, past_m)) = (heights[last], *heights.get(last + 1)?);
        if next - n > GAP_PX || past_m > 0.0 {
            return None;
        }
        let in_plane =
            |p: &Point3<f64>, height_m: f64| p.coords * (plane.offset_m / (plane.offset_m + height_m));
        match past_m < -PAST_M {
            true => Some((in_plane(&on, height_m) + in_plane(&past, past_m)) / 2.0),
            false => Some(past.coords),
        }
    }
}

/// Surface plane as measured by one look, in the optical frame; the mapped plane if the look shows
/// too little.
fn plane(points: &[Point3<f64>], world_from_camera: &Isometry3<f64>, surface: &MapSurface) -> Plane {
    let up = world_from_camera.inverse_transform_vector(&Vector3::z());
    let stated_m = surface.height_m - world_from_camera.translation.z;
    let stated = Plane { normal: up, offset_m: stated_m };
    let (centre, reach_m) = (surface.centre(), surface.radius_m() + BESIDE_M);
    let is_near = |p: &&Point3<f64>| {
        let world = world_from_camera * **p;
        (world.z - surface.height_m).abs() < BAND_M && (world - centre).xy().norm() < reach_m
    };
    let near: Vec<Point3<f64>> = points.iter().filter(is_near).copied().collect();
    let Some(mode_m) = mode(near.iter().map(|p| stated.height_m(p))) else { return stated };
    let mut found = Plane { offset_m: stated_m + mode_m, ..stated };
    for near_m in NEAR_M {
        let on: Vec<&Point3<f64>> = near.iter().filter(|p| found.height_m(p).abs() < near_m).collect();
        match refit(&on, &found) {
            Some(plane) => found = plane,
            None => return stated,
        }
    }
    found
}

/// Most frequent height, in bins of 1 cm; `None` with too few points.
fn mode(heights_m: impl Iterator<Item = f64>) -> Option<f64> {
    const STEP_M: f64 = 0.01;
    let mut counts = vec![0_usize; (2.0 * BAND_M / STEP_M) as usize + 3];
    for height_m in heights_m {
        let step = ((height_m + BAND_M) / STEP_M).max(0.0) as usize + 1;
        if let Some(count) = counts.get_mut(step) {
            *count += 1;
        }
    }
    let most = (1..counts.len() - 1).max_by_key(|&n| counts[n - 1] + counts[n] + counts[n + 1])?;
    (counts[most - 1] + counts[most] + counts[most + 1] >= FEWEST)
        .then_some((most as f64 - 0.5) * STEP_M - BAND_M)
}

/// Least-squares plane by heights over an initial plane.
fn refit(points: &[&Point3<f64>], about: &Plane) -> Option<Plane> {
    if points.len() < FEWEST {
        return None;
    }
    let aside = if about.normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let e1 = about.normal.cross(&aside).normalize();
    let e2 = about.normal.cross(&e1);
    let mean = points.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords) / points.len() as f64;
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for p in points {
        let d = p.coords - mean;
        let row = Vector3::new(e1.dot(&d), e2.dot(&d), 1.0);
        normal += row * row.transpose();
        right += row * about.height_m(p);
    }
    let slope = normal.cholesky()?.solve(&right);
    let tilted = (about.normal - e1 * slope.x - e2 * slope.y).normalize();
    let middle = Point3::from(mean + about.normal * (slope.z - about.height_m(&Point3::from(mean))));
    Some(Plane::through(&middle, tilted))
}
