//! Model alignment and localisation: pose of one model relative to another with the least mutual violation (Eq. 4).

use super::scan::{direction, origin};
use super::shape::{ObjectScan, PosedScan, ShapeModel};
use super::solve::{Problem, Solved, SolverOptions, solve, solve_roughly};
use super::violation::{Assembly, Violation};
use nalgebra::{Isometry2, Vector2};
use std::f64::consts::TAU;

/// Options for aligning two models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Options of the solver.
    pub solver: SolverOptions,
    /// Number of headings to start from, evenly spaced.
    pub starts: usize,
    /// Maximum number of starts, local minima of the violation, that are optimised.
    pub followed: usize,
    /// Violation of the best coarse solution above which it is not refined, metres as [`Violation::per_pair_m`].
    pub hopeless_m: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        FitOptions { solver: SolverOptions::default(), starts: 36, followed: 6, hopeless_m: f64::INFINITY }
    }
}

/// Initial pose of the laser in localisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Known approximate pose.
    Near(Isometry2<f64>),
    /// Unknown pose: all headings of the laser are tried, at the distance of the scan's nearest reading from the
    /// model's hull.
    AllAngles,
}

/// Pose of another model, or of a laser, relative to a model.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelFit {
    /// Pose of the other model's frame, or of the laser, in the model's frame.
    pub model_from_other: Isometry2<f64>,
    /// Boundary violation of all scans of both together, square metres (f_C of Eq. 4).
    pub f_c_m2: f64,
    /// Violation between scans of the one model and of the other, part of `f_c_m2`.
    pub between: Violation,
    /// True if the solver converged; false at the iteration limit.
    pub converged: bool,
    /// Number of iterations of the solver, over all optimised starts.
    pub iterations: usize,
    /// Number of evaluations of the violation, starts included.
    pub evaluations: usize,
    /// Other local minima, best first: pose as `model_from_other`, and mutual violation, square metres. Symmetric
    /// shapes have several.
    pub rivals: Vec<(Isometry2<f64>, f64)>,
}

/// Difference below which two minima count as one, metres and radians.
const SAME: (f64, f64) = (0.01, 0.05);

/// Aligns a model with another, starting from several headings with coinciding hull centres.
pub fn fit(model: &ShapeModel, other: &ShapeModel, options: &FitOptions) -> ModelFit {
    let _span = tracing::debug_span!("fit").entered();
    let (to, from) = (model.features().centre, other.features().centre);
    let starts: Vec<Isometry2<f64>> = turns(options.starts)
        .map(|turn| Isometry2::new(to.coords, turn) * Isometry2::new(-from.coords, 0.0))
        .collect();
    follow(model, other.scans(), &starts, options)
}

/// Localises a scan relative to the model of the object it shows: pose of the laser in the model's
/// frame.
///
/// With [`Start::AllAngles`], several headings are tried, each with the scan's nearest reading on the side of the hull
/// that faces the laser.
pub fn localise(model: &ShapeModel, scan: &ObjectScan, start: Start, options: &FitOptions) -> ModelFit {
    let _span = tracing::debug_span!("localise").entered();
    let starts = match start {
        Start::Near(model_from_laser) => vec![model_from_laser],
        Start::AllAngles => facing(model, scan, options.starts),
    };
    let posed = PosedScan { scan: scan.clone(), model_from_laser: Isometry2::identity() };
    follow(model, std::slice::from_ref(&posed), &starts, options)
}

/// Registers scans of one object, possibly from one side only, to a complete model, starting from several headings,
/// each with the nearest reading of the fullest scan on the facing side of the hull.
pub fn fit_scans(model: &ShapeModel, scans: &ShapeModel, options: &FitOptions) -> ModelFit {
    let _span = tracing::debug_span!("fit_scans", scans = scans.scans().len()).entered();
    let most = scans.scans().iter().max_by_key(|s| s.scan.points.len());
    let starts: Vec<Isometry2<f64>> = most.map_or_else(Vec::new, |posed| {
        let laser_from_scans = posed.model_from_laser.inverse();
        facing(model, &posed.scan, options.starts).iter().map(|laser| laser * laser_from_scans).collect()
    });
    follow(model, scans.scans(), &starts, options)
}

