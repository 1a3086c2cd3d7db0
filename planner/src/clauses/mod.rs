//! Clauses over truth values, and the search for values that satisfy them all.

mod learn;
#[doc(hidden)]
pub mod solver;

/// A variable (counted from 0) or its negation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Literal(pub u32);

impl Literal {
    /// Says that a variable is true, or (`false`) that it is not.
    pub fn new(variable: u32, positive: bool) -> Literal {
        Literal(variable << 1 | u32::from(!positive))
    }

    /// The variable.
    pub(crate) fn variable(self) -> u32 {
        self.0 >> 1
    }

    /// The opposite.
    pub(crate) fn negated(self) -> Literal {
        Literal(self.0 ^ 1)
    }

    /// The literal of the variable `by` places later, with the same sign.
    pub(crate) fn shifted(self, by: u32) -> Literal {
        Literal(self.0 + 2 * by)
    }

    fn at(self) -> usize {
        self.0 as usize
    }
}
