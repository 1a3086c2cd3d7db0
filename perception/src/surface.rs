//! Level surfaces in view, floor and supports: plane and convex hull of each (paper 004, section
//! V).

#[doc(hidden)]
pub mod connected;
mod error;
mod extent;
mod face;
pub(crate) mod level;
mod options;
#[doc(hidden)]
pub mod outline;
mod planes;
mod role;
mod sample;
#[doc(hidden)]
pub mod tiles;
mod upright;

use crate::cloud::{Cloud, is_finite};
pub(crate) use crate::noise::{nearest_sigma_m, range_sigma_m};
use crate::pool;
pub(crate) use crate::scale::floor;
use crate::visibility::Visibility;
use std::sync::mpsc;

pub use connected::largest_part;
pub use error::SurfaceError;
pub(crate) use extent::TALLEST_M;
use level::THINGS_M;
pub use level::{Overhang, Role, Sign, Surface};
pub use options::{Region, SurfaceOptions};
pub use outline::Outline;
pub(crate) use outline::Rows;
pub(crate) use planes::{BAND, dominant_planes};
use planes::{FEWEST, Plane, ROUNDS, face_up, large_planes};
use sample::{FARTHEST_M, Sample, is_in_reach, sample};
use upright::Doubt;

/// Area of the largest possible surface, square metres. From: derived, that of all that is in
/// reach.
const MOST_AREA_M2: f64 = 4.0 * (FARTHEST_M as f64) * (FARTHEST_M as f64);

/// Minimum number of object returns above a surface for objects to stand there; fewer are
/// accidental. From: chosen.
const THINGS: usize = 20;
/// Minimum distance from the surface's edge of a return that counts as of an object on the surface,
/// metres. From: chosen, a board that a cupboard stands against is laid 2 cm aside with 4 mm less.
const WITHIN_M: f64 = 0.02;

/// Finds the supporting surface: the best of [`find_surfaces`] that satisfies the options.
///
/// # Errors
/// If there is none, with the reason: too few points, nothing level as wanted, only the floor, or nothing that tells a table from the floor.
pub fn find_surface(
    cloud: &Cloud,
    seen: &Visibility,
    options: &SurfaceOptions,
) -> Result<Surface, SurfaceError> {
    best(find_surfaces(cloud, seen, options)?, options)
}

/// First surface of the list that satisfies the options, if it is or may be a support.
///
/// # Errors
/// If there is none, with the reason.
pub fn best(surfaces: Vec<Surface>, options: &SurfaceOptions) -> Result<Surface, SurfaceError> {
    let tried = surfaces.len();
    let best = surfaces.into_iter().find(|surface| options.wants(surface));
    let best = best.ok_or_else(|| SurfaceError::NotFound { tried, wanted: options.wanted() })?;
    let because = best.because.clone();
    match best.role {
        Role::Support | Role::Untold => Ok(best),
        Role::Floor => Err(SurfaceError::OnlyFloor { because }),
        Role::Other => Err(SurfaceError::OnlyOther { because }),
    }
}