fn turns(count: usize) -> impl Iterator<Item = f64> {
    (0..count.max(1)).map(move |i| TAU * i as f64 / count.max(1) as f64)
}

/// Poses of a laser all around a model, facing it, with the scan's nearest reading on the facing side of the hull.
fn facing(model: &ShapeModel, scan: &ObjectScan, count: usize) -> Vec<Isometry2<f64>> {
    let hull = model.hull();
    let centre = hull.centre();
    let middle = 0.5 * (scan.left_bound_rad + scan.right_bound_rad);
    let ahead = direction(middle);
    let nearest_m = scan.points.iter().map(|p| p.coords.dot(&ahead)).fold(f64::INFINITY, f64::min);
    turns(count)
        .map(|turn| {
            let looks: Vector2<f64> = direction(turn);
            let depth_m = hull.corners.iter().map(|c| looks.dot(&(centre - c))).fold(0.0, f64::max);
            let laser = centre - looks * (nearest_m + depth_m);
            Isometry2::new(laser.coords, turn - middle)
        })
        .collect()
}

/// Number of coarse solutions that are refined.
const SETTLED: usize = 2;

/// Optimises the most promising starts coarsely and refines the best results.
fn follow(
    model: &ShapeModel,
    other: &[PosedScan],
    starts: &[Isometry2<f64>],
    options: &FitOptions,
) -> ModelFit {
    let assembly = Assembly::new([model.scans(), other]);
    let poses = |pose: &Isometry2<f64>| [Isometry2::identity(), *pose];
    let violation = |pose: &Isometry2<f64>| assembly.violation(&poses(pose)).boundary_m2;
    let (mut iterations, mut evaluations) = (0, starts.len());
    let mut settle = |from: &Isometry2<f64>, solve: fn(&Problem, &SolverOptions) -> Solved| {
        let start = poses(from);
        let solved = solve(&Problem::onto(&assembly, &start, &options.solver), &options.solver);
        iterations += solved.iterations;
        evaluations += solved.evaluations;
        solved
    };
    let violations: Vec<f64> = starts.iter().map(violation).collect();
    let promising = promising(&violations, options.followed);
    let mut ends: Vec<Solved> = promising.map(|start| settle(&starts[start], solve_roughly)).collect();
    ends.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let is_hopeless = assembly.violation(&ends[0].poses).per_pair_m() > options.hopeless_m;
    for end in ends.iter_mut().take(if is_hopeless { 0 } else { SETTLED }) {
        *end = settle(&end.poses[1], solve);
    }
    ends.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let (best, converged) = (ends[0].poses[1], ends[0].converged);
    let mut rivals: Vec<(Isometry2<f64>, f64)> = Vec::new();
    for pose in ends[1..].iter().map(|end| end.poses[1]) {
        if !same(&pose, &best) && rivals.iter().all(|(other, _)| !same(&pose, other)) {
            rivals.push((pose, violation(&pose)));
        }
    }
    let between = assembly.violation(&poses(&best));
    let f_c_m2 = between.boundary_m2 + within(model.scans()) + within(other);
    ModelFit { model_from_other: best, f_c_m2, between, converged, iterations, evaluations, rivals }
}

fn same(a: &Isometry2<f64>, b: &Isometry2<f64>) -> bool {
    (origin(a) - origin(b)).norm() < SAME.0 && a.rotation.angle_to(&b.rotation).abs() < SAME.1
}

/// Boundary violation among one model's scans, square metres.
fn within(scans: &[PosedScan]) -> f64 {
    let assembly = Assembly::new(scans.iter().map(std::slice::from_ref));
    assembly.violation(&vec![Isometry2::identity(); scans.len()]).boundary_m2
}

/// Indices of at most `most` local minima in a ring of violations, lowest first; the first index if there are none.
fn promising(violations: &[f64], most: usize) -> impl Iterator<Item = usize> {
    let n = violations.len();
    let (before, after) = (|i: usize| violations[(i + n - 1) % n], |i: usize| violations[(i + 1) % n]);
    let mut low: Vec<usize> =
        (0..n).filter(|&i| violations[i] <= before(i) && violations[i] <= after(i)).collect();
    low.sort_by(|&a, &b| violations[a].total_cmp(&violations[b]));
    if low.is_empty() {
        low.push(0);
    }
    low.into_iter().take(most.max(1))
}
