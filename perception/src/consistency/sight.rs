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
    pub camera: Intrinsics,
    pub world_from_camera: Isometry3<f64>,
    pub sigma_m: f64,
    pub sigma_rad: f64,
}

impl Sight {
    /// Rays of a view at the surface; `None` if the view has no pixels, or too few on the surface.
    pub(super) fn of(view: &View, world_from_camera: &Isometry3<f64>, surface: &MapSurface) -> Option<Sight> {
        let (camera, grid) = view.intrinsics.zip(view.cloud.grid)?;
        let side = ((grid.width * grid.height) as f64 / ASKED as f64).sqrt().max(1.0) as usize;
        let columns: Vec<usize> = (side / 2..grid.width).step_by(side).collect();
        let point = |row: usize, column: usize| {
            let point = view.cloud.points.get(row * grid.width + column)?;
            is_finite(point).then(|| point.cast())
        };
        let asked: Vec<Option<Point3<f64>>> = (side / 2..grid.height)
            .step_by(side)
            .flat_map(|row| columns.iter().map(move |&column| (row, column)))
            .map(|(row, column)| point(row, column))
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
        let rays: Vec<Ray> = asked.iter().enumerate().filter_map(ray).collect();
        (eye_m > 0.0 && rays.len() >= FEWEST_RAYS).then(|| Sight {
            rays,
            camera,
            world_from_camera: *world_from_camera,
            sigma_m: view.pose_sigma_m.max(1e-3),
            sigma_rad: view.pose_sigma_rad.max(1e-3),
        })
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
