//! The surface that the objects stand on: its plane and its convex hull (paper 004, section V).

mod hull;
mod outline;
mod planes;

use crate::cloud::{Cloud, is_finite};
use crate::noise::axial_sigma_m;
use crate::visibility::Visibility;
use nalgebra::{Isometry3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

pub(crate) use hull::{convex_hull, largest_part};
pub use outline::Outline;
pub(crate) use outline::Rows;
pub(crate) use planes::dominant_planes;
use planes::{FEWEST, Plane, SAMPLE, Sample, large_planes};

/// How to look for the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceOptions {
    /// Up in the world, if known. Otherwise up is taken from how the cameras are held.
    pub up: Option<Unit<Vector3<f64>>>,
    /// Most angle between the surface's normal and `up`, radians.
    pub tilt_rad: f64,
    /// Least and greatest height of the surface along `up`, metres, if known.
    pub height_band_m: Option<(f64, f64)>,
    /// Least area of the surface, square metres.
    pub least_area_m2: f64,
    /// Seed of the sampling.
    pub seed: u64,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        SurfaceOptions { up: None, tilt_rad: 0.26, height_band_m: None, least_area_m2: 0.04, seed: 1 }
    }
}

/// Why no surface was found.
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
    /// No plane fits what was asked for.
    #[error(
        "no plane {wanted} among the {tried} largest: widen the height band, give `up`, or look at the table"
    )]
    NotFound {
        /// Planes that were looked at.
        tried: usize,
        /// What was wanted, in words.
        wanted: String,
    },
}

/// A horizontal-enough face with its outline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Unit normal in the world, away from the side that carries the objects' weight: up.
    pub up: Unit<Vector3<f64>>,
    /// `up · p` of its points, metres.
    pub offset_m: f64,
    /// Convex outline in the world, anticlockwise seen from above, metres.
    pub hull: Vec<Point3<f64>>,
    /// Area of the outline, square metres.
    pub area_m2: f64,
    /// Points of the cloud that lie on it.
    pub points: usize,
    /// Root mean square distance of those points from the plane, metres.
    pub residual_m: f64,
    /// World to the surface's frame: z up with 0 on the surface, origin at the middle of the hull.
    pub surface_from_world: Isometry3<f64>,
}

impl Surface {
    /// Height of a point of the world above the plane, metres.
    pub fn height_m(&self, p: &Point3<f64>) -> f64 {
        self.up.dot(&p.coords) - self.offset_m
    }

