//! Patches of adjacent facets, and the planes through them (section 4.2).

use super::cells::Facet;
use crate::plane::{self, Plane};
use crate::quantile::median;
use nalgebra::{Matrix2, Point3, Vector2, Vector3};
use rustc_hash::{FxHashMap, FxHashSet};
use std::f64::consts::FRAC_PI_2;

/// Method of fitting planes to patches and joining them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PlaneEstimator {
    /// The paper's method: median of normals and centroid; joined planes average both by area.
    Median,
    /// Least squares of the distances of all facets.
    #[default]
    LeastSquares,
}

/// Prior knowledge of a building (section 4.4), applied when planes are fitted and joined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constraints {
    /// True if walls are made upright.
    pub upright: bool,
    /// Direction of most walls' normals, modulo a quarter turn, radians; nearly parallel or perpendicular walls are
    /// snapped to it. `None`: no snapping.
    pub main_rad: Option<f64>,
    /// Maximum angle from `main_rad`, modulo a quarter turn, at which a wall is snapped to it, radians.
    pub within_rad: f64,
}

/// Adjacent facets and the plane through them.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    pub plane: Plane,
    /// Centroid on the plane.
    pub middle: Point3<f64>,
    /// Horizontal unit vector in the plane.
    pub along: Vector3<f64>,
    /// Minimum and maximum extent of the patch from its centre, metres: along `along`, then up.
    pub limits_m: [(f64, f64); 2],
    pub area_m2: f64,
    /// Indices of the facets, ascending.
    pub facets: Vec<u32>,
}

/// Conditions under which two facets belong to one patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Growth {
    /// Maximum distance between neighbouring facets, metres (λ).
    pub within_m: f64,
    /// Maximum distance between neighbouring facets along the normal, metres.
    pub across_m: f64,
    /// Maximum angle, radians, between a facet's normal and that of the patch's orientation, or of its first facet if
    /// no orientation is given.
    pub turned_rad: f64,
}

/// Groups adjacent facets of `members` whose normals are near `normal`; without it, near that of the group's first
/// facet. Returns the indices of each group's facets.
pub(super) fn grow(
    facets: &[Facet],
    members: &[u32],
    normal: Option<Vector3<f64>>,
    growth: &Growth,
) -> Vec<Vec<u32>> {
    let bucket = |p: &Point3<f64>| [0, 1, 2].map(|k| (p[k] / growth.within_m).floor() as i32);
    let mut buckets: FxHashMap<[i32; 3], Vec<u32>> = FxHashMap::default();
    members.iter().for_each(|&m| buckets.entry(bucket(&facets[m as usize].at)).or_default().push(m));
    let mut taken: FxHashSet<u32> = FxHashSet::default();
    let mut patches = Vec::new();
    let cosine = growth.turned_rad.cos();
    for &first in members {
        if !taken.insert(first) {
            continue;
        }
        let own = facets[first as usize].normal;
        let across = normal.map_or(own, |n| n * own.dot(&n).signum());
        let mut patch = vec![first];
        let mut next = 0;
        while next < patch.len() {
            let at = facets[patch[next] as usize].at;
            next += 1;
            let [x, y, z] = bucket(&at);
            for key in (0..27).map(|i| [x + i / 9 - 1, y + i / 3 % 3 - 1, z + i % 3 - 1]) {
                for &other in buckets.get(&key).into_iter().flatten() {
                    let facet = &facets[other as usize];
                    let off = facet.at - at;
                    let is_near = off.norm_squared() <= growth.within_m * growth.within_m;
                    if is_near
                        && off.dot(&across).abs() <= growth.across_m
                        && facet.normal.dot(&across) >= cosine
                        && taken.insert(other)
                    {
                        patch.push(other);
                    }
                }
            }
        }
        patch.sort_unstable();
        patches.push(patch);
    }
    patches
}

impl Constraints {
    /// Unit normal closest to the given one that satisfies the constraints.
    pub fn keep(&self, normal: &Vector3<f64>) -> Vector3<f64> {
        let level = Vector3::new(normal.x, normal.y, 0.0).try_normalize(1e-6);
        let Some(level) = level.filter(|_| self.upright) else { return *normal };
        let Some(main) = self.main_rad else { return level };
        let off = (level.y.atan2(level.x) - main + 0.5 * FRAC_PI_2).rem_euclid(FRAC_PI_2) - 0.5 * FRAC_PI_2;
        if off.abs() > self.within_rad {
            return level;
        }
        let (sin, cos) = off.sin_cos();
        Vector3::new(cos * level.x + sin * level.y, cos * level.y - sin * level.x, 0.0)
    }
}

