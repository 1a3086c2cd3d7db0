//! How numbers compare, everywhere: two that differ by no more than rounding explains are equal.

use crate::task::Comparison;

/// Numbers this near to each other are equal.
const TOLERANCE: f64 = 1e-7;
/// So are large ones that differ by no more than this part of the larger.
const RELATIVE_TOLERANCE: f64 = 1e-12;

/// How two numbers compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Relation {
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `=`
    Equal,
    /// `>=`
    AtLeast,
    /// `>`
    Greater,
    /// Not `=`; only from negated conditions.
    Unequal,
}

impl Relation {
    /// The relation that a comparison, or its negation, asks for.
    pub(crate) fn of(comparison: Comparison, wanted: bool) -> Relation {
        match (comparison, wanted) {
            (Comparison::Less, true) | (Comparison::GreaterOrEqual, false) => Relation::Less,
            (Comparison::LessOrEqual, true) | (Comparison::Greater, false) => Relation::AtMost,
            (Comparison::Equal, true) => Relation::Equal,
            (Comparison::Equal, false) => Relation::Unequal,
            (Comparison::GreaterOrEqual, true) | (Comparison::Less, false) => Relation::AtLeast,
            (Comparison::Greater, true) | (Comparison::LessOrEqual, false) => Relation::Greater,
        }
    }

    /// Whether everything on one side of a bound will do.
    pub fn is_bound(self) -> bool {
        !matches!(self, Relation::Equal | Relation::Unequal)
    }

    /// Whether two numbers stand in this relation; never if one is undefined (NaN).
    ///
    /// Of `<`, `=` and `>` exactly one holds of any two numbers.
    pub(crate) fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Relation::Less => left < right && !equal(left, right),
            Relation::AtMost => left <= right || equal(left, right),
            Relation::Equal => equal(left, right),
            Relation::AtLeast => left >= right || equal(left, right),
            Relation::Greater => left > right && !equal(left, right),
            Relation::Unequal => !(left.is_nan() || right.is_nan() || equal(left, right)),
        }
    }

    /// Whether a number of the first range stands in this relation to some number of the second; ranges go from the
    /// lower to the higher number.
    pub(crate) fn may_hold(self, left: (f64, f64), right: (f64, f64)) -> bool {
        match self {
            // The farther apart two numbers are, the less rounding explains it.
            Relation::Less | Relation::AtMost => self.holds(left.0, right.1),
            Relation::AtLeast | Relation::Greater => self.holds(left.1, right.0),
            Relation::Equal => {
                Relation::AtMost.holds(left.0, right.1) && Relation::AtLeast.holds(left.1, right.0)
            }
            Relation::Unequal => {
                Relation::Less.may_hold(left, right) || Relation::Greater.may_hold(left, right)
            }
        }
    }
}

fn equal(left: f64, right: f64) -> bool {
    let apart = (left - right).abs();
    apart == 0.0
        || left == right
        || apart <= TOLERANCE
        || apart.is_finite() && apart <= RELATIVE_TOLERANCE * left.abs().max(right.abs())
}

/// What division gives; undefined (NaN) where that is no finite number.
pub(crate) fn quotient(left: f64, right: f64) -> f64 {
    let value = left / right;
    if value.is_finite() { value } else { f64::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let holds =
                [Relation::Less, Relation::Equal, Relation::Greater].map(|own| own.holds(left, right));
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
}
