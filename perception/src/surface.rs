//! The surface that the objects stand on: its plane and its convex hull (paper 004, section V).

mod outline;

use crate::cloud::{Cloud, is_finite};
use crate::draw::Draws;
use crate::noise::axial_sigma_m;
use crate::visibility::Visibility;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

pub use outline::Outline;
pub(crate) use outline::Rows;

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

/// Points looked at when a plane is sought; more do not change it.
const SAMPLE: usize = 16_000;
/// Fewest points that make a surface.
const FEWEST: usize = 50;
/// Planes proposed in each round.
const PROPOSALS: usize = 240;
/// Planes taken away one after another at most.
const ROUNDS: usize = 6;
/// Side of the cells that tell which points of a plane hang together, metres.
const CELL_M: f64 = 0.03;
/// Heights above a surface at which things stand on it, metres.
const THINGS_M: (f64, f64) = (0.025, 0.35);

#[derive(Clone, Copy)]
struct Plane {
    normal: Vector3<f64>,
    offset: f64,
}

impl Plane {
    fn distance(&self, p: &Point3<f64>) -> f64 {
        self.normal.dot(&p.coords) - self.offset
    }
}

struct Sample {
    point: Point3<f64>,
    /// Standard deviation of the measurement along the ray, metres.
    sigma_m: f64,
}

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

/// Large planes, one after another, each without the points of those before it.
fn large_planes(samples: &[Sample], seed: u64, plausible: impl Fn(&Plane) -> bool) -> Vec<Plane> {
    let mut rng = Draws::new(seed);
    let mut left: Vec<&Sample> = samples.iter().collect();
    let mut planes = Vec::new();
    for _ in 0..ROUNDS {
        if left.len() < FEWEST {
            break;
        }
        let Some(plane) = propose(&left, &mut rng, &plausible) else { break };
        let Some(plane) = refine(plane, &left) else { break };
        let before = left.len();
        left.retain(|s| plane.distance(&s.point).abs() > 3.0 * s.sigma_m + 0.004);
        if before - left.len() < FEWEST {
            break;
        }
        planes.push(plane);
    }
    planes
}

/// Normals and offsets of planes that hold at least a share of all points; points by view, with their spreads.
pub(crate) fn dominant_planes<'a>(
    places: &[Vec<Point3<f64>>],
    sigmas_m: impl Iterator<Item = &'a [f64]>,
    share: f64,
) -> Vec<(Vector3<f64>, f64)> {
    let total: usize = places.iter().map(Vec::len).sum();
    let stride = (total / (SAMPLE / 2)).max(1);
    let samples: Vec<Sample> = places
        .iter()
        .zip(sigmas_m)
        .flat_map(|(view, sigmas)| view.iter().zip(sigmas))
        .step_by(stride)
        .map(|(point, sigma_m)| Sample { point: *point, sigma_m: *sigma_m })
        .collect();
    let holds = |plane: &Plane| {
        let near = |s: &&Sample| plane.distance(&s.point).abs() < 3.0 * s.sigma_m + 0.004;
        samples.iter().filter(near).count() as f64 >= share * samples.len() as f64
    };
    let planes = large_planes(&samples, 1, |_| true);
    planes.into_iter().filter(holds).map(|p| (p.normal, p.offset)).collect()
}

/// The points that proposals are judged by, each coordinate by itself.
struct Judges {
    coordinates: [Vec<f64>; 3],
    /// How far each may be off a plane that it speaks for, metres.
    bands_m: Vec<f64>,
}

impl Judges {
    fn of<'a>(samples: impl Iterator<Item = &'a &'a Sample> + Clone) -> Judges {
        let axis = |k: usize| samples.clone().map(|s| s.point[k]).collect();
        let bands_m = samples.clone().map(|s| 2.0 * s.sigma_m + 0.004).collect();
        Judges { coordinates: [axis(0), axis(1), axis(2)], bands_m }
    }

    /// How many speak for the plane.
    fn near(&self, plane: &Plane) -> usize {
        let [x, y, z] = &self.coordinates;
        let points = x.iter().zip(y).zip(z).zip(&self.bands_m);
        let near = points.map(|(((x, y), z), band_m)| {
            let along = plane.normal.x * x + plane.normal.y * y + plane.normal.z * z;
            u64::from((along - plane.offset).abs() < *band_m)
        });
        near.sum::<u64>() as usize
    }
}

