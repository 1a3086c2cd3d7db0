//! Poses of groups of scans with the least violation of their angular constraints.

use super::least_squares::{least_squares, roughly};
use super::simplex::simplex;
use super::violation::{Assembly, Kind, Residual};
use nalgebra::{Isometry2, Rotation2, Translation2, UnitComplex, Vector2};

/// Method of minimisation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solver {
    /// Levenberg-Marquardt on the separate errors and their derivatives.
    #[default]
    LeastSquares,
    /// Nelder-Mead downhill simplex (the paper's choice) on the objective's value alone.
    Simplex,
}

/// Objective to minimise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Objective {
    /// Boundary violation alone (Eq. 3). Many poses have none, because readings one degree apart bound an object
    /// loosely; which of these poses results is arbitrary, and models come out too large.
    Violation,
    /// Boundary violation plus a tie-breaker with a tenth of its weight: silhouettes lie midway between the last hit
    /// and the first miss, and poses stay near the given ones.
    Centred {
        /// Standard deviation of the given positions, metres.
        pose_sigma_m: f64,
        /// Standard deviation of the given headings, radians.
        pose_sigma_rad: f64,
    },
}

impl Default for Objective {
    fn default() -> Self {
        Objective::Centred { pose_sigma_m: 0.05, pose_sigma_rad: 0.01 }
    }
}

/// Weight of the tie-breaker among poses without violation.
const CENTRED: f64 = 0.1;
/// Standard deviation of a silhouette edge between two rays one degree apart at 1.5 m, metres:
/// their spacing over the square root of twelve.
const GAP_SIGMA_M: f64 = 0.0075;

/// Options of the solver: objective, minimiser, limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// Method of minimisation.
    pub solver: Solver,
    /// Objective to minimise.
    pub objective: Objective,
    /// Maximum number of iterations of least squares per round of annealing.
    pub most_iterations: usize,
    /// Maximum number of evaluations of the simplex per unknown; each movable pose has three.
    pub most_evaluations: usize,
    /// Relative decrease of the objective below which the solver has converged.
    pub settle: f64,
    /// Initial steps of the simplex: metres, and radians.
    pub simplex_steps: (f64, f64),
    /// Error length beyond which errors gain no further weight, metres (Geman and McClure 1987), so
    /// that a few false ends do not shift the other scans. Infinite: plain squares, as in Eq. 3.
    pub outlier_m: f64,
}

impl Default for SolverOptions {
    fn default() -> Self {
        SolverOptions {
            solver: Solver::LeastSquares,
            objective: Objective::default(),
            most_iterations: 100,
            most_evaluations: 400,
            settle: 1e-5,
            simplex_steps: (0.03, 0.02),
            outlier_m: f64::INFINITY,
        }
    }
}

/// Result of a solver.
#[derive(Clone, Debug)]
pub struct Solved {
    pub poses: Vec<Isometry2<f64>>,
    /// Objective at these poses.
    pub cost: f64,
    pub converged: bool,
    pub iterations: usize,
    /// Number of evaluations of the errors.
    pub evaluations: usize,
}

/// Minimisation problem: groups of scans, their initial poses, and the groups that may move.
pub struct Problem<'a> {
    assembly: &'a Assembly,
    start: &'a [Isometry2<f64>],
    movable: Vec<usize>,
    /// Weight of squared errors of [`Kind::Slack`].
    slack: f64,
    /// Weights of the squared shift (two components) and rotation of a group from its start.
    prior: [f64; 3],
    /// See [`SolverOptions::outlier_m`].
    outlier_m: f64,
}

