//! Loop closure and pose graph, the global correction that the paper leaves open (Fig. 9).

use super::error::{MappingError, check, check_pose};
use super::graph::{Edge, GraphError, PoseGraph, Settled};
use super::likelihood_field::Field;
use super::scan_matching::{PairFit, Prior, RectifyOptions, chained, fit_cut};
use super::station::{FieldOfView, Spot, Station, thinned};
use crate::pool;
use nalgebra::{Isometry2, Matrix2, Matrix3, Point2, Vector2};

/// Options for loop closures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosureOptions {
    /// Minimum length of the drive between the two stations of a loop closure, metres.
    pub apart_m: f64,
    /// Assumed drift of poses, as a share of the distance driven between two stations.
    pub drift: f64,
    /// Upper limit of the assumed drift of the position, metres.
    pub most_m: f64,
    /// Maximum heading difference of two stations of a loop closure, radians.
    pub turn_rad: f64,
    /// Maximum assumed drift of the heading, radians.
    pub heading_drift_rad: f64,
    /// Minimum share of the jointly visible plan points that must match.
    pub explained: f64,
    /// Length of the sections of the drive whose merged plans are compared, metres.
    pub stretch_m: f64,
    /// Distance driven between stations that are compared with earlier ones, metres.
    pub every_m: f64,
}

impl Default for ClosureOptions {
    fn default() -> Self {
        ClosureOptions {
            apart_m: 15.0,
            drift: 0.04,
            most_m: 3.0,
            turn_rad: 0.35,
            heading_drift_rad: 0.2,
            explained: 0.75,
            stretch_m: 8.0,
            every_m: 1.5,
        }
    }
}

impl ClosureOptions {
    fn check(&self) -> Result<(), MappingError> {
        check(&[
            ("apart_m", self.apart_m, 0.0, 1e6),
            ("drift", self.drift, 0.0, 1.0),
            ("most_m", self.most_m, 0.0, 50.0),
            ("heading_drift_rad", self.heading_drift_rad, 0.0, 4.0),
            ("stretch_m", self.stretch_m, 0.0, 1e3),
            ("every_m", self.every_m, 0.0, 1e6),
        ])
    }
}

/// Loop closure: a station that shows the same place as a much earlier one.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Index of the earlier station.
    pub from: usize,
    /// Index of the later station.
    pub to: usize,
    /// Relative pose of the two stations, with its information.
    pub fit: PairFit,
}

/// Coarse search: standard deviation of the likelihood field, metres; step of the position, metres; step of the
/// heading, radians.
const COARSE: (f64, f64, f64) = (0.2, 0.1, 0.03);
/// Maximum number of plan points by which a start pose is scored.
const SOME: usize = 400;
/// Standard deviations of the best start pose of the coarse search: position, metres, and heading, radians.
const START: (f64, f64) = (0.15, 0.05);
/// Start poses that score within the first value (mean log density) of the best, and lie farther from it than the
/// second, metres, compete with the fit.
const RIVAL: (f64, f64) = (0.1, 0.5);

/// Finds loop closures of a drive. `poses`: one per station, chained from pairwise fits.
///
/// # Errors
/// If an option or a pose is out of range.
pub fn closures(
    stations: &[Station],
    poses: &[Isometry2<f64>],
    rectify: &RectifyOptions,
    options: &ClosureOptions,
) -> Result<Vec<Closure>, MappingError> {
    let _span = tracing::debug_span!("closures", stations = stations.len()).entered();
    checked(poses, rectify, options)?;
    let poses = &poses[..poses.len().min(stations.len())];
    let plans: Vec<Vec<Spot>> =
        pool::map(stations, 1, |s| s.plan(&rectify.band_m, &rectify.field, rectify.thin_m));
    let ways = ways_m(poses);
    let around = |at: usize| Stretch::around(at, &plans, poses, &ways, rectify, options);
    let close = |to: usize| {
        let from = candidate(poses, &ways, to, options)?;
        let reach_m = reach_m(ways[to] - ways[from], options);
        let start = poses[from].inv_mul(&poses[to]);
        let fit = searched(&around(from), &around(to), &start, reach_m, rectify, options)?;
        Some(Closure { from, to, fit })
    };
    let looked_at = looked_at(&ways, options);
    Ok(pool::filter(looked_at.len(), 1, |n| close(looked_at[n])))
}

fn checked(
    poses: &[Isometry2<f64>],
    rectify: &RectifyOptions,
    options: &ClosureOptions,
) -> Result<(), MappingError> {
    rectify.check()?;
    options.check()?;
    poses.iter().enumerate().try_for_each(|(i, pose)| check_pose("station", i, pose))
}

