//! Tests of `model::agreement`.

use descry_planner::model::agreement::*;
use descry_planner::task::Assignment;

#[test]
fn what_has_no_result_in_either_order_is_a_contradiction() {
    use Assignment::{Assign, Decrease, Increase, ScaleDown, ScaleUp};
    for (changes, expected) in [
        (vec![(0, Increase, 1.0), (0, Decrease, 3.0), (1, Assign, 1.0)], vec![]),
        (vec![(0, ScaleUp, 2.0), (0, ScaleDown, 3.0)], vec![]),
        (vec![(0, Assign, 2.0), (1, Assign, 3.0), (0, Assign, 2.0)], vec![]),
        (vec![(0, Assign, 2.0), (1, Assign, 3.0), (0, Assign, 3.0)], vec![(0, 2)]),
        (vec![(1, Assign, f64::NAN), (1, Assign, f64::NAN)], vec![(0, 1)]),
        (vec![(0, Increase, 2.0), (0, Assign, 3.0)], vec![(0, 1)]),
        (vec![(0, ScaleUp, 2.0), (0, Increase, 3.0)], vec![(0, 1)]),
    ] {
        assert_eq!(contradictions(changes.iter().copied()), expected, "{changes:?}");
    }
}

#[test]
fn one_value_at_once() {
    for (values, expected) in
        [(vec![(0, 1), (1, 2), (0, 1)], None), (vec![(0, 1), (1, 2), (1, 3), (0, 2)], Some((1, 2)))]
    {
        assert_eq!(reset(values.iter().copied()), expected, "{values:?}");
    }
}
