//! Role of a level surface: floor or support.
//!
//! A camera that looks past the edge of a table sees what lies lower. Past the floor nothing lies lower: where it ends in an image, the image
//! ends, something stands before it or a wall rises from it.

use super::extent::TALLEST_M;
use super::level::{Overhang, Role, Sign, Surface};
use super::options::SurfaceOptions;
use super::sample::Sample;
use crate::pool;
use crate::scale::APART_M;
use crate::visibility::Visibility;
use nalgebra::{Point3, Unit, Vector3};

/// Share that counts as most: numerator and denominator. From: chosen.
const MOST: (usize, usize) = (7, 10);
/// Approximate number of rays used of each camera. From: chosen.
const RAYS: usize = 5000;
/// Distance below a surface from which returns count as lower, metres. From: chosen.
const LOWER_M: f64 = 0.06;
/// Growth of `LOWER_M` with the distance from the surface's middle, metres per metre: sensors bend
/// distant surfaces. From: chosen.
const LOWER_PER_M: f64 = 0.03;
/// Minimum number of rays past the edge; fewer are an accident. From: chosen.
const PAST_RAYS: usize = 15;
/// Minimum share of all returning rays that pass the edge; fewer are an accident. From: chosen.
const PAST_SHARE: f64 = 0.005;
/// Minimum cosine between the normals of parallel surfaces, that of 8 degrees. From: chosen.
const PARALLEL: f64 = 0.99;
/// Margin around an object's outline within which its support must be seen, metres. From: chosen.
const AROUND_M: f64 = 0.1;
/// Minimum number of rays that hit the support within [`AROUND_M`]. From: chosen.
const AROUND_RAYS: usize = 5;
/// Maximum distance from the support's plane of a ray that hits it, metres. From: chosen.
const LEVEL_M: f64 = 0.012;
/// Minimum and maximum height of an object's top above its support (on the floor: of a step),
/// metres. From: chosen.
const THING_M: (f64, f64) = (0.015, 0.3);
/// Minimum number of samples seen beneath a raised surface, such as a table top. From: chosen.
const BENEATH: usize = 15;
/// Minimum distances of samples beneath a surface: within its outline, and below it, metres.
/// From: chosen.
const BENEATH_M: (f64, f64) = (0.05, 0.08);
/// Width below which a surface is a rail or the top of a wall, metres. From: chosen.
const NARROW_M: f64 = 0.12;
/// Minimum mean height of the cameras above a surface that may be the floor, metres. From: chosen.
const EYE_M: f64 = 0.8;
/// Minimum height of a supporting surface above the floor, metres. From: chosen.
const UNDER_M: f64 = 0.25;
/// Minimum extent of the visible floor if something stands on the floor, metres. From: chosen.
const REACH_M: f64 = 1.2;
/// Minimum area of the visible floor if nothing stands on the floor, square metres. From: chosen.
const WIDE_M2: f64 = 2.5;
/// Maximum extent of a requested height band that can only mean tables, metres. From: chosen.
const TELLING_M: f64 = 1.0;

/// Origin of a ray, if known, and its return.
pub(super) struct Ray {
    eye: Option<Point3<f64>>,
    end: Point3<f64>,
}