    /// The same in another frame.
    pub fn moved(&self, there_from_world: &Isometry3<f64>) -> Surface {
        let up = there_from_world.rotation * self.up;
        let hull: Vec<Point3<f64>> = self.hull.iter().map(|p| there_from_world * p).collect();
        let shift = up.dot(&there_from_world.translation.vector);
        let surface_from_world = self.surface_from_world * there_from_world.inverse();
        Surface { up, hull, offset_m: self.offset_m + shift, surface_from_world, ..self.clone() }
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

/// Side of the cells that tell which points of a plane hang together, metres.
const CELL_M: f64 = 0.03;
/// Heights above a surface at which things stand on it, metres.
const THINGS_M: (f64, f64) = (0.025, 0.35);

/// Finds the surface: the plane with most returns that is level enough, faces the cameras and, if any has, has things on it.
///
/// `seen` gives the places of the cameras and, without a hint, which way is up. Deterministic for a seed.
///
/// # Errors
/// If there are too few points or no plane is as wanted.
pub fn find_surface(
    cloud: &Cloud,
    seen: &Visibility,
    options: &SurfaceOptions,
) -> Result<Surface, SurfaceError> {
    let _span = tracing::debug_span!("find_surface", points = cloud.len()).entered();
    let viewpoints = seen.viewpoints();
    let samples = sample(cloud, &viewpoints);
    if samples.len() < FEWEST {
        return Err(SurfaceError::TooFew { found: cloud.count_finite(), needed: FEWEST });
    }
    let up = options.up.or_else(|| held_up(seen));
    // What cameras are held like is a weaker hint than a known direction.
    let tilt_rad = if options.up.is_some() { options.tilt_rad } else { 1.2 };
    let planes = large_planes(&samples, options.seed, |plane| {
        up.is_none_or(|up| plane.normal.dot(&up).abs() >= tilt_rad.cos())
    });
    let mut best: Option<(f64, Surface)> = None;
    for plane in &planes {
        let plane = face_up(plane, up.as_deref(), &viewpoints);
        let within = |(low, high): (f64, f64)| (low..=high).contains(&plane.offset);
        if !options.height_band_m.is_none_or(within) {
            continue;
        }
        let Some(surface) = outline(&plane, &samples, cloud, &viewpoints) else { continue };
        if surface.area_m2 < options.least_area_m2 {
            continue;
        }
        let hull = surface.outline();
        let things = samples
            .iter()
            .filter(|s| {
                let height = surface.height_m(&s.point);
                height > THINGS_M.0 && height < THINGS_M.1 && hull.covers(&s.point, -0.02)
            })
            .count();
        // Something on it doubles the claim of a plane: an empty table must still beat a wall behind it.
        let score = surface.points as f64 * if things >= 20 { 2.0 } else { 1.0 };
        if best.as_ref().is_none_or(|(s, _)| score > *s) {
            best = Some((score, surface));
        }
    }
    best.map(|(_, surface)| surface)
        .ok_or_else(|| SurfaceError::NotFound { tried: planes.len(), wanted: wanted(options) })
}

fn wanted(options: &SurfaceOptions) -> String {
    let band = options
        .height_band_m
        .map_or(String::new(), |(low, high)| format!(" between {low} and {high} m high"));
    let tilt = options
        .up
        .map_or(String::new(), |_| format!(" within {:.0}° of level", options.tilt_rad.to_degrees()));
    format!("of {} m² or more{band}{tilt}", options.least_area_m2)
}

/// Spread of a depth camera's range at a distance (Nguyen et al.), metres.
pub(crate) fn range_sigma_m(distance_m: f64) -> f64 {
    axial_sigma_m(distance_m, 0.0).unwrap_or(0.0012)
}

fn sample(cloud: &Cloud, viewpoints: &[Point3<f64>]) -> Vec<Sample> {
    let stride = (cloud.len() / SAMPLE).max(1);
    // A stride that shares a factor with the rows would sample columns only.
    let stride = match cloud.grid {
        Some(grid) if stride > 1 && grid.width % stride == 0 => stride + 1,
        _ => stride,
    };
    let near =
        |p: &Point3<f64>| viewpoints.iter().map(|v| (p - v).norm()).min_by(f64::total_cmp).unwrap_or(1.0);
    cloud
        .points
        .iter()
        .step_by(stride)
        .filter(|p| is_finite(p))
        .map(|p| {
            let point = p.cast::<f64>();
            let sigma_m = range_sigma_m(near(&point)).min(0.02);
            Sample { point, sigma_m }
        })
        .collect()
}

/// Up as people and robots hold cameras: against the images' downward axis.
fn held_up(seen: &Visibility) -> Option<Unit<Vector3<f64>>> {
    let sum: Vector3<f64> =
        seen.maps.iter().map(|m| m.camera_from_world.rotation.inverse() * -Vector3::y()).sum();
    Unit::try_new(sum, 1e-6)
}

/// [`f64::floor`], which is a call on some processors.
#[inline(always)]
pub(crate) fn floor(value: f64) -> i32 {
    let whole = value as i32;
    whole.saturating_sub(i32::from(value < f64::from(whole)))
}

/// The plane with its normal up: along the hint, else towards the cameras.
fn face_up(plane: &Plane, up: Option<&Vector3<f64>>, viewpoints: &[Point3<f64>]) -> Plane {
    let rise = match up {
        Some(up) => plane.normal.dot(up),
        None if viewpoints.is_empty() => plane.normal.z,
        None => viewpoints.iter().map(|v| plane.distance(v)).sum(),
    };
    if rise < 0.0 { Plane { normal: -plane.normal, offset: -plane.offset } } else { *plane }
}

/// The largest connected part of a plane with its convex hull. `None` if no camera is above it.
fn outline(plane: &Plane, samples: &[Sample], cloud: &Cloud, viewpoints: &[Point3<f64>]) -> Option<Surface> {
    if !viewpoints.is_empty() && viewpoints.iter().all(|v| plane.distance(v) < 0.02) {
        return None;
    }
    let up = Unit::new_normalize(plane.normal);
    let turn = UnitQuaternion::rotation_between(&up, &Vector3::z()).unwrap_or_else(|| {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(
            &Vector3::x_axis(),
            std::f64::consts::PI,
        ))
    });
    let rotation = turn.to_rotation_matrix();
    let mut cells: FxHashMap<[i32; 2], u32> = FxHashMap::default();
    let mut run = ([i32::MIN; 2], 0);
    let mut squares = 0.0;
    for s in samples.iter().filter(|s| plane.holds(s)) {
        let flat = rotation * s.point;
        let cell = [floor(flat.x / CELL_M), floor(flat.y / CELL_M)];
        if cell != run.0 {
            let (cell, count) = std::mem::replace(&mut run, (cell, 0));
            *cells.entry(cell).or_default() += count;
        }
        run.1 += 1;
        squares += plane.distance(&s.point).powi(2);
    }
    *cells.entry(run.0).or_default() += run.1;
    cells.retain(|_, count| *count > 0);
    let total: u32 = cells.values().sum();
    let part = largest_part(&cells);
    let points: u32 = part.iter().filter_map(|c| cells.get(c)).sum();
    let corners = part.iter().flat_map(|&[x, y]| [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]);
    let hull = convex_hull(corners.map(|[x, y]| [f64::from(x) * CELL_M, f64::from(y) * CELL_M]).collect());
    if hull.len() < 3 {
        return None;
    }
    let middle =
        hull.iter().fold([0.0, 0.0], |m, c| [m[0] + c[0], m[1] + c[1]]).map(|c| c / hull.len() as f64);
    let area_m2 = 0.5
        * (0..hull.len())
            .map(|i| (hull[i], hull[(i + 1) % hull.len()]))
            .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
            .sum::<f64>();
    let origin = Vector3::new(middle[0], middle[1], plane.offset);
    let surface_from_world = Translation3::from(-origin) * turn;
    let back = surface_from_world.inverse();
    let corner = |c: &[f64; 2]| back * Point3::new(c[0] - middle[0], c[1] - middle[1], 0.0);
    let scale = cloud.len() as f64 / samples.len().max(1) as f64;
    Some(Surface {
        up,
        offset_m: plane.offset,
        hull: hull.iter().map(corner).collect(),
        area_m2,
        points: (f64::from(points) * scale.max(1.0)) as usize,
        residual_m: (squares / f64::from(total.max(1))).sqrt(),
        surface_from_world,
    })
}
