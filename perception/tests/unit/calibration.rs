//! Tests of `calibration`.

use descry_perception::calibration::*;

#[test]
fn scores_of_known_claims() {
    let cases: [(&str, Vec<Claim>, f64, f64); 4] = [
        ("perfect", vec![(1.0, true), (0.0, false)], 0.0, 0.0),
        ("always wrong", vec![(1.0, false), (0.0, true)], 1.0, 1.0),
        ("honest doubt", vec![(0.5, true), (0.5, false)], 0.25, 0.0),
        ("not a number is left out", vec![(f64::NAN, true), (1.0, true)], 0.0, 0.0),
    ];
    for (name, claims, brier, error) in cases {
        let found = reliability(&claims, 10);
        assert!((found.brier - brier).abs() < 1e-12, "{name}: {found:?}");
        assert!((found.expected_error - error).abs() < 1e-12, "{name}: {found:?}");
    }
    assert_eq!(reliability(&[], 0).count, 0);
}
