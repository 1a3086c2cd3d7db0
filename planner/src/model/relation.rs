//! Comparison of numbers with a common tolerance for rounding.

use crate::task::Comparison;

/// Maximum difference of numbers that count as equal.
const TOLERANCE: f64 = 1e-7;
/// Maximum difference of large numbers that count as equal, relative to the larger number.
const RELATIVE_TOLERANCE: f64 = 1e-12;

/// Relation of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Relation {
    /// Less than (`<`).
    Less,
    /// Less than or equal (`<=`).
    AtMost,
    /// Equal within the tolerance (`=`).
    Equal,
    /// Greater than or equal (`>=`).
    AtLeast,
    /// Greater than (`>`).
    Greater,
    /// Not equal; results only from negating an equation.
    Unequal,
}

impl Relation {
    /// Relation that a comparison requires, or its negation if `wanted` is false.
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

    /// True for `<`, `<=`, `>=` and `>`.
    pub fn is_bound(self) -> bool {
        !matches!(self, Relation::Equal | Relation::Unequal)
    }

    /// True if two numbers satisfy the relation within the tolerance; false if one is NaN.
    ///
    /// Exactly one of `<`, `=` and `>` holds of any two numbers.
    pub fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Relation::Less => left < right && !equal(left, right),
            Relation::AtMost => left <= right || equal(left, right),
            Relation::Equal => equal(left, right),
            Relation::AtLeast => left >= right || equal(left, right),
            Relation::Greater => left > right && !equal(left, right),
            Relation::Unequal => !(left.is_nan() || right.is_nan() || equal(left, right)),
        }
    }

    /// True if some number of the range `left` may stand in this relation to some number of the
    /// range `right`; a range is (lowest, highest).
    pub fn may_hold(self, left: (f64, f64), right: (f64, f64)) -> bool {
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

/// Quotient of two numbers; NaN if not finite.
pub fn quotient(left: f64, right: f64) -> f64 {
    let value = left / right;
    if value.is_finite() { value } else { f64::NAN }
}