/// Finds the level surfaces that face the cameras, with their roles; sorted by: satisfying the
/// options, being a support, and number of returns with objects.
///
/// `seen` gives the places of the cameras, what they saw past an edge and, without a hint, which way is up. Where a region is given,
/// the outline of a surface in it ends there. Deterministic for a seed.
///
/// # Errors
/// If there are too few points or nothing is level and large enough.
pub fn find_surfaces(
    cloud: &Cloud,
    seen: &Visibility,
    options: &SurfaceOptions,
) -> Result<Vec<Surface>, SurfaceError> {
    pool::within(tracing::debug_span!("find_surfaces", points = cloud.len()), || {
        let viewpoints = seen.viewpoints();
        let samples = sample(cloud, &viewpoints);
        if samples.len() < FEWEST {
            let found = cloud.count_finite();
            let far = cloud.points.iter().filter(|p| is_finite(p) && !is_in_reach(p)).count();
            let too_few = SurfaceError::TooFew { found, needed: FEWEST };
            return Err(if found < FEWEST { too_few } else { SurfaceError::TooFar { found, far } });
        }
        let way_up = match options.up {
            None if !viewpoints.is_empty() => {
                let wanted = || SurfaceError::NotFound { tried: 0, wanted: options.wanted() };
                Some(upright::up(&samples, seen, options.seed).map_err(|doubt| match doubt {
                    Doubt::NoPlane => wanted(),
                    Doubt::Untold => SurfaceError::UpUntold,
                })?)
            }
            said => said.map(|up| (up, 1.0)),
        };
        let up = way_up.map(|(up, _)| up);
        let tilt_rad = options.tilt_rad;
        let is_level = |plane: &Plane| up.is_none_or(|up| plane.normal.dot(&up).abs() >= tilt_rad.cos());
        let faces_of = |plane: &Plane| {
            let mut faces = face::faces(&face_up(plane, up.as_deref(), &viewpoints), &samples, cloud, seen);
            faces.retain(|face| face.area_m2 >= options.least_area_m2 && face.area_m2 <= MOST_AREA_M2);
            faces
        };
        let (teller, told) = mpsc::channel();
        let mut tried = 0;
        // The faces of one are found while the next planes are sought.
        let planes = || {
            rayon::in_place_scope(|scope| {
                let found = |plane: Plane| {
                    // What a plane was proposed as, its points may not bear out.
                    if is_level(&plane) {
                        let (n, teller, faces_of) = (tried, teller.clone(), &faces_of);
                        scope.spawn(move |_| drop(teller.send((n, faces_of(&plane)))));
                        tried += 1;
                    }
                };
                large_planes(&samples, (options.seed, ROUNDS), is_level, found);
            })
        };
        let ((), rays) = pool::join(planes, || role::rays(&samples, seen));
        drop(teller);
        let mut faces: Vec<(usize, Vec<Surface>)> = told.into_iter().collect();
        faces.sort_unstable_by_key(|(n, _)| *n);
        let surfaces: Vec<Surface> = faces.into_iter().flat_map(|(_, faces)| faces).collect();
        if surfaces.is_empty() {
            return Err(SurfaceError::NotFound { tried, wanted: options.wanted() });
        }
        let mut surfaces = distinct(surfaces, &samples);
        surfaces.iter_mut().for_each(|surface| surface.up_chance = way_up.map_or(1.0, |(_, chance)| chance));
        role::tell(&mut surfaces, &samples, &rays, seen, up.as_ref(), options);
        surfaces.sort_by_key(|surface| (!options.wants(surface), surface.role));
        let whole = |surface: Surface| match surface.role {
            Role::Support | Role::Untold => surface.with_hidden(&samples, seen),
            Role::Floor | Role::Other => surface,
        };
        Ok(pool::map(&surfaces, 1, |surface| options.within_region(whole(surface.clone()))))
    })
}

/// Surfaces by decreasing evidence, without remnants of a better surface and of objects on it.
fn distinct(surfaces: Vec<Surface>, samples: &[Sample]) -> Vec<Surface> {
    let claims = pool::map(&surfaces, 1, |surface| claim(surface, samples));
    let mut claims: Vec<(f64, Surface)> = claims.into_iter().zip(surfaces).collect();
    claims.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let mut distinct: Vec<Surface> = Vec::new();
    for (_, surface) in claims {
        if !distinct.iter().any(|better| surface.cuts(better)) {
            distinct.push(surface);
        }
    }
    distinct
}

/// Rank of a surface among similar ones: its returns, doubled if objects stand on it.
fn claim(surface: &Surface, samples: &[Sample]) -> f64 {
    let hull = surface.outline();
    let is_on = |s: &&Sample| {
        let height = surface.height_m(&s.point);
        height > THINGS_M.0 && height < THINGS_M.1 && hull.covers(&s.point, -WITHIN_M)
    };
    let things = samples.iter().filter(is_on).take(THINGS).count();
    surface.points as f64 * if things >= THINGS { 2.0 } else { 1.0 }
}
