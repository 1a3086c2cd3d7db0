//! The modal operators of PDDL3 (Gerevini and Long 2005) without times, as automata over the states of a plan.
//!
//! Each sees the states one after the other, the first and the last included, and remembers at most two flags of what it saw.
//! None changes its mind where a state is seen twice: whoever runs one may leave out states in which neither condition
//! has changed.

use crate::task::Modal;

/// Literal over a condition or flag in a state.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Literal {
    /// The operator's first condition.
    First(bool),
    /// Second condition of the constraint.
    Second(bool),
    /// A flag that earlier states have left.
    Flag(usize, bool),
}

use Literal::{First, Flag, Second};

/// Disjunction of conjunctions of literals.
pub(crate) type Cases = &'static [&'static [Literal]];

/// Automaton of a trajectory constraint (PDDL3).
#[derive(Debug)]
pub(crate) struct Automaton {
    /// Number of flags, all initially false.
    pub flags: usize,
    /// States that violate the constraint for good.
    pub broken: Cases,
    /// Transitions: states that set or clear a flag for the following states.
    pub changes: &'static [(usize, bool, &'static [Literal])],
    /// Final states that leave the constraint unsatisfied.
    pub open: Cases,
}

/// `at end`.
pub(crate) static AT_END: Automaton =
    Automaton { flags: 0, broken: &[], changes: &[], open: &[&[First(false)]] };
static ALWAYS: Automaton = Automaton { flags: 0, broken: &[&[First(false)]], changes: &[], open: &[] };
static SOMETIME: Automaton = Automaton {
    flags: 1,
    broken: &[],
    changes: &[(0, true, &[First(true)])],
    open: &[&[First(false), Flag(0, false)]],
};
/// Flags: has been true; has been true and became false.
static AT_MOST_ONCE: Automaton = Automaton {
    flags: 2,
    broken: &[&[First(true), Flag(1, true)]],
    changes: &[(0, true, &[First(true)]), (1, true, &[First(false), Flag(0, true)])],
    open: &[],
};
/// The second condition is owed.
static SOMETIME_AFTER: Automaton = Automaton {
    flags: 1,
    broken: &[],
    changes: &[(0, true, &[First(true), Second(false)]), (0, false, &[Second(true)])],
    open: &[&[First(true), Second(false)], &[Second(false), Flag(0, true)]],
};
/// The second condition was true.
static SOMETIME_BEFORE: Automaton = Automaton {
    flags: 1,
    broken: &[&[First(true), Flag(0, false)]],
    changes: &[(0, true, &[Second(true)])],
    open: &[],
};

impl Automaton {
    /// Automaton of a modal operator; `None` for one with times.
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

    /// True if the automaton accepts a plan, given the truth of both conditions in each state.
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