/// The best of planes through three neighbouring points.
fn propose(left: &[&Sample], rng: &mut Draws, plausible: &impl Fn(&Plane) -> bool) -> Option<Plane> {
    const REACH_M: f64 = 0.3;
    let mut boxes: FxHashMap<[i32; 3], Vec<u32>> = FxHashMap::default();
    let key = |p: &Point3<f64>| [p.x, p.y, p.z].map(|c| (c / REACH_M).floor() as i32);
    for (i, s) in left.iter().enumerate() {
        boxes.entry(key(&s.point)).or_default().push(i as u32);
    }
    let judges = Judges::of(left.iter().step_by((left.len() / 1500).max(1)));
    let mut best: Option<(usize, Plane)> = None;
    for _ in 0..PROPOSALS {
        let first = left[rng.below(left.len())];
        let Some(near) = boxes.get(&key(&first.point)) else { continue };
        let mut pick = || left[near[rng.below(near.len())] as usize].point;
        let (b, c) = (pick(), pick());
        let Some(normal) = (b - first.point).cross(&(c - first.point)).try_normalize(1e-4) else { continue };
        let plane = Plane { normal, offset: normal.dot(&first.point.coords) };
        if !plausible(&plane) {
            continue;
        }
        let count = judges.near(&plane);
        if best.as_ref().is_none_or(|(n, _)| count > *n) {
            best = Some((count, plane));
        }
    }
    best.map(|(_, plane)| plane)
}

/// Weighted least squares on the points near the plane, repeated with a narrowing band.
fn refine(mut plane: Plane, samples: &[&Sample]) -> Option<Plane> {
    for band in [4.0, 3.0, 2.5, 2.5] {
        let near = samples.iter().filter(|s| plane.distance(&s.point).abs() < band * s.sigma_m + 0.003);
        plane = least_squares(near.map(|s| (s.point, s.sigma_m)), &plane.normal)?;
    }
    Some(plane)
}

fn least_squares(points: impl Iterator<Item = (Point3<f64>, f64)>, side: &Vector3<f64>) -> Option<Plane> {
    let (mut weight, mut sum, mut moments) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for (p, sigma_m) in points {
        let w = 1.0 / (sigma_m * sigma_m);
        weight += w;
        sum += w * p.coords;
        moments += w * p.coords * p.coords.transpose();
    }
    if weight <= 0.0 {
        return None;
    }
    let mean = sum / weight;
    let eigen = (moments / weight - mean * mean.transpose()).symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let normal: Vector3<f64> = eigen.eigenvectors.column(least).into_owned();
    let normal = if normal.dot(side) < 0.0 { -normal } else { normal };
    let offset = normal.dot(&mean);
    normal.iter().all(|c| c.is_finite()).then_some(Plane { normal, offset })
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
    let flat = |p: &Point3<f64>| turn * p;
    let mut cells: FxHashMap<[i32; 2], u32> = FxHashMap::default();
    let on_plane = |s: &&Sample| plane.distance(&s.point).abs() < 3.0 * s.sigma_m + 0.004;
    let cell_of = |q: &Point3<f64>| [(q.x / CELL_M).floor() as i32, (q.y / CELL_M).floor() as i32];
    let mut squares = 0.0;
    for s in samples.iter().filter(on_plane) {
        *cells.entry(cell_of(&flat(&s.point))).or_default() += 1;
        squares += plane.distance(&s.point).powi(2);
    }
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

/// The largest set of cells that hang together over gaps of up to two cells (shadows of objects); ties go to the first in order.
pub(crate) fn largest_part(cells: &FxHashMap<[i32; 2], u32>) -> Vec<[i32; 2]> {
    let mut order: Vec<[i32; 2]> = cells.keys().copied().collect();
    order.sort_unstable();
    let mut seen: FxHashMap<[i32; 2], ()> = FxHashMap::default();
    let (mut best, mut most) = (Vec::new(), 0);
    for &start in &order {
        if seen.insert(start, ()).is_some() {
            continue;
        }
        let (mut part, mut count, mut open) = (Vec::new(), 0, vec![start]);
        while let Some(cell) = open.pop() {
            part.push(cell);
            count += cells[&cell];
            for dx in -2..=2 {
                for dy in -2..=2 {
                    let next = [cell[0] + dx, cell[1] + dy];
                    if cells.contains_key(&next) && seen.insert(next, ()).is_none() {
                        open.push(next);
                    }
                }
            }
        }
        if count > most {
            (best, most) = (part, count);
        }
    }
    best.sort_unstable();
    best
}

/// Corners of the convex hull, anticlockwise (Andrew's monotone chain).
pub(crate) fn convex_hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    drop_inner(&mut points);
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turns_right = |hull: &[[f64; 2]], p: &[f64; 2]| match hull {
        [.., a, b] => (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) <= 0.0,
        _ => false,
    };
    let half = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while turns_right(&chain, p) {
                chain.pop();
            }
            chain.push(*p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter());
    hull.extend(half(&mut points.iter().rev()));
    hull
}