/// Indices of the stations to be compared with earlier ones: one per `every_m` of distance driven. `ways`: distance
/// driven up to each station, metres.
fn looked_at(ways: &[f64], options: &ClosureOptions) -> Vec<usize> {
    let mut last = 0.0;
    (0..ways.len())
        .filter(|&i| {
            let due = ways[i] - last >= options.every_m;
            last = if due { ways[i] } else { last };
            due
        })
        .collect()
}

/// Merged plan of a section of the drive, in the frame of its middle station.
struct Stretch {
    spots: Vec<Spot>,
    /// Poses of the section's stations in the section's frame.
    here_from_level: Vec<Isometry2<f64>>,
    field: FieldOfView,
}

impl Stretch {
    fn around(
        at: usize,
        plans: &[Vec<Spot>],
        poses: &[Isometry2<f64>],
        ways: &[f64],
        rectify: &RectifyOptions,
        options: &ClosureOptions,
    ) -> Stretch {
        let near = (0..poses.len()).filter(|&i| (ways[i] - ways[at]).abs() <= 0.5 * options.stretch_m);
        Stretch::of(near.map(|i| (&plans[i], poses[at].inv_mul(&poses[i]))), rectify)
    }

    /// Merges the plans of several stations, each with its pose.
    fn of<'a>(
        plans: impl Iterator<Item = (&'a Vec<Spot>, Isometry2<f64>)> + Clone,
        rectify: &RectifyOptions,
    ) -> Stretch {
        let put = plans
            .clone()
            .flat_map(|(plan, pose)| plan.iter().map(move |s| Spot { at: pose * s.at, weight: s.weight }));
        let spots = thinned(put, rectify.thin_m);
        Stretch { spots, here_from_level: plans.map(|(_, pose)| pose).collect(), field: rectify.field }
    }

    /// True if a place is in the field of view of one of the stations.
    fn sees(&self, place: &Point2<f64>) -> bool {
        self.here_from_level.iter().any(|pose| self.field.sees(&pose.inverse_transform_point(place)))
    }

    /// Plan points that are also in the other section's field of view, at the given relative pose.
    fn shared(&self, other_from_here: &Isometry2<f64>, other: &Stretch) -> Vec<Spot> {
        self.spots.iter().filter(|s| other.sees(&(other_from_here * s.at))).copied().collect()
    }
}

/// Localises one drive in another, searching around a rough pose within `options.most_m` and
/// `options.heading_drift_rad`. `before`, `after`: stations with their poses in the frame of their drive. `None` if too
/// little matches, or the result is ambiguous.
///
/// # Errors
/// If an option or a pose is out of range.
pub fn relocate(
    before: (&[Station], &[Isometry2<f64>]),
    after: (&[Station], &[Isometry2<f64>]),
    start: &Isometry2<f64>,
    rectify: &RectifyOptions,
    options: &ClosureOptions,
) -> Result<Option<PairFit>, MappingError> {
    checked(before.1, rectify, options)?;
    checked(after.1, rectify, options)?;
    check_pose("start", 0, start)?;
    let stretch = |(stations, poses): (&[Station], &[Isometry2<f64>])| {
        let plans: Vec<Vec<Spot>> =
            pool::map(stations, 1, |s| s.plan(&rectify.band_m, &rectify.field, rectify.thin_m));
        Stretch::of(plans.iter().zip(poses.iter().copied()), rectify)
    };
    Ok(searched(&stretch(before), &stretch(after), start, options.most_m, rectify, options))
}

/// Optimised poses of a drive from pairwise fits of consecutive stations and loop closures.
///
/// # Errors
/// If a closure names a station beyond those of `pairs`, or a fit is not finite.
pub fn correct_drive(pairs: &[PairFit], closures: &[Closure]) -> Result<Settled, GraphError> {
    let edge = |from: usize, to: usize, fit: &PairFit, doubtful: bool| Edge {
        from,
        to,
        from_from_to: fit.before_from_after,
        information: fit.information,
        doubtful,
    };
    let steps = pairs.iter().enumerate().map(|(i, fit)| edge(i, i + 1, fit, false));
    let again = closures.iter().map(|c| edge(c.from, c.to, &c.fit, true));
    PoseGraph { poses: chained(pairs), edges: steps.chain(again).collect() }.settle()
}