/// Determines the role of each surface and its height above the floor.
pub(super) fn tell(
    surfaces: &mut [Surface],
    samples: &[Sample],
    rays: &[Ray],
    seen: &Visibility,
    up: Option<&Unit<Vector3<f64>>>,
    options: &SurfaceOptions,
) {
    let level = level(surfaces, up);
    let told_by = |s: &Surface| (past(s, rays), s.is_open_beneath(samples));
    let (past, open): (Vec<Option<f64>>, Vec<bool>) = pool::map(surfaces, 1, told_by).into_iter().unzip();
    let supports = |n| supports(n, surfaces, &level, (&past, &open), rays);
    let told = pool::each(surfaces.len(), 1, supports);
    assign(surfaces, told);
    let eyes = seen.viewpoints();
    let mirrored: Vec<bool> = (0..surfaces.len()).map(|n| is_mirrored(n, surfaces, &eyes)).collect();
    for (surface, _) in surfaces.iter_mut().zip(mirrored).filter(|(_, mirrored)| *mirrored) {
        (surface.role, surface.because) = (Role::Other, Sign::Mirrored);
    }
    let told: Vec<(Role, Sign)> = surfaces.iter().map(|s| lowest(s, surfaces, &eyes)).collect();
    assign(surfaces, told);
    let told: Vec<(Role, Sign)> = surfaces.iter().map(|s| level_with_floor(s, surfaces)).collect();
    assign(surfaces, told);
    let ground = surfaces.iter().filter(|s| s.role == Role::Floor).max_by_key(|s| s.points).cloned();
    let is_board =
        |(s, open): &(&Surface, &bool)| s.role == Role::Support && s.residual_m < APART_M && **open;
    let boards: Vec<&Surface> = surfaces.iter().zip(&open).filter(is_board).map(|(s, _)| s).collect();
    let over: Vec<Vec<Overhang>> = surfaces.iter().map(|s| over(s, &boards)).collect();
    for (surface, over) in surfaces.iter_mut().zip(over) {
        surface.above_floor_m = ground.as_ref().map(|floor| floor.height_m(&surface.middle()));
        surface.over = over;
        let band = options.height_band_m.filter(|_| options.wants(surface));
        let is_telling = |(low, high): (f64, f64)| surface.role == Role::Untold || high - low <= TELLING_M;
        if matches!(surface.role, Role::Untold | Role::Floor) && band.is_some_and(is_telling) {
            (surface.role, surface.because) = (Role::Support, Sign::Asked);
        }
    }
}

fn assign(surfaces: &mut [Surface], told: Vec<(Role, Sign)>) {
    for (surface, told) in surfaces.iter_mut().zip(told) {
        (surface.role, surface.because) = told;
    }
}

/// Up direction of the group of parallel surfaces with the most returns; surfaces that lean away
/// from the hint count less.
fn level(surfaces: &[Surface], hint: Option<&Unit<Vector3<f64>>>) -> Unit<Vector3<f64>> {
    let upright = |s: &Surface| hint.map_or(1.0, |up| up.dot(&s.up).powi(2));
    let returns = |s: &Surface| -> f64 {
        let parallel = surfaces.iter().filter(|other| other.is_parallel(s));
        parallel.map(|other| other.points as f64).sum::<f64>() * upright(s)
    };
    let best = surfaces.iter().rev().max_by(|a, b| returns(a).total_cmp(&returns(b)));
    best.map_or(Vector3::z_axis(), |s| s.up)
}

/// Some returns of each camera; without cameras the points themselves.
pub(super) fn rays(samples: &[Sample], seen: &Visibility) -> Vec<Ray> {
    let mut rays = Vec::new();
    for map in &seen.maps {
        let (camera, eye) = (map.intrinsics, map.viewpoint());
        let world_from_camera = map.camera_from_world.inverse();
        let step = ((camera.width * camera.height) as f64 / RAYS as f64).sqrt().ceil().max(1.0) as usize;
        for row in (step / 2..camera.height).step_by(step) {
            for column in (step / 2..camera.width).step_by(step) {
                let depth_m = f64::from(map.depths_m[row * camera.width + column]);
                if depth_m.is_finite() {
                    let end = world_from_camera * camera.unproject(column as f64, row as f64, depth_m);
                    rays.push(Ray { eye: Some(eye), end });
                }
            }
        }
    }
    if seen.maps.is_empty() {
        rays.extend(samples.iter().map(|s| Ray { eye: None, end: s.point }));
    }
    rays
}

