//! Tests of `model::relation`.

use descry_planner::model::relation::*;

#[test]
fn exactly_one_of_less_equal_and_greater_holds() {
    let numbers = [
        f64::NEG_INFINITY,
        -1e12,
        -0.3,
        0.0,
        1e-8,
        0.1 + 0.2,
        0.3,
        1.21,
        1.1 * 1.1,
        1e7,
        1e7 + 1.0,
        1e12,
        f64::INFINITY,
    ];
    for (left, right) in numbers.into_iter().flat_map(|left| numbers.map(|right| (left, right))) {
        let holds = [Relation::Less, Relation::Equal, Relation::Greater].map(|own| own.holds(left, right));
        assert_eq!(holds.iter().filter(|&&holds| holds).count(), 1, "{left} {right}");
        assert_eq!(Relation::AtMost.holds(left, right), !holds[2], "{left} {right}");
        assert_eq!(Relation::AtLeast.holds(left, right), !holds[0], "{left} {right}");
        assert_eq!(Relation::Unequal.holds(left, right), !holds[1], "{left} {right}");
    }
}

#[test]
fn rounding_is_forgiven_and_counting_is_not() {
    for (left, right, same) in [
        (0.1 + 0.2, 0.3, true),
        (1.1 * 1.1, 1.21, true),
        (1e7, 1e7 + 1.0, false),
        (1e11, 1e11 + 1.0, false),
        (1e9 * 1.1, 1.1e9 + 1e-3, true),
        (0.0, 1e-6, false),
    ] {
        assert_eq!(Relation::Equal.holds(left, right), same, "{left} {right}");
    }
}

#[test]
fn nothing_is_said_of_what_is_undefined() {
    for own in [Relation::Less, Relation::AtMost, Relation::Equal, Relation::Unequal, Relation::Greater] {
        assert!(!own.holds(f64::NAN, 1.0) && !own.holds(1.0, f64::NAN));
    }
    assert!(quotient(1.0, 0.0).is_nan() && quotient(0.0, 0.0).is_nan());
}

#[test]
fn ranges_may_do_what_one_of_their_numbers_does() {
    for (relation, left, right, may) in [
        (Relation::AtMost, (0.1 + 0.2, 9.0), (0.0, 0.3), true),
        (Relation::Less, (0.1 + 0.2, 9.0), (0.0, 0.3), false),
        (Relation::Equal, (1.0, 2.0), (3.0, 4.0), false),
        (Relation::Unequal, (1.0, 1.0), (1.0, 1.0), false),
        (Relation::Unequal, (1.0, 2.0), (1.0, 1.0), true),
        (Relation::Greater, (f64::NEG_INFINITY, f64::INFINITY), (5.0, 5.0), true),
    ] {
        assert_eq!(relation.may_hold(left, right), may, "{relation:?} {left:?} {right:?}");
    }
}
