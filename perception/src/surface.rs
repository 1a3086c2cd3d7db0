//! Level surfaces in view, floor and supports: plane and convex hull of each (paper 004, section
//! V).

mod extent;
mod face;
#[doc(hidden)]
pub mod hull;
#[doc(hidden)]
pub mod outline;
mod planes;
mod role;
#[doc(hidden)]
pub mod tiles;
mod upright;

use crate::cloud::{Cloud, is_finite};
use crate::noise::KINECT;
use crate::pool;
use crate::scale::APART_M;
use crate::visibility::Visibility;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};
use std::sync::mpsc;

pub(crate) use extent::TALLEST_M;
pub use hull::{convex_hull, largest_part};
pub use outline::Outline;
pub(crate) use outline::Rows;
pub(crate) use planes::{BAND, dominant_planes};
use planes::{FEWEST, Plane, ROUNDS, SAMPLE, SAMPLE_OF_ONE, Sample, large_planes};
pub use role::{Role, Sign};
use upright::Doubt;

/// The options of the search for the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceOptions {
    /// Up direction in the world, if known; otherwise estimated from the planes, the objects on
    /// them and the cameras' attitude.
    pub up: Option<Unit<Vector3<f64>>>,
    /// Most angle between the surface's normal and `up`, radians. From: chosen, 15°.
    pub tilt_rad: f64,
    /// Least and greatest height of the surface along `up`, metres, if known.
    pub height_band_m: Option<(f64, f64)>,
    /// The region of the surface as seen from above, if known: surfaces outside are not wanted.
    pub region: Option<Region>,
    /// Least area of the surface, square metres. From: chosen.
    pub least_area_m2: f64,
    /// Seed of the sampling. From: mark.
    pub seed: u64,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        SurfaceOptions {
            up: None,
            tilt_rad: 0.26,
            height_band_m: None,
            region: None,
            least_area_m2: 0.04,
            seed: 1,
        }
    }
}

/// The region where a surface is expected, seen from above.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Corners of the convex outline in the world, in either direction, metres.
    pub corners: Vec<Point3<f64>>,
    /// The maximum distance of the surface outside the region, metres.
    pub margin_m: f64,
}

/// Maximum coordinate of a return, metres. From: chosen, beyond what cameras and lasers of robots
/// measure.
const FARTHEST_M: f32 = 1000.0;
/// Area of the largest possible surface, square metres. From: derived, that of all that is in
/// reach.
const MOST_AREA_M2: f64 = 4.0 * (FARTHEST_M as f64) * (FARTHEST_M as f64);

/// The reason no surface was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// Too few points to speak of a surface.
    #[error("{found} finite points do not make a surface: at least {needed} are needed")]
    TooFew {
        /// Finite points in the cloud.
        found: usize,
        /// Needed.
        needed: usize,
    },
    /// The points lie where no sensor of a robot measures.
    #[error(
        "{far} of {found} points lie farther than {FARTHEST_M} m from the origin: the coordinates are damaged, or in another unit or order of bytes"
    )]
    TooFar {
        /// Finite points in the cloud.
        found: usize,
        /// Number of returns out of range.
        far: usize,
    },
    /// No plane is as asked for.
    #[error("{}: widen the height band, give or check the direction of up, or look at the table", no_plane(wanted, *tried))]
    NotFound {
        /// Planes that were looked at.
        tried: usize,
        /// The wanted surface, in words.
        wanted: String,
    },
    /// The up direction is ambiguous, or nothing level is in view.
    #[error(
        "which way is up cannot be told from what is in view: say which way is up, or look at the table with what stands on it"
    )]
    UpUntold,
    /// Every surface that is as wanted is the floor.
    #[error(
        "all that is level here is the floor ({because}): look at the table, or give the height band that it is in"
    )]
    OnlyFloor {
        /// The sign of the floor.
        because: Sign,
    },
    /// A surface that is as wanted may be the floor as well as a table.
    #[error(
        "a level surface of {area_m2:.2} m² may be a table or the floor ({because}): look where its edge is in view, or give the height band that it is in"
    )]
    Untold {
        /// Area of the largest, square metres.
        area_m2: f64,
        /// The sign that leaves the role undecided.
        because: Sign,
    },
    /// None of the requested surfaces is a support.
    #[error("what is level here is nothing to stand things on ({because}): look at the table")]
    OnlyOther {
        /// The sign of that role.
        because: Sign,
    },
}

