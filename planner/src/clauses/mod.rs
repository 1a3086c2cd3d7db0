//! Boolean satisfiability: clauses, and a CDCL solver for them.

mod learn;
#[doc(hidden)]
pub mod solver;

/// A Boolean variable or its negation, encoded as twice the variable's index, plus 1 if negated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Literal(pub u32);

impl Literal {
    /// Literal of a variable: the variable if `positive`, else its negation.
    pub fn new(variable: u32, positive: bool) -> Literal {
        Literal(variable << 1 | u32::from(!positive))
    }

    /// Index of the variable.
    pub(crate) fn variable(self) -> u32 {
        self.0 >> 1
    }

    /// Opposite literal.
    pub(crate) fn negated(self) -> Literal {
        Literal(self.0 ^ 1)
    }

    /// Literal of the variable whose index is larger by `by`, with the same sign.
    pub(crate) fn shifted(self, by: u32) -> Literal {
        Literal(self.0 + 2 * by)
    }

    fn at(self) -> usize {
        self.0 as usize
    }
}
