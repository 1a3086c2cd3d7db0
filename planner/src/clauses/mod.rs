//! Clauses over Boolean variables, and a solver that satisfies them (CDCL).

mod learn;
#[doc(hidden)]
pub mod solver;

/// Boolean variable (counted from 0) or its negation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Literal(pub u32);

impl Literal {
    /// Positive literal of a variable, or (`false`) the negative one.
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

    /// Literal of the variable `by` positions later, with the same sign.
    pub(crate) fn shifted(self, by: u32) -> Literal {
        Literal(self.0 + 2 * by)
    }

    fn at(self) -> usize {
        self.0 as usize
    }
}