/// Share of the returns below a surface, past its edge; `None` if it may be accidental.
///
/// What is seen lower *through* a surface is a reflection in it.
fn past(surface: &Surface, rays: &[Ray]) -> Option<f64> {
    let (outline, middle) = (surface.outline(), surface.middle());
    let is_past = |ray: &&Ray| {
        let low = surface.height_m(&ray.end);
        if low > -LOWER_M || low > -LOWER_M - LOWER_PER_M * (ray.end - middle).norm() {
            return false;
        }
        ray.eye.is_none_or(|eye| {
            let high = surface.height_m(&eye);
            let crossing = eye + (ray.end - eye) * (high / (high - low));
            high > 0.0 && !outline.covers(&crossing, 0.0)
        })
    };
    let count = rays.iter().filter(is_past).count();
    let share = count as f64 / rays.len().max(1) as f64;
    (count >= PAST_RAYS && share >= PAST_SHARE).then_some(share)
}

/// Role of a surface from its slope, from what it stands on, and from what was seen past its edge;
/// undecided without such evidence.
fn supports(
    n: usize,
    surfaces: &[Surface],
    level: &Unit<Vector3<f64>>,
    (past, open): (&[Option<f64>], &[bool]),
    rays: &[Ray],
) -> (Role, Sign) {
    let surface = &surfaces[n];
    let by_rad = surface.up.angle(level);
    if by_rad.cos() < PARALLEL {
        return (Role::Other, Sign::Slanted { by_rad });
    }
    let lies_on = |other: &Surface| {
        // What is no taller than things are, on a table, is one unless something was seen beneath it.
        let tall_m = if past[n].is_some() && !open[n] { TALLEST_M } else { THING_M.1 };
        let by_m = other.height_m(&surface.middle());
        (by_m > THING_M.0 && by_m < tall_m && surface.stands_on(other, rays)).then_some(by_m)
    };
    // What reaches as far as a floor is no thing on another.
    let others = surfaces.iter().filter(|_| surface.reach_m() < REACH_M);
    let under = others.filter_map(lies_on).fold(f64::INFINITY, f64::min);
    let width_m = surface.width_m();
    match () {
        () if under.is_finite() => (Role::Other, Sign::OnTop { by_m: under }),
        () if past[n].is_some() && width_m < NARROW_M => (Role::Other, Sign::Narrow { width_m }),
        () => {
            past[n].map_or((Role::Untold, Sign::NoCamera), |share| (Role::Support, Sign::SeenPast { share }))
        }
    }
}

/// True if every camera sees most of a surface through a better one above: a mirror image.
fn is_mirrored(n: usize, surfaces: &[Surface], eyes: &[Point3<f64>]) -> bool {
    let surface = &surfaces[n];
    let is_through = |above: &Surface| {
        let outline = above.outline();
        let crosses = |eye: &Point3<f64>, p: &&Point3<f64>| {
            let (high, low) = (above.height_m(eye), above.height_m(p));
            high > 0.0 && low < -LOWER_M && outline.covers(&(eye + (*p - eye) * (high / (high - low))), 0.0)
        };
        let most = |eye: &Point3<f64>| {
            surface.hull.iter().filter(|p| crosses(eye, p)).count() * MOST.1 >= surface.hull.len() * MOST.0
        };
        !eyes.is_empty() && eyes.iter().all(most)
    };
    surfaces[..n].iter().any(is_through)
}

/// Role of a surface below which nothing was seen.
fn lowest(surface: &Surface, surfaces: &[Surface], eyes: &[Point3<f64>]) -> (Role, Sign) {
    if surface.role != Role::Untold {
        return (surface.role, surface.because.clone());
    }
    if eyes.is_empty() {
        return (Role::Untold, Sign::NoCamera);
    }
    let eye_m = eyes.iter().map(|eye| surface.height_m(eye)).sum::<f64>() / eyes.len() as f64;
    let above = surfaces.iter().filter(|s| s.role == Role::Support && s.is_parallel(surface));
    let by_m = above.map(|s| surface.height_m(&s.middle())).fold(0.0, f64::max);
    match () {
        () if eye_m < EYE_M => (Role::Untold, Sign::NoEdge { eye_m }),
        () if by_m >= UNDER_M && surface.reach_m() >= REACH_M => (Role::Floor, Sign::Under { by_m }),
        () if surface.area_m2 >= WIDE_M2 => (Role::Floor, Sign::Wide { area_m2: surface.area_m2 }),
        () => (Role::Untold, Sign::NoEdge { eye_m }),
    }
}