/// Distance driven up to each pose, metres.
fn ways_m(poses: &[Isometry2<f64>]) -> Vec<f64> {
    let mut way = 0.0;
    let mut last = poses.first().map_or(Vector2::zeros(), |p| p.translation.vector);
    let up_to = |pose: &Isometry2<f64>| {
        way += (pose.translation.vector - last).norm();
        last = pose.translation.vector;
        way
    };
    poses.iter().map(up_to).collect()
}

fn reach_m(way_m: f64, options: &ClosureOptions) -> f64 {
    (0.3 + options.drift * way_m).min(options.most_m)
}

/// Index of the nearest earlier station that may show the same place as station `to`; `None` if there is none.
fn candidate(poses: &[Isometry2<f64>], ways: &[f64], to: usize, options: &ClosureOptions) -> Option<usize> {
    let apart = |from: usize| (poses[from].translation.vector - poses[to].translation.vector).norm();
    let near = (0..to)
        .filter(|&from| ways[to] - ways[from] > options.apart_m)
        .filter(|&from| apart(from) < reach_m(ways[to] - ways[from], options))
        .filter(|&from| poses[from].rotation.angle_to(&poses[to].rotation).abs() < options.turn_rad);
    near.min_by(|&a, &b| apart(a).total_cmp(&apart(b)))
}

/// Fit from the best start pose within reach; `None` if it explains too little of the plan. If start poses along a line
/// score equally (a bare corridor), the fit has no information along that line; if they do in all directions, it is
/// rejected.
fn searched(
    before: &Stretch,
    after: &Stretch,
    start: &Isometry2<f64>,
    reach_m: f64,
    rectify: &RectifyOptions,
    options: &ClosureOptions,
) -> Option<PairFit> {
    let scores = scores(before, after, start, reach_m, options)?;
    let (score, best) = scores.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let near = RectifyOptions { way_sigma: (0.0, START.0), turn_sigma_rad: START.1, ..rectify.clone() };
    let (seen, moved) = (before.shared(&best.inverse(), after), after.shared(&best, before));
    let mut found = fit_cut(&seen, &moved, &best, &near);
    if found.explained < options.explained {
        return None;
    }
    // What was only a start is no measurement.
    found.information -= Prior::of(&best, &near).information();
    let rivals = scores.iter().filter(|(s, _)| *s > score - RIVAL.0);
    let off = rivals.map(|(_, pose)| pose.translation.vector - best.translation.vector);
    let spread = off.clone().fold(Matrix2::zeros(), |sum, d| sum + d * d.transpose());
    let eigen = spread.symmetric_eigen();
    let along = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let (longest_m, widest_m) = off.fold((0.0_f64, 0.0_f64), |(long, wide), d| {
        (long.max(d.dot(&along).abs()), wide.max(d.perp(&along).abs()))
    });
    if widest_m > RIVAL.1 {
        return None;
    }
    if longest_m > RIVAL.1 {
        let along = along.push(0.0);
        let across = Matrix3::identity() - along * along.transpose();
        found.information = across * found.information * across;
    }
    Some(found)
}

/// Scores (mean log density where both sections could see) of all start poses within reach; `None` without plan points.
fn scores(
    before: &Stretch,
    after: &Stretch,
    start: &Isometry2<f64>,
    reach_m: f64,
    options: &ClosureOptions,
) -> Option<Vec<(f64, Isometry2<f64>)>> {
    let mut field = Field::of(&before.spots, COARSE.0)?;
    field.look(|place| before.sees(place));
    let (shift, turn) =
        ((reach_m / COARSE.1).ceil() as i32, (options.heading_drift_rad / COARSE.2).ceil() as i32);
    let some: Vec<Spot> = after.spots.iter().step_by(after.spots.len() / SOME + 1).copied().collect();
    let at_heading = |k: i32| {
        let angle = start.rotation.angle() + f64::from(k) * COARSE.2;
        let shifts = (-shift..=shift).flat_map(|i| (-shift..=shift).map(move |j| (i, j)));
        let bys = shifts.map(|(i, j)| Vector2::new(f64::from(i), f64::from(j)) * COARSE.1);
        let poses = bys
            .filter(|by| by.norm() <= reach_m)
            .map(|by| Isometry2::new(start.translation.vector + by, angle));
        poses.filter_map(|pose| Some((field.mean_of_seen(&some, &pose)?, pose))).collect::<Vec<_>>()
    };
    let headings: Vec<i32> = (-turn..=turn).collect();
    Some(pool::map(&headings, 1, |k| at_heading(*k)).into_iter().flatten().collect())
}
