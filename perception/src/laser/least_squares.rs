//! Levenberg-Marquardt on the violated constraints (Levenberg 1944, Marquardt 1963). The active constraints and their
//! points are recomputed in each iteration.

use super::solve::{Problem, Solved, SolverOptions};
use nalgebra::{DMatrix, DVector, Isometry2, Point2, Vector3};

/// Rounds of annealing: smoothing of farthest points, metres, and factor on the outlier length; the last round
/// minimises the objective itself.
const ROUNDS: [(f64, f64); 3] = [(0.03, 10.0), (0.006, 3.0), (0.0, 1.0)];
/// Length equivalent of a rotation by one radian about an object's centre, metres: about the object's radius.
const RADIUS_M: f64 = 0.3;
/// Objective below which the violation counts as zero, square metres.
const NOTHING_M2: f64 = 1e-12;
/// Initial damping, and the damping above which steps are too short to help.
const DAMPING: (f64, f64) = (1e-3, 1e1);

/// Runs only the first round, with the most smoothing.
pub(super) fn roughly(problem: &Problem, options: &SolverOptions) -> Solved {
    rounds(problem, options, &ROUNDS[..1])
}

/// Damped least squares with decreasing smoothing; returns the best poses found.
pub(super) fn least_squares(problem: &Problem, options: &SolverOptions) -> Solved {
    rounds(problem, options, &ROUNDS)
}

fn rounds(problem: &Problem, options: &SolverOptions, rounds: &[(f64, f64)]) -> Solved {
    let start = problem.start().to_vec();
    let cost = problem.cost(&start);
    let mut poses = start.clone();
    let mut solved = Solved { poses: start, cost, converged: false, iterations: 0, evaluations: 1 };
    for &round in rounds {
        solved.converged = descend(problem, options, round, &mut poses, &mut solved);
        let cost = problem.cost(&poses);
        solved.evaluations += 1;
        if cost < solved.cost {
            solved.cost = cost;
            solved.poses.clone_from(&poses);
        }
        if solved.cost <= NOTHING_M2 {
            solved.converged = true;
            break;
        }
    }
    solved
}

/// Minimises one round's smoothed objective; true if converged, false at the iteration limit.
fn descend(
    problem: &Problem,
    options: &SolverOptions,
    round: (f64, f64),
    poses: &mut Vec<Isometry2<f64>>,
    count: &mut Solved,
) -> bool {
    let mut linear = linearise(problem, poses, round);
    count.evaluations += 1;
    let mut damping = DAMPING.0;
    for _ in 0..options.most_iterations {
        if linear.cost <= NOTHING_M2 || damping > DAMPING.1 {
            return true;
        }
        count.iterations += 1;
        let Some(step) = step(&linear, damping) else {
            damping *= 10.0;
            continue;
        };
        let stepped = problem.moved(poses, step.as_slice());
        let next = linearise(problem, &stepped, round);
        count.evaluations += 1;
        if next.cost < linear.cost {
            let settled = linear.cost - next.cost <= options.settle * linear.cost;
            (*poses, linear) = (stepped, next);
            if settled {
                return true;
            }
            damping *= 0.2;
        } else {
            damping *= 5.0;
        }
    }
    false
}

/// Normal equations of the objective at some poses.
pub struct Linear {
    pub cost: f64,
    normal: DMatrix<f64>,
    pub right: DVector<f64>,
}

pub fn linearise(problem: &Problem, poses: &[Isometry2<f64>], (soft_m, wider): (f64, f64)) -> Linear {
    let assembly = problem.assembly();
    let n = 3 * problem.movable().len();
    let mut linear = Linear { cost: 0.0, normal: DMatrix::zeros(n, n), right: DVector::zeros(n) };
    let mut rows: Vec<Option<(usize, Point2<f64>)>> = vec![None; poses.len()];
    for (index, &group) in problem.movable().iter().enumerate() {
        rows[group] = Some((3 * index, poses[group] * assembly.pivot(group)));
        for (i, (off, weight)) in problem.strayed(poses, group).enumerate() {
            let row = 3 * index + i;
            linear.cost += weight * off * off;
            linear.right[row] -= weight * off;
            linear.normal[(row, row)] += weight;
        }
    }
    assembly.residuals(&assembly.placed(poses), soft_m, |r| {
        let (cost, weight) = problem.costs(&r, wider);
        linear.cost += cost;
        // How the error grows with shift and turn of the group that carries the point; with the group that carries the line it falls by as much.
        let slopes = [(r.point, 1.0), (r.line, -1.0)].map(|(group, sign)| {
            rows[group].map(|(row, pivot)| {
                let turn = (r.at - pivot).perp(&r.normal);
                (row, Vector3::new(r.normal.x, r.normal.y, turn) * sign)
            })
        });
        for (row, slope) in slopes.iter().flatten() {
            let mut right = linear.right.fixed_rows_mut::<3>(*row);
            right -= slope * (weight * r.value_m);
            for (column, other) in slopes.iter().flatten() {
                let mut block = linear.normal.fixed_view_mut::<3, 3>(*row, *column);
                block += slope * other.transpose() * weight;
            }
        }
    });
    linear
}

/// Solution of the damped normal equations; `None` if they are singular.
pub fn step(linear: &Linear, damping: f64) -> Option<DVector<f64>> {
    let mut damped = linear.normal.clone();
    for i in 0..damped.nrows() {
        damped[(i, i)] += damping * if i % 3 == 2 { RADIUS_M * RADIUS_M } else { 1.0 };
    }
    Some(damped.cholesky()?.solve(&linear.right))
}
