//! Poses of groups of scans that violate their angular constraints least.

use super::least_squares::least_squares;
use super::simplex::simplex;
use super::violation::Assembly;
use nalgebra::{Isometry2, Rotation2, Translation2, UnitComplex, Vector2};

/// How the violation is minimised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solver {
    /// Levenberg's and Marquardt's method on the errors, whose derivatives are known.
    #[default]
    LeastSquares,
    /// The downhill simplex of Nelder and Mead (the paper's choice), on the sum alone.
    Simplex,
}

/// How long to go on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// Which solver.
    pub solver: Solver,
    /// Most iterations of least squares.
    pub most_iterations: usize,
    /// Most evaluations of the simplex, for each of three numbers a group.
    pub most_evaluations: usize,
    /// Settled if the boundary violation falls by less than this part of it.
    pub settle: f64,
    /// First steps of the simplex: metres, and radians.
    pub simplex_steps: (f64, f64),
}

impl Default for SolverOptions {
    fn default() -> Self {
        SolverOptions {
            solver: Solver::LeastSquares,
            most_iterations: 100,
            most_evaluations: 400,
            settle: 1e-6,
            simplex_steps: (0.03, 0.02),
        }
    }
}

/// Where a solver ended.
#[derive(Clone, Debug)]
pub(super) struct Solved {
    pub poses: Vec<Isometry2<f64>>,
    pub converged: bool,
    pub iterations: usize,
    /// Times the violation was computed.
    pub evaluations: usize,
}

/// Which groups may move; the others stay where they are.
pub(super) struct Problem<'a> {
    pub assembly: &'a Assembly,
    pub start: &'a [Isometry2<f64>],
    pub movable: Vec<usize>,
}

impl Problem<'_> {
    /// The poses after a shift (metres) and a turn (radians) of each movable group about its pivot.
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

    /// BV at poses, square metres.
    pub fn cost(&self, poses: &[Isometry2<f64>]) -> f64 {
        let mut sum = 0.0;
        self.assembly.residuals(&self.assembly.placed(poses), |r| sum += r.value_m * r.value_m);
        sum
    }
}

/// Runs the chosen solver.
pub(super) fn solve(problem: &Problem, options: &SolverOptions) -> Solved {
    match options.solver {
        Solver::LeastSquares => least_squares(problem, options),
        Solver::Simplex => {
            let (step_m, step_rad) = options.simplex_steps;
            let steps = [step_m, step_m, step_rad].repeat(problem.movable.len());
            let cost = |by: &[f64]| problem.cost(&problem.moved(problem.start, by));
            let most = options.most_evaluations * steps.len();
            let found = simplex(cost, &steps, most, options.settle);
            Solved {
                poses: problem.moved(problem.start, &found.at),
                converged: found.converged,
                iterations: found.iterations,
                evaluations: found.evaluations,
            }
        }
    }
}
