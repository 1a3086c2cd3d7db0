//! Tests of `model::between`.

use descry_planner::model::between::*;

#[test]
fn every_stretch_and_every_turn_is_looked_at() {
    for (differences, expected) in [
        (vec![], vec![0.5]),
        (vec![[1.0, 1.0, 1.0]], vec![0.5]),
        (vec![[f64::NAN, 1.0, 1.0]], vec![0.5]),
        // Rising through nothing; from nothing; up to nothing.
        (vec![[-1.0, 1.0, 3.0]], vec![0.125, 0.25, 0.625]),
        (vec![[0.0, 1.0, 2.0]], vec![0.5]),
        (vec![[-2.0, -1.0, -1e-9]], vec![0.5]),
        // x·(1 - x), less a quarter: it touches nothing in the middle.
        (vec![[-0.25, 0.0, -0.25]], vec![0.25, 0.5, 0.75]),
        // Two comparisons.
        (vec![[-1.0, 0.0, 1.0], [-1.0, 1.0, 3.0]], vec![0.125, 0.25, 0.375, 0.5, 0.75]),
    ] {
        assert_eq!(telling_parts(differences.clone()), expected, "{differences:?}");
    }
}
