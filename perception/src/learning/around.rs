//! Viewing positions around an object, and their order (section IV-A).

use super::error::LearningError;
use crate::cloud::is_finite;
use crate::neighbours::Neighbours;
use nalgebra::{Point2, Point3, Vector2};
use serde::{Deserialize, Serialize};

/// Options for choosing viewing positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AroundOptions {
    /// Number of radial lines from the object (paper: 20).
    pub lines: usize,
    /// Maximum distance of a position from the object's centre, metres (d_max; paper: 2 m).
    pub most_m: f64,
    /// Minimum distance from the object's centre, metres, for the camera to have the object in view.
    pub least_m: f64,
    /// Radius of the robot's base plus clearance, metres.
    pub footprint_m: f64,
    /// Minimum and maximum height of obstacles, metres.
    pub band_m: (f64, f64),
    /// Detour factor: a route longer than the straight line by more than this factor interrupts the tour around the
    /// object.
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

/// Spacing of the positions tried along a line, metres.
const STEP_M: f64 = 0.05;

/// Positions on each line where the body fits, nearest to the object first, in line order.
///
/// `obstacles`: observed points (world, z up, metres). A position is free if none of them is within the footprint.
/// Reachability is left to the route planner, which may keep the body farther away from obstacles.
///
/// # Errors
/// If an option is not positive, or there are more points than can be indexed.
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

/// Sequences of neighbouring positions that are reachable from one to the next without a detour, in the order of the
/// lines. `stands`: the position on each line, if any; `way_m`: length of the route between two positions, metres, or
/// `None` if there is none.
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

/// Sequence of poses of which one end is nearest to the robot by route, reversed if that end is its last; among ties the
/// longest, because camera tracking begins anew with each sequence (section IV-A of the paper on learning). `None` if no sequence is reachable.
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
