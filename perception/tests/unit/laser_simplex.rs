//! Tests of `laser::simplex`.

use descry_perception::laser::simplex::*;

fn check(name: &str, cost: impl Fn(&[f64]) -> f64, steps: &[f64], expected: &[f64]) {
    let found = simplex(&cost, steps, 4000, 1e-12);
    let near = found.at.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3);
    assert!(near && found.converged, "{name}: {:?} after {} evaluations", found.at, found.evaluations);
    assert_eq!(found.cost, cost(&found.at), "{name}");
}

#[test]
fn minima_are_found() {
    let bowl = |x: &[f64]| 1.0 + x.iter().enumerate().map(|(i, v)| (v - i as f64).powi(2)).sum::<f64>();
    check("one dimension", bowl, &[0.5], &[0.0]);
    check("six dimensions", bowl, &[0.5; 6], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    let valley = |x: &[f64]| (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2);
    check("a bent valley", valley, &[0.1, 0.1], &[1.0, 1.0]);
    check("nothing to move", |_: &[f64]| 3.0, &[], &[]);
}

#[test]
fn a_cut_is_told() {
    let found = simplex(|x| x[0] * x[0] - x[0], &[1e-3], 5, 1e-12);
    assert!(!found.converged && found.evaluations >= 5);
}
