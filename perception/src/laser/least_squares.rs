//! Least squares on the violated constraints (Levenberg 1944, Marquardt 1963). Which constraints are violated, and by which point, is asked anew each time.

use super::solve::{Problem, Solved, SolverOptions};
use nalgebra::{DMatrix, DVector, Isometry2, Vector3};

/// A turn of one radian about the middle of a thing counts as a shift by so much, metres: about its radius.
const RADIUS_M: f64 = 0.3;
/// A violation below this is nothing, square metres.
const NOTHING_M2: f64 = 1e-12;
/// Damping at the start, and where no step helps any more.
const DAMPING: (f64, f64) = (1e-3, 1e6);

/// Normal equations at poses.
struct Linear {
    cost: f64,
    normal: DMatrix<f64>,
    right: DVector<f64>,
}

fn linearise(problem: &Problem, poses: &[Isometry2<f64>]) -> Linear {
    let n = 3 * problem.movable.len();
    let mut linear = Linear { cost: 0.0, normal: DMatrix::zeros(n, n), right: DVector::zeros(n) };
    let mut row_of: Vec<Option<usize>> = vec![None; problem.assembly.groups()];
    let mut pivots = vec![nalgebra::Point2::origin(); row_of.len()];
    for (index, &group) in problem.movable.iter().enumerate() {
        row_of[group] = Some(3 * index);
        pivots[group] = poses[group] * problem.assembly.pivot(group);
    }
    problem.assembly.residuals(&problem.assembly.placed(poses), |r| {
        linear.cost += r.value_m * r.value_m;
        // How the error grows with shift and turn of a group that carries the point; with the line it falls by as much.
        let slope = |group: usize| {
            let arm = r.at - pivots[group];
            Vector3::new(r.normal.x, r.normal.y, arm.perp(&r.normal))
        };
        let ends = [(r.point, 1.0), (r.line, -1.0)]
            .map(|(group, sign)| row_of[group].map(|row| (row, slope(group) * sign)));
        for (row, slope) in ends.iter().flatten() {
            for i in 0..3 {
                linear.right[row + i] -= slope[i] * r.value_m;
            }
            for (column, other) in ends.iter().flatten() {
                for i in 0..3 {
                    for j in 0..3 {
                        linear.normal[(row + i, column + j)] += slope[i] * other[j];
                    }
                }
            }
        }
    });
    linear
}

/// Steps of damped least squares until they change nothing.
pub(super) fn least_squares(problem: &Problem, options: &SolverOptions) -> Solved {
    let mut solved =
        Solved { poses: problem.start.to_vec(), converged: false, iterations: 0, evaluations: 1 };
    let mut linear = linearise(problem, &solved.poses);
    let mut damping = DAMPING.0;
    while solved.iterations < options.most_iterations {
        if linear.cost <= NOTHING_M2 {
            solved.converged = true;
            break;
        }
        solved.iterations += 1;
        let Some(step) = step(&linear, damping) else {
            damping *= 10.0;
            continue;
        };
        let poses = problem.moved(&solved.poses, step.as_slice());
        let next = linearise(problem, &poses);
        solved.evaluations += 1;
        if next.cost < linear.cost {
            let fell = linear.cost - next.cost;
            solved.poses = poses;
            solved.converged = fell <= options.settle * linear.cost && damping <= DAMPING.0;
            linear = next;
            damping *= 0.2;
        } else {
            damping *= 5.0;
            solved.converged = damping > DAMPING.1;
        }
        if solved.converged {
            break;
        }
    }
    solved
}

/// The step that the damped equations ask for.
fn step(linear: &Linear, damping: f64) -> Option<DVector<f64>> {
    let mut damped = linear.normal.clone();
    let scale = (0..damped.nrows()).map(|i| damped[(i, i)]).fold(f64::MIN_POSITIVE, f64::max);
    for i in 0..damped.nrows() {
        let weight = if i % 3 == 2 { RADIUS_M * RADIUS_M } else { 1.0 };
        damped[(i, i)] += damping * scale.min(linear.normal.nrows() as f64) * weight;
    }
    Some(damped.cholesky()?.solve(&linear.right))
}