/// Patch with the best plane through its facets; `edge_m` is the edge of the squares that measure its area.
pub(super) fn through(
    facets: &[Facet],
    members: Vec<u32>,
    fit: PlaneEstimator,
    constraints: &Constraints,
    edge_m: f64,
) -> Patch {
    let of = || members.iter().map(|&m| &facets[m as usize]);
    let middle = Point3::from(of().map(|f| f.at.coords).sum::<Vector3<f64>>() / members.len().max(1) as f64);
    let side = of().map(|f| f.normal).sum::<Vector3<f64>>();
    let normal = match fit {
        PlaneEstimator::Median => median_direction(&members, |m| facets[m as usize].normal),
        PlaneEstimator::LeastSquares if constraints.upright => least_upright(of(), &middle),
        PlaneEstimator::LeastSquares => {
            let points: Vec<Point3<f32>> = of().map(|f| f.at.cast()).collect();
            plane::refit(&points).map(|p| p.normal)
        }
    };
    let normal = normal.or_else(|| side.try_normalize(0.0)).unwrap_or_else(Vector3::x);
    let normal = constraints.keep(&if normal.dot(&side) < 0.0 { -normal } else { normal });
    placed(facets, members, Plane::through(&middle, normal), middle, edge_m)
}

/// Patch on a given plane, with extent and area; its centre is the projection of `near`.
pub(super) fn placed(
    facets: &[Facet],
    members: Vec<u32>,
    plane: Plane,
    near: Point3<f64>,
    edge_m: f64,
) -> Patch {
    let middle = near - plane.normal * plane.height_m(&near);
    let along = Vector3::z().cross(&plane.normal).try_normalize(1e-6).unwrap_or_else(Vector3::x);
    let up = plane.normal.cross(&along);
    let mut limits_m = [(f64::INFINITY, f64::NEG_INFINITY); 2];
    let mut squares: FxHashSet<(i32, i32)> = FxHashSet::default();
    for m in &members {
        let off = facets[*m as usize].at - middle;
        let places = [off.dot(&along), off.dot(&up)];
        for (limit, place) in limits_m.iter_mut().zip(places) {
            *limit = (limit.0.min(place), limit.1.max(place));
        }
        squares.insert(((places[0] / edge_m).floor() as i32, (places[1] / edge_m).floor() as i32));
    }
    let area_m2 = squares.len() as f64 * edge_m * edge_m;
    Patch { plane, middle, along, limits_m, area_m2, facets: members }
}

/// Unit vector of the median of each coordinate of the normals; `None` if the medians are nearly zero.
fn median_direction(members: &[u32], normal: impl Fn(u32) -> Vector3<f64>) -> Option<Vector3<f64>> {
    let axis = |k: usize| median(members.iter().map(|&m| normal(m)[k]));
    Vector3::new(axis(0), axis(1), axis(2)).try_normalize(1e-6)
}

/// Horizontal direction of least spread of the facets; `None` if the spread is similar in all directions, as of a post.
fn least_upright<'a>(facets: impl Iterator<Item = &'a Facet>, middle: &Point3<f64>) -> Option<Vector3<f64>> {
    let mut spread = Matrix2::zeros();
    for facet in facets {
        let off: Vector2<f64> = (facet.at - middle).xy();
        spread += off * off.transpose();
    }
    let eigen = spread.symmetric_eigen();
    let [least, most] = [eigen.eigenvalues.min(), eigen.eigenvalues.max()];
    // A post is no plane: its normals tell.
    (least < 0.5 * most).then(|| eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned().push(0.0))
}

/// Direction of most wall normals by area, modulo a quarter turn, radians; `None` unless 60 % of the area lies within
/// `within_rad` of it.
pub(super) fn main_direction(patches: &[Patch], within_rad: f64) -> Option<f64> {
    const BINS: usize = 90;
    let direction = |p: &Patch| p.plane.normal.y.atan2(p.plane.normal.x).rem_euclid(FRAC_PI_2);
    let off = |a: f64, b: f64| (a - b + 0.5 * FRAC_PI_2).rem_euclid(FRAC_PI_2) - 0.5 * FRAC_PI_2;
    let all: f64 = patches.iter().map(|p| p.area_m2).sum();
    let near = |centre: f64| patches.iter().filter(move |p| off(direction(p), centre).abs() <= within_rad);
    let held = |centre: f64| near(centre).map(|p| p.area_m2).sum::<f64>();
    let centres = (0..BINS).map(|bin| (bin as f64 + 0.5) / BINS as f64 * FRAC_PI_2);
    let mut best = centres.max_by(|a, b| held(*a).total_cmp(&held(*b)))?;
    if held(best) < 0.6 * all || all <= 0.0 {
        return None;
    }
    for _ in 0..5 {
        // A direction is the better known the longer the patch: its spread falls with the third power of the length.
        let weight = |p: &Patch| p.area_m2 * (p.limits_m[0].1 - p.limits_m[0].0).powi(2);
        let (sum, weights) =
            near(best).fold((0.0, 0.0), |(s, w), p| (s + weight(p) * off(direction(p), best), w + weight(p)));
        best = (best + sum / f64::max(weights, f64::MIN_POSITIVE)).rem_euclid(FRAC_PI_2);
    }
    Some(best)
}
