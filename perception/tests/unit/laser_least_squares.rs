//! Tests of `laser::least_squares`.

use descry_perception::laser::least_squares::*;
use descry_perception::laser::shape::{ObjectScan, PosedScan};
use descry_perception::laser::solve::{Problem, SolverOptions};
use descry_perception::laser::violation::Assembly;
use nalgebra::{Isometry2, Point2};

/// A scan of a few readings from a place, as seen towards the origin.
fn scan(bearing: f64, half_rad: f64) -> PosedScan {
    let points = [(-0.8, 1.3), (-0.3, 1.21), (0.2, 1.2), (0.8, 1.28)]
        .map(|(share, range)| {
            let angle: f64 = share * half_rad;
            Point2::new(range * angle.cos(), range * angle.sin())
        })
        .to_vec();
    let laser = nalgebra::Vector2::new(bearing.cos(), bearing.sin()) * 1.4;
    PosedScan {
        scan: ObjectScan {
            points,
            right_bound_rad: -half_rad,
            right_object_rad: -0.8 * half_rad,
            left_object_rad: 0.8 * half_rad,
            left_bound_rad: half_rad,
        },
        model_from_laser: Isometry2::new(laser, bearing + std::f64::consts::PI),
    }
}

/// The right side is half the downward slope of the cost.
#[test]
fn derivatives_are_those_of_the_cost() {
    let scans = [scan(0.0, 0.10), scan(2.0, 0.14), scan(4.1, 0.12)];
    let free = vec![&scans[..1], &scans[1..2], &scans[2..]];
    for (onto, groups, outlier_m) in [
        (false, free.clone(), f64::INFINITY),
        (false, free, 0.03),
        (true, vec![&scans[..2], &scans[2..]], f64::INFINITY),
    ] {
        let assembly = Assembly::new(groups.iter().copied());
        let start = vec![Isometry2::identity(); groups.len()];
        let options = SolverOptions { outlier_m, ..SolverOptions::default() };
        let problem = match onto {
            true => Problem::onto(&assembly, &start, &options),
            false => Problem::free(&assembly, &start, &options),
        };
        let away: Vec<f64> = (0..3 * problem.movable().len()).map(|i| 0.02 * (i as f64).sin()).collect();
        let poses = problem.moved(&start, &away);
        let linear = linearise(&problem, &poses, (0.0, 1.0));
        assert!(linear.cost > 1e-4 && (linear.cost - problem.cost(&poses)).abs() < 1e-12);
        for i in 0..away.len() {
            let cost = |by: f64| {
                let mut step = vec![0.0; away.len()];
                step[i] = by;
                problem.cost(&problem.moved(&poses, &step))
            };
            let slope = (cost(1e-6) - cost(-1e-6)) / 2e-6;
            assert!((slope + 2.0 * linear.right[i]).abs() < 1e-5, "{onto} {i}: {slope} {}", linear.right[i]);
        }
    }
}