fn no_plane(wanted: &str, tried: usize) -> String {
    match tried {
        0 => format!("no plane {wanted}, and no other that is level"),
        _ => format!("no plane {wanted} among the {tried} largest"),
    }
}

/// Level plane with its outline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Unit normal in the world, away from the side that carries the objects' weight: up.
    pub up: Unit<Vector3<f64>>,
    /// `up · p` of the plane's points, metres.
    pub offset_m: f64,
    /// Convex outline in the world, anticlockwise seen from above, metres.
    pub hull: Vec<Point3<f64>>,
    /// Area of the outline, square metres.
    pub area_m2: f64,
    /// Number of cloud points on the surface.
    pub points: usize,
    /// Root mean square distance from the plane of all points near it, metres.
    pub residual_m: f64,
    /// Share of the finite points on the surface.
    pub share: f64,
    /// World to the surface's frame: z up with 0 on the surface, origin at the middle of the hull.
    pub surface_from_world: Isometry3<f64>,
    /// The role of the surface.
    pub role: Role,
    /// Evidence for the role.
    pub because: Sign,
    /// Height above the floor, metres, where the floor is in view.
    pub above_floor_m: Option<f64>,
    /// The probability of the up direction that was assumed when the surface was found: one if the direction
    /// was given, or no camera is known.
    #[serde(default = "said")]
    pub up_chance: f64,
    /// Outlines of the other supports above this surface, metres in the world.
    pub over: Vec<Level>,
}

fn said() -> f64 {
    1.0
}

/// The outline and height of another surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// The height above, metres.
    pub above_m: f64,
    /// Convex outline in the world, anticlockwise seen from above, metres.
    pub hull: Vec<Point3<f64>>,
}

impl Level {
    /// The outline of the surface, prepared for tests of many points.
    pub(crate) fn outline(&self, up: &Vector3<f64>) -> Outline {
        Outline::of(&self.hull, up)
    }
}

impl Surface {
    /// Reason why the surface may not be a support, in words after its role; `None` if practically
    /// certain.
    pub fn doubt(&self) -> Option<String> {
        let (because, chance) = (&self.because, self.up_chance);
        match self.role {
            Role::Untold => Some(format!("may be the floor: {because}")),
            _ if chance >= upright::SURE => None,
            _ => {
                Some(format!("may be a wall: which way is up is told from what is in view, with {chance:.2}"))
            }
        }
    }

    /// Height of a point of the world above the plane, metres.
    pub fn height_m(&self, p: &Point3<f64>) -> f64 {
        self.up.dot(&p.coords) - self.offset_m
    }

    /// Predicate for points, given height above the surface, that belong to a board above or its
    /// load, and so do not stand on this surface.
    pub(crate) fn overhung(&self) -> impl Fn(f64, &Point3<f64>) -> bool + use<> {
        /// Thickness of a board with the objects that hide its edge, and overhang of objects beyond
        /// its hull, metres. From: chosen.
        const BOARD_M: f64 = 0.05;
        const MARGIN_M: f64 = 0.03;
        let boards: Vec<(f64, Outline)> =
            self.over.iter().map(|over| (over.above_m, over.outline(&self.up))).collect();
        move |height_m, p| {
            boards
                .iter()
                .any(|(above_m, outline)| height_m > above_m - BOARD_M && outline.covers(p, MARGIN_M))
        }
    }

    /// Places of the world as seen from above, in the surface's frame.
    fn flat(&self, places: &[Point3<f64>]) -> Vec<[f64; 2]> {
        places.iter().map(|p| (self.surface_from_world * p).xy().coords.into()).collect()
    }

    /// True if the surface cuts through the other or lies below it; two supports never do.
    fn cuts(&self, other: &Surface) -> bool {
        let heights = self.hull.iter().map(|p| other.height_m(p));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        let common = || hull::clip(convex_hull(other.flat(&self.hull)), &other.flat(&other.hull), 0.0);
        low < APART_M && high > -APART_M && hull::area(&common()) > COMMON * self.area_m2
    }

