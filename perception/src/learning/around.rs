//! Viewpoints around an object, and their order (section IV-A).

use super::error::LearningError;
use crate::cloud::is_finite;
use crate::neighbours::Neighbours;
use nalgebra::{Point2, Point3, Vector2};
use serde::{Deserialize, Serialize};

/// Options for choosing stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AroundOptions {
    /// Radial lines from the object (paper: 20).
    pub lines: usize,
    /// Farthest stand from the middle of the object, metres (d_max; paper: 2 m).
    pub most_m: f64,
    /// Minimum distance from the object, metres, for the camera to have it in view.
    pub least_m: f64,
    /// Radius of the robot's base plus clearance, metres.
    pub footprint_m: f64,
    /// Minimum and maximum height of possible obstacles, metres.
    pub band_m: (f64, f64),
    /// Detour factor: a route longer than the straight line times this factor interrupts the tour
    /// around the object.
    pub detour: f64,
}

impl Default for AroundOptions {
    fn default() -> Self {
        AroundOptions {
            lines: 20,
            most_m: 2.0,
            least_m: 0.6,
            footprint_m: 0.35,
            band_m: (0.05, 1.5),
            detour: 1.5,
        }
    }
}

/// Steps along a line, metres.
const STEP_M: f64 = 0.05;

/// Nearest position on each line where the body fits, in line order.
///
/// `obstacles` is what was seen (world, z up, metres). A place counts as free if nothing seen is within the footprint; which of them can be reached
/// is asked of the ways: a body may keep farther away from what its map shows than it must.
///
/// # Errors
/// If an option is no positive number, or there are more points than can be indexed.
pub fn stands(
    object: &Point3<f64>,
    obstacles: &[Point3<f32>],
    options: &AroundOptions,
) -> Result<Vec<Vec<Point2<f64>>>, LearningError> {
    for (field, value) in [
        ("lines", options.lines as f64),
        ("most_m", options.most_m),
        ("least_m", options.least_m),
        ("footprint_m", options.footprint_m),
        ("detour", options.detour),
    ] {
        LearningError::positive(field, value)?;
    }
    let (low, high) = options.band_m;
    let hit = |p: &&Point3<f32>| is_finite(p) && (low..=high).contains(&f64::from(p.z));
    let flat: Vec<Point3<f32>> = obstacles.iter().filter(hit).map(|p| Point3::new(p.x, p.y, 0.0)).collect();
    let tree = Neighbours::new(&flat)?;
    let fits = |p: &Point2<f64>| {
        let at = Point3::new(p.x as f32, p.y as f32, 0.0);
        tree.nearest(&at, options.footprint_m as f32).is_none()
    };
    let steps = ((options.most_m - options.least_m) / STEP_M).max(0.0) as usize;
    let on_line = |line: usize| {
        let turn = std::f64::consts::TAU * line as f64 / options.lines as f64;
        let along = |k: usize| {
            object.xy() + Vector2::new(turn.cos(), turn.sin()) * (options.least_m + STEP_M * k as f64)
        };
        (0..=steps).map(along).filter(|p| fits(p)).collect()
    };
    Ok((0..options.lines).map(on_line).collect())
}

/// Sequences of neighbouring poses that are reachable without a detour, in the order of the lines.
/// `way_m`: length of the route between two places, metres, if there is one.
pub fn trajectories(
    stands: &[Option<Point2<f64>>],
    detour: f64,
    way_m: impl Fn(&Point2<f64>, &Point2<f64>) -> Option<f64>,
) -> Vec<Vec<Point2<f64>>> {
    let n = stands.len();
    let joined = |line: usize| match (stands[line], stands[(line + 1) % n]) {
        (Some(a), Some(b)) => way_m(&a, &b).is_some_and(|way| way <= detour * (b - a).norm() + 1e-9),
        _ => false,
    };
    let joints: Vec<bool> = (0..n).map(joined).collect();
    // Begins behind a cut, so that no string is torn at line 0; a full ring begins there.
    let first = joints.iter().position(|j| !j).map_or(0, |cut| cut + 1);
    let mut strings: Vec<Vec<Point2<f64>>> = Vec::new();
    let mut goes_on = false;
    for line in (first..first + n).map(|l| l % n) {
        if let Some(stand) = stands[line] {
            match strings.last_mut().filter(|_| goes_on) {
                Some(string) => string.push(stand),
                None => strings.push(vec![stand]),
            }
        }
        goes_on = joints[line];
    }
    strings
}

/// Sequence with an end nearest to the body, reversed if that end is its last; among ties the
/// longest, as the others cost camera tracking before they begin (section IV-A).
pub fn nearest(
    strings: &[Vec<Point2<f64>>],
    here: &Point2<f64>,
    way_m: impl Fn(&Point2<f64>, &Point2<f64>) -> Option<f64>,
) -> Option<Vec<Point2<f64>>> {
    let ends = strings.iter().filter(|s| !s.is_empty()).flat_map(|string| {
        let turned: Vec<Point2<f64>> = string.iter().rev().copied().collect();
        [string.clone(), turned]
    });
    let reached = ends.filter_map(|string| way_m(here, &string[0]).map(|way| (way, string)));
    let best = reached.min_by(|a, b| a.0.total_cmp(&b.0).then(b.1.len().cmp(&a.1.len())));
    best.map(|(_, string)| string)
}
