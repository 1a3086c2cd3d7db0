//! Automata over the states of a plan for the modal operators of PDDL3 without times (Gerevini and
//! Long 2005).
//!
//! An automaton reads the states in order, from the initial to the final one, and remembers at most
//! two flags. A repeated state changes nothing, so states in which neither condition has changed
//! since the state before may be left out.

use crate::task::Modal;

/// Literal over a condition or flag in a state; the literal holds if the condition or flag has the
/// given truth value.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Literal {
    /// First condition of the constraint.
    First(bool),
    /// Second condition of the constraint.
    Second(bool),
    /// Flag, by index, as set by earlier states.
    Flag(usize, bool),
}

use Literal::{First, Flag, Second};

/// Disjunction of conjunctions of literals; false if empty.
pub(crate) type Cases = &'static [&'static [Literal]];

/// Automaton of a trajectory constraint (PDDL3).
#[derive(Debug)]
pub(crate) struct Automaton {
    /// Number of flags, all false in the initial state.
    pub flags: usize,
    /// Condition on a state that violates the constraint whatever follows.
    pub broken: Cases,
    /// Transitions: a flag's index, its new value for the following states, and the condition on
    /// the present state.
    pub changes: &'static [(usize, bool, &'static [Literal])],
    /// Condition on the final state under which the constraint is violated.
    pub open: Cases,
}

/// `(at end f)`.
pub(crate) static AT_END: Automaton =
    Automaton { flags: 0, broken: &[], changes: &[], open: &[&[First(false)]] };
static ALWAYS: Automaton = Automaton { flags: 0, broken: &[&[First(false)]], changes: &[], open: &[] };
static SOMETIME: Automaton = Automaton {
    flags: 1,
    broken: &[],
    changes: &[(0, true, &[First(true)])],
    open: &[&[First(false), Flag(0, false)]],
};
/// Flag 0: the condition has been true. Flag 1: it became false after that.
static AT_MOST_ONCE: Automaton = Automaton {
    flags: 2,
    broken: &[&[First(true), Flag(1, true)]],
    changes: &[(0, true, &[First(true)]), (1, true, &[First(false), Flag(0, true)])],
    open: &[],
};
/// Flag 0: the first condition has been true, and since then the second has not.
static SOMETIME_AFTER: Automaton = Automaton {
    flags: 1,
    broken: &[],
    changes: &[(0, true, &[First(true), Second(false)]), (0, false, &[Second(true)])],
    open: &[&[First(true), Second(false)], &[Second(false), Flag(0, true)]],
};
/// Flag 0: the second condition has been true.
static SOMETIME_BEFORE: Automaton = Automaton {
    flags: 1,
    broken: &[&[First(true), Flag(0, false)]],
    changes: &[(0, true, &[Second(true)])],
    open: &[],
};

impl Automaton {
    /// Automaton of a modal operator; `None` for operators with times.
    pub(crate) fn of(operator: Modal) -> Option<&'static Automaton> {
        match operator {
            Modal::AtEnd => Some(&AT_END),
            Modal::Always => Some(&ALWAYS),
            Modal::Sometime => Some(&SOMETIME),
            Modal::AtMostOnce => Some(&AT_MOST_ONCE),
            Modal::SometimeAfter => Some(&SOMETIME_AFTER),
            Modal::SometimeBefore => Some(&SOMETIME_BEFORE),
            Modal::Within | Modal::AlwaysWithin | Modal::HoldDuring | Modal::HoldAfter => None,
        }
    }

    /// True if a plan satisfies the constraint, given the truth of the two conditions in each
    /// state, in order.
    pub(crate) fn accepts(&self, truths: impl IntoIterator<Item = (bool, bool)>) -> bool {
        let mut flags = [false; 2];
        let mut open = true;
        for (first, second) in truths {
            let holds = |literal: &Literal| match *literal {
                First(wanted) => first == wanted,
                Second(wanted) => second == wanted,
                Flag(flag, wanted) => flags[flag] == wanted,
            };
            let any = |cases: Cases| cases.iter().any(|case| case.iter().all(holds));
            if any(self.broken) {
                return false;
            }
            open = any(self.open);
            let mut next = flags;
            for (flag, raised, case) in self.changes {
                if case.iter().all(holds) {
                    next[*flag] = *raised;
                }
            }
            flags = next;
        }
        !open
    }
}