    /// The surface in another frame.
    pub fn moved(&self, there_from_world: &Isometry3<f64>) -> Surface {
        let up = there_from_world.rotation * self.up;
        let hull: Vec<Point3<f64>> = self.hull.iter().map(|p| there_from_world * p).collect();
        let shift = up.dot(&there_from_world.translation.vector);
        let surface_from_world = self.surface_from_world * there_from_world.inverse();
        let mut over = self.over.clone();
        over.iter_mut().flat_map(|level| &mut level.hull).for_each(|p| *p = there_from_world * *p);
        Surface { up, hull, over, offset_m: self.offset_m + shift, surface_from_world, ..self.clone() }
    }

    /// True if the point lies above or below the outline widened by `margin_m`. For many points see [`Surface::outline`].
    pub fn covers(&self, p: &Point3<f64>, margin_m: f64) -> bool {
        self.outline().covers(p, margin_m)
    }

    /// The outline made ready to be asked about many points.
    pub fn outline(&self) -> Outline {
        Outline::of(&self.hull, &self.up)
    }
}

/// Height range of objects above their surface, metres. From: chosen.
const THINGS_M: (f64, f64) = (0.025, 0.35);
/// Surfaces that share so much of the lesser one, seen from above, are in two places. From: chosen.
const COMMON: f64 = 0.2;

/// Minimum number of object returns at least `WITHIN_M` inside the outline, metres; fewer are
/// accidental. From: chosen, a board that a cupboard stands against is laid 2 cm aside with 4 mm
/// less.
const THINGS: usize = 20;
const WITHIN_M: f64 = 0.02;
/// Fraction that counts as most: the first number of the second, seven of ten. From: chosen.
const MOST: (usize, usize) = (7, 10);

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

