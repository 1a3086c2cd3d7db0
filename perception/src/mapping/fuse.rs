//! Joining patches of one wall (section 4.3), preserving openings.

use super::cells::Facet;
use super::patch::{Constraints, Patch, PlaneEstimator, placed, through};
use crate::plane::Plane;
use nalgebra::Point3;

/// Conditions under which two patches belong to one wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FuseOptions {
    /// Maximum gap between the patches' limits (U_d), metres; it should exceed the distance at which patches grow, and
    /// be less than a door.
    pub gap_m: f64,
    /// Maximum distance of each patch from the other's plane, metres.
    pub across_m: f64,
    /// Maximum angle between the normals (U_o), radians.
    pub turned_rad: f64,
}

impl Default for FuseOptions {
    fn default() -> Self {
        FuseOptions { gap_m: 0.6, across_m: 0.15, turned_rad: 0.2 }
    }
}

/// Maximum number of passes over all patches; each joins matching ones.
const ROUNDS: usize = 8;

/// Joins patches of one wall, the largest first, until no two match or the passes are used up.
pub(super) fn fuse(
    facets: &[Facet],
    mut patches: Vec<Patch>,
    fit: PlaneEstimator,
    constraints: &Constraints,
    options: &FuseOptions,
    edge_m: f64,
) -> Vec<Patch> {
    for _ in 0..ROUNDS {
        let before = patches.len();
        patches.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2).then(a.facets.cmp(&b.facets)));
        let mut kept: Vec<Patch> = Vec::new();
        for patch in patches {
            match kept.iter().position(|k| belong(k, &patch, options)) {
                Some(at) => kept[at] = joined(facets, &kept[at], &patch, fit, constraints, edge_m),
                None => kept.push(patch),
            }
        }
        patches = kept;
        if patches.len() == before {
            break;
        }
    }
    patches
}

/// True if two patches are near, coplanar and equally oriented.
fn belong(a: &Patch, b: &Patch, options: &FuseOptions) -> bool {
    if a.plane.normal.dot(&b.plane.normal) < options.turned_rad.cos() {
        return false;
    }
    let gap_m = |k: usize| {
        let ends = corners(b).map(|c| {
            if k == 0 {
                (c - a.middle).dot(&a.along)
            } else {
                (c - a.middle).dot(&a.plane.normal.cross(&a.along))
            }
        });
        let (low, high) =
            ends.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let (from, to) = a.limits_m[k];
        (low - to).max(from - high).max(0.0)
    };
    if gap_m(0).hypot(gap_m(1)) > options.gap_m {
        return false;
    }
    // Where they are nearest, not where a small error of a normal has grown.
    let across = |a: &Patch, b: &Patch| {
        let nearest = |p: &Point3<f64>| {
            let (from, to) = b.limits_m[0];
            let foot = (p - b.middle).dot(&b.along).clamp(from, to);
            b.middle + b.along * foot
        };
        a.plane.height_m(&nearest(&a.middle)).abs()
    };
    across(a, b).min(across(b, a)) <= options.across_m
}

fn corners(patch: &Patch) -> [Point3<f64>; 4] {
    let up = patch.plane.normal.cross(&patch.along);
    let [(left, right), (low, high)] = patch.limits_m;
    [(left, low), (right, low), (right, high), (left, high)]
        .map(|(u, v)| patch.middle + patch.along * u + up * v)
}

fn joined(
    facets: &[Facet],
    a: &Patch,
    b: &Patch,
    fit: PlaneEstimator,
    constraints: &Constraints,
    edge_m: f64,
) -> Patch {
    let mut members: Vec<u32> = a.facets.iter().chain(&b.facets).copied().collect();
    members.sort_unstable();
    if fit == PlaneEstimator::LeastSquares {
        return through(facets, members, fit, constraints, edge_m);
    }
    let share = b.area_m2 / (a.area_m2 + b.area_m2);
    let normal = a.plane.normal.lerp(&b.plane.normal, share).normalize();
    let middle = a.middle + (b.middle - a.middle) * share;
    placed(facets, members, Plane::through(&middle, constraints.keep(&normal)), middle, edge_m)
}
