//! Tests of `mapping::orientation`.

use descry_perception::mapping::orientation::*;

/// Directions, how many of each, and the orientations that come out, degrees.
fn check(given: &[(f64, usize)], expected_deg: &[f64]) {
    let wobble = |i: usize| 4.0 * (i as f64 * 2.399_963).sin();
    let directions: Vec<f64> = given
        .iter()
        .flat_map(|&(deg, count)| {
            (0..count).map(move |i| (deg + wobble(i) + if i % 2 == 0 { 180.0 } else { 0.0 }).to_radians())
        })
        .collect();
    let found = orientations(&directions, &OrientationOptions::default());
    let mut deg: Vec<f64> = found.centres_rad.iter().map(|c| c.to_degrees()).collect();
    deg.sort_by(f64::total_cmp);
    assert_eq!(deg.len(), expected_deg.len(), "{deg:?}");
    assert!(deg.iter().zip(expected_deg).all(|(a, b)| (a - b).abs() < 1.5), "{deg:?} for {expected_deg:?}");
}

#[test]
fn as_many_as_there_are() {
    check(&[(10.0, 400), (100.0, 300)], &[10.0, 100.0]);
    check(&[(30.0, 400)], &[30.0]);
    check(&[(10.0, 400), (100.0, 300), (55.0, 90)], &[10.0, 55.0, 100.0]);
    let all_round: Vec<(f64, usize)> = (0..90).map(|i| (2.0 * f64::from(i), 10)).collect();
    check(&all_round, &[]);
    check(&[], &[]);
}