/// First supporting surface of the list from [`find_surfaces`].
///
/// # Errors
/// If there is none, with the reason.
pub fn best(surfaces: Vec<Surface>, options: &SurfaceOptions) -> Result<Surface, SurfaceError> {
    let tried = surfaces.len();
    let best = surfaces.into_iter().find(|surface| options.wants(surface));
    let best = best.ok_or_else(|| SurfaceError::NotFound { tried, wanted: wanted(options) })?;
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
                let wanted = || SurfaceError::NotFound { tried: 0, wanted: wanted(options) };
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
            return Err(SurfaceError::NotFound { tried, wanted: wanted(options) });
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

impl SurfaceOptions {
    /// True if a surface satisfies the requested height and region, whatever its role.
    pub fn wants(&self, surface: &Surface) -> bool {
        let up = self.up.unwrap_or(surface.up);
        // A tilted plane has its height where the surface is, not where the world begins.
        let height_m = up.dot(&surface.middle().coords);
        let height = self.height_band_m.is_none_or(|(low, high)| (low..=high).contains(&height_m));
        height
            && surface.area_m2 >= self.least_area_m2
            && self.region.as_ref().is_none_or(|r| r.holds(surface))
    }

    /// Surface clipped to the region; unchanged if outside.
    fn within_region(&self, surface: Surface) -> Surface {
        match &self.region {
            Some(region) if self.wants(&surface) => region.cut(surface),
            _ => surface,
        }
    }
}

impl Region {
    /// True if most of the surface or of the region lies in both.
    fn holds(&self, surface: &Surface) -> bool {
        let own_m2 = hull::area(&convex_hull(surface.flat(&self.corners)));
        let both_m2 = hull::area(&self.common(surface));
        both_m2 >= 0.5 * surface.area_m2.min(own_m2) && both_m2 > 0.0
    }

    /// The part of the surface's outline in the widened region, in the surface's frame.
    fn common(&self, surface: &Surface) -> Vec<[f64; 2]> {
        hull::clip(surface.flat(&surface.hull), &convex_hull(surface.flat(&self.corners)), self.margin_m)
    }

    /// Unit vectors across `up` into the region, with the edges' offsets along them, metres; empty
    /// for a region without area.
    pub(crate) fn edges(&self, up: &Vector3<f64>) -> Vec<(Vector3<f64>, f64)> {
        let n = self.corners.len();
        let middle = self.corners.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords) / n.max(1) as f64;
        let edge = |i: usize| {
            let (a, b) = (&self.corners[i].coords, &self.corners[(i + 1) % n].coords);
            let across = up.cross(&(b - a)).try_normalize(0.0)?;
            let inward = if across.dot(&(middle - a)) < 0.0 { -across } else { across };
            Some((inward, inward.dot(a)))
        };
        if n < 3 { Vec::new() } else { (0..n).filter_map(edge).collect() }
    }

    fn cut(&self, surface: Surface) -> Surface {
        let common = self.common(&surface);
        let world_from_surface = surface.surface_from_world.inverse();
        let hull = common.iter().map(|&[x, y]| world_from_surface * Point3::new(x, y, 0.0)).collect();
        Surface { hull, area_m2: hull::area(&common), ..surface }
    }
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

fn wanted(options: &SurfaceOptions) -> String {
    let band = options
        .height_band_m
        .map_or(String::new(), |(low, high)| format!(" between {low:.2} and {high:.2} m high"));
    let tilt = options
        .up
        .map_or(String::new(), |_| format!(" within {:.0}° of level", options.tilt_rad.to_degrees()));
    format!("of {} m² or more{band}{tilt}", options.least_area_m2)
}

/// Spread of a depth camera's range at a distance (Nguyen et al.), metres.
pub(crate) fn range_sigma_m(distance_m: f64) -> f64 {
    if distance_m > 0.0 { KINECT.frontal_sigma_m(distance_m) } else { KINECT.axial_m }
}

/// Standard deviation of a measurement of a point from the nearest viewpoint, metres.
pub(crate) fn nearest_sigma_m(p: &Point3<f64>, viewpoints: &[Point3<f64>]) -> f64 {
    range_sigma_m(viewpoints.iter().map(|v| (p - v).norm()).min_by(f64::total_cmp).unwrap_or(1.0))
}

fn sample(cloud: &Cloud, viewpoints: &[Point3<f64>]) -> Vec<Sample> {
    /// However far off a point is measured, metres. From: chosen.
    const WORST_SIGMA_M: f64 = 0.02;
    let wanted = if viewpoints.len() > 1 { SAMPLE } else { SAMPLE_OF_ONE };
    let stride = (cloud.len() / wanted).max(1);
    // A stride that shares a factor with the rows would sample columns only.
    let stride = match cloud.grid {
        Some(grid) if stride > 1 && grid.width % stride == 0 => stride + 1,
        _ => stride,
    };
    let sample = |p: &Point3<f32>| {
        let point = p.cast::<f64>();
        let sigma_m = nearest_sigma_m(&point, viewpoints).min(WORST_SIGMA_M);
        Sample { point, sigma_m }
    };
    let half = (cloud.len() / 2).next_multiple_of(stride).min(cloud.len());
    let of = |points: &[Point3<f32>]| -> Vec<Sample> {
        points.iter().step_by(stride).filter(|p| is_in_reach(p)).map(sample).collect()
    };
    let (mut samples, more) = pool::join(|| of(&cloud.points[..half]), || of(&cloud.points[half..]));
    samples.extend(more);
    samples
}

/// True of a return that a sensor of a robot may have measured.
fn is_in_reach(p: &Point3<f32>) -> bool {
    p.iter().all(|c| c.abs() <= FARTHEST_M)
}

/// Up as people and robots hold cameras: against the images' downward axis.
fn held_up(seen: &Visibility) -> Option<Unit<Vector3<f64>>> {
    /// Minimum length of the mean up direction; shorter ones cancel out. From: rounding.
    const CANCELLED: f64 = 1e-6;
    if !seen.held {
        return None;
    }
    let sum: Vector3<f64> =
        seen.maps.iter().map(|m| m.camera_from_world.rotation.inverse() * -Vector3::y()).sum();
    Unit::try_new(sum, CANCELLED)
}

/// [`f64::floor`], which is a call on some processors.
#[inline(always)]
pub(crate) fn floor(value: f64) -> i32 {
    let whole = value as i32;
    whole.saturating_sub(i32::from(value < f64::from(whole)))
}

/// Plane with its normal up: along the hint, else towards the cameras.
fn face_up(plane: &Plane, up: Option<&Vector3<f64>>, viewpoints: &[Point3<f64>]) -> Plane {
    let rise = match up {
        Some(up) => plane.normal.dot(up),
        None if viewpoints.is_empty() => plane.normal.z,
        None => viewpoints.iter().map(|v| plane.distance(v)).sum(),
    };
    if rise < 0.0 { Plane { normal: -plane.normal, offset: -plane.offset } } else { *plane }
}