/// Role of a surface without other evidence: floor if level with a floor surface.
fn level_with_floor(surface: &Surface, surfaces: &[Surface]) -> (Role, Sign) {
    let goes_on = |floor: &Surface| {
        let gap = surface.middle() - floor.middle();
        floor.is_parallel(surface)
            && floor.height_m(&surface.middle()).abs() < LOWER_M + LOWER_PER_M * gap.norm()
    };
    let floors = || surfaces.iter().filter(|s| s.role == Role::Floor);
    match surface.role {
        Role::Untold if floors().any(goes_on) => (Role::Floor, Sign::LevelWithFloor),
        _ => (surface.role, surface.because.clone()),
    }
}

/// Outlines and heights of the boards above a surface.
fn over(surface: &Surface, boards: &[&Surface]) -> Vec<Overhang> {
    let is_over = |s: &&&Surface| s.is_parallel(surface);
    let level = |s: &&Surface| Overhang { above_m: surface.height_m(&s.middle()), hull: s.hull.clone() };
    boards.iter().filter(is_over).map(level).filter(|level| level.above_m > LOWER_M).collect()
}

impl Surface {
    /// Centre of the outline in the world.
    pub fn middle(&self) -> Point3<f64> {
        Point3::from(self.surface_from_world.inverse().translation.vector)
    }

    /// Maximum extent of the outline, metres.
    pub fn reach_m(&self) -> f64 {
        let pairs = self.hull.iter().flat_map(|a| self.hull.iter().map(move |b| (a - b).norm()));
        pairs.fold(0.0, f64::max)
    }

    /// Smallest width of the outline, metres.
    pub fn width_m(&self) -> f64 {
        let edges = self.hull.iter().zip(self.hull.iter().cycle().skip(1));
        let across = |(a, b): (&Point3<f64>, &Point3<f64>)| {
            let inward = self.up.cross(&(b - a)).try_normalize(0.0)?;
            Some(self.hull.iter().map(|p| inward.dot(&(p - a))).fold(0.0, f64::max))
        };
        edges.filter_map(across).fold(f64::INFINITY, f64::min)
    }

    fn is_parallel(&self, other: &Surface) -> bool {
        self.up.dot(&other.up) >= PARALLEL
    }

    /// True if points were seen beneath the surface.
    fn is_open_beneath(&self, samples: &[Sample]) -> bool {
        let outline = self.outline();
        let is_beneath =
            |s: &&Sample| self.height_m(&s.point) < -BENEATH_M.1 && outline.covers(&s.point, -BENEATH_M.0);
        samples.iter().filter(is_beneath).take(BENEATH).count() == BENEATH
    }

    /// True if the lower surface `other` is seen around this one, with hardly anything lower.
    fn stands_on(&self, other: &Surface, rays: &[Ray]) -> bool {
        if !self.is_parallel(other) {
            return false;
        }
        let outline = self.outline();
        let (mut on, mut past) = (0, 0);
        for ray in rays {
            let low = other.height_m(&ray.end);
            if low.abs() < LEVEL_M {
                on += usize::from(outline.covers(&ray.end, AROUND_M));
            } else if low < -LOWER_M {
                let crossing = ray.eye.map_or(ray.end, |eye| {
                    let high = other.height_m(&eye);
                    eye + (ray.end - eye) * (high / (high - low))
                });
                past += usize::from(outline.covers(&crossing, AROUND_M));
            }
        }
        on >= AROUND_RAYS && on * MOST.1 >= (on + past) * MOST.0
    }
}
