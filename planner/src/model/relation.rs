//! Numeric comparison, with a common tolerance for rounding.

use crate::task::Comparison;

/// Numbers that differ by less than this are equal.
const TOLERANCE: f64 = 1e-7;
/// Relative difference below which large numbers are equal, too.
const RELATIVE_TOLERANCE: f64 = 1e-12;

/// Relation of two numbers.
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
    /// Not equal; only from negated conditions.
    Unequal,
}

impl Relation {
    /// Relation required by a comparison or by its negation.
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

    /// True if all numbers on one side of a bound satisfy the relation.
    pub fn is_bound(self) -> bool {
        !matches!(self, Relation::Equal | Relation::Unequal)
    }

    /// True if two numbers satisfy the relation; false for NaN.
    ///
    /// Of `<`, `=` and `>` exactly one holds of any two numbers.
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

    /// True if a number of the first range stands in this relation to some number of the second; ranges go
    /// from the lower to the higher number.
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

/// Quotient; NaN if not finite.
pub fn quotient(left: f64, right: f64) -> f64 {
    let value = left / right;
    if value.is_finite() { value } else { f64::NAN }
}