impl<'a> Problem<'a> {
    /// Problem in which all groups may move.
    pub fn free(assembly: &'a Assembly, start: &'a [Isometry2<f64>], options: &SolverOptions) -> Problem<'a> {
        let movable = (0..start.len()).collect();
        let (slack, prior) = match options.objective {
            Objective::Violation => (0.0, [0.0; 3]),
            Objective::Centred { pose_sigma_m, pose_sigma_rad } => {
                let weight = |sigma: f64| CENTRED * (GAP_SIGMA_M / sigma.max(1e-6)).powi(2);
                (CENTRED, [weight(pose_sigma_m), weight(pose_sigma_m), weight(pose_sigma_rad)])
            }
        };
        Problem { assembly, start, movable, slack, prior, outlier_m: options.outlier_m }
    }

    /// Problem in which only the last group may move, without a prior on its pose.
    pub fn onto(assembly: &'a Assembly, start: &'a [Isometry2<f64>], options: &SolverOptions) -> Problem<'a> {
        let movable = vec![start.len() - 1];
        Problem { movable, prior: [0.0; 3], ..Problem::free(assembly, start, options) }
    }

    pub fn assembly(&self) -> &Assembly {
        self.assembly
    }

    pub fn start(&self) -> &[Isometry2<f64>] {
        self.start
    }

    pub fn movable(&self) -> &[usize] {
        &self.movable
    }

    /// Cost of an error, square metres, and the weight with which its square has the same slope; `wider`: factor on the
    /// outlier length.
    pub fn costs(&self, r: &Residual, wider: f64) -> (f64, f64) {
        let weight = if r.kind == Kind::Slack { self.slack } else { 1.0 };
        let share = 1.0 / (1.0 + (r.value_m / (wider * self.outlier_m)).powi(2));
        (weight * share * r.value_m * r.value_m, weight * share * share)
    }

    /// Shift (two components, metres) and rotation (radians) of a group from its start, each with the weight of its
    /// square.
    pub fn strayed(&self, poses: &[Isometry2<f64>], group: usize) -> impl Iterator<Item = (f64, f64)> {
        let pivot = self.assembly.pivot(group);
        let (from, to) = (&self.start[group], &poses[group]);
        let shift = to * pivot - from * pivot;
        [shift.x, shift.y, from.rotation.angle_to(&to.rotation)].into_iter().zip(self.prior)
    }

    /// Poses after moving each movable group by a shift (metres) and a rotation (radians) about its pivot.
    pub fn moved(&self, poses: &[Isometry2<f64>], by: &[f64]) -> Vec<Isometry2<f64>> {
        let mut moved = poses.to_vec();
        for (&group, by) in self.movable.iter().zip(by.chunks_exact(3)) {
            let pose = &poses[group];
            let pivot = (pose * self.assembly.pivot(group)).coords;
            let turn = Rotation2::new(by[2]);
            let shift = turn * (pose.translation.vector - pivot) + pivot + Vector2::new(by[0], by[1]);
            let rotation = UnitComplex::new(pose.rotation.angle() + by[2]);
            moved[group] = Isometry2::from_parts(Translation2::from(shift), rotation);
        }
        moved
    }

    /// Value of the objective, square metres.
    pub fn cost(&self, poses: &[Isometry2<f64>]) -> f64 {
        let mut sum = 0.0;
        let placed = self.assembly.placed(poses);
        self.assembly.residuals(&placed, 0.0, |r| sum += self.costs(&r, 1.0).0);
        let strayed = self.movable.iter().flat_map(|&group| self.strayed(poses, group));
        sum + strayed.map(|(off, weight)| weight * off * off).sum::<f64>()
    }
}

/// Relative decrease of the objective below which a coarse solution has converged.
const ROUGH: f64 = 0.05;

/// Runs the chosen solver.
pub(super) fn solve(problem: &Problem, options: &SolverOptions) -> Solved {
    match options.solver {
        Solver::LeastSquares => least_squares(problem, options),
        Solver::Simplex => by_simplex(problem, options),
    }
}

/// Solves the problem coarsely, to decide whether refinement pays.
pub(super) fn solve_roughly(problem: &Problem, options: &SolverOptions) -> Solved {
    let rough = SolverOptions { settle: options.settle.max(ROUGH), ..*options };
    match options.solver {
        Solver::LeastSquares => roughly(problem, &rough),
        Solver::Simplex => by_simplex(problem, &rough),
    }
}

fn by_simplex(problem: &Problem, options: &SolverOptions) -> Solved {
    let (step_m, step_rad) = options.simplex_steps;
    let steps = [step_m, step_m, step_rad].repeat(problem.movable.len());
    let cost = |by: &[f64]| problem.cost(&problem.moved(problem.start, by));
    let found = simplex(cost, &steps, options.most_evaluations * steps.len(), options.settle);
    Solved {
        poses: problem.moved(problem.start, &found.at),
        cost: found.cost,
        converged: found.converged,
        iterations: found.iterations,
        evaluations: found.evaluations,
    }
}