/// Drops what lies well inside the octagon of the extreme points, which is no corner of the hull (Akl and Toussaint 1978).
fn drop_inner(points: &mut Vec<[f64; 2]>) {
    const WORTH_IT: usize = 64;
    const WAYS: [[f64; 2]; 8] = [
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [-1.0, 1.0],
        [-1.0, 0.0],
        [-1.0, -1.0],
        [0.0, -1.0],
        [1.0, -1.0],
    ];
    if points.len() < WORTH_IT {
        return;
    }
    let mut extreme = [(f64::NEG_INFINITY, points[0]); 8];
    for p in points.iter() {
        for (far, way) in extreme.iter_mut().zip(&WAYS) {
            let reach = way[0] * p[0] + way[1] * p[1];
            if reach > far.0 {
                *far = (reach, *p);
            }
        }
    }
    // The box between the corners that reach farthest at a slant lies in the octagon, and holds most points.
    let [_, (_, ne), _, (_, nw), _, (_, sw), _, (_, se)] = extreme;
    let (west, east) = (nw[0].max(sw[0]), ne[0].min(se[0]));
    let (south, north) = (sw[1].max(se[1]), nw[1].min(ne[1]));
    points.retain(|p| !(p[0] > west && p[0] < east && p[1] > south && p[1] < north));
    let mut octagon: Vec<[f64; 2]> = extreme.iter().map(|(_, p)| *p).collect();
    octagon.dedup();
    if octagon.len() < 3 {
        return;
    }
    points.retain(|p| {
        !(0..octagon.len()).all(|i| {
            let (a, b) = (octagon[i], octagon[(i + 1) % octagon.len()]);
            a == b || (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 1e-12
        })
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A corner between every two neighbours and nothing outside.
    fn check(points: Vec<[f64; 2]>, corners: usize) {
        let hull = convex_hull(points.clone());
        assert_eq!(hull.len(), corners, "{hull:?}");
        for i in 0..hull.len() {
            let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
            let left = |p: &[f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
            assert!(points.iter().all(|p| left(p) >= -1e-9), "{a:?} to {b:?}");
        }
    }

    #[test]
    fn hulls_of_many_points_of_one_place_and_of_a_line() {
        let circle = |i: i32| [(f64::from(i) * 0.1).cos(), (f64::from(i) * 0.1).sin()];
        let inside = (0..1000).map(|i| circle(i).map(|c| c * f64::from(i % 97) / 100.0));
        check((0..62).map(circle).chain(inside).collect(), 62);
        check((0..400).map(|i| [f64::from(i % 20), f64::from(i / 20)]).collect(), 4);
        check(vec![[0.3, 0.4]; 100], 1);
        check((0..100).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect(), 2);
    }
}
