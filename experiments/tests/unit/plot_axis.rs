//! Tests of `plot::axis`.

use descry_experiments::plot::axis::*;

fn check(range: Option<[f64; 2]>, values: &[f64], ticks: &[&str]) {
    let scale = Scale::new(range, values.iter().copied(), 0.0, 100.0);
    let texts: Vec<String> = scale.ticks().into_iter().map(|t| scale.text(t)).collect();
    assert_eq!(texts, ticks);
}

#[test]
fn ticks_are_round() {
    check(Some([0.0, 1.0]), &[], &["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
    check(None, &[1.0, 2.0, 5.0], &["0", "1", "2", "3", "4", "5"]);
    check(None, &[-0.3, 0.2], &["-0.3", "-0.2", "-0.1", "0.0", "0.1", "0.2"]);
    check(None, &[1000.0, 1250.0], &["1000", "1050", "1100", "1150", "1200", "1250"]);
    check(None, &[3.0], &["2.4", "2.6", "2.8", "3.0", "3.2", "3.4", "3.6"]);
}

#[test]
fn places() {
    let scale = Scale::new(Some([0.0, 10.0]), std::iter::empty(), 200.0, 100.0);
    assert_eq!((scale.at(0.0), scale.at(5.0), scale.at(99.0)), (200.0, 150.0, 100.0));
}
