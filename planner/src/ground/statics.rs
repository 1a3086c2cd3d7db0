//! Static predicates and functions, which nothing changes; they are evaluated during grounding.

use std::cell::Cell;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::model::relation::{Relation, quotient};
use crate::task::{ObjectId, Task};

use super::atoms::{Atoms, NONE};
use super::normal::{Formula, Named, Number, Pattern};
use super::reach::Possible;

/// Static predicates and functions of a task.
pub(super) struct Statics<'a> {
    pub task: &'a Task,
    /// True, by predicate (then by function), if its atoms change.
    pub fluent: Vec<bool>,
    /// True, by function, if some effect or timed literal changes the number.
    pub written: Vec<bool>,
    /// Initial numbers, by function and arguments.
    pub numbers: FxHashMap<(u32, Box<[u32]>), f64>,
    /// Counter of work and stop signal.
    pub tries: Tries<'a>,
}

/// Counter of objects tried for quantified variables, which checks the stop signal now and then.
pub(super) struct Tries<'a> {
    stop: &'a dyn Fn() -> bool,
    tried: Cell<u32>,
    stopped: Cell<bool>,
}

/// Number of objects tried between two checks of the stop signal.
const TRIED_AT_ONCE: u32 = 4096;

impl<'a> Tries<'a> {
    pub(super) fn new(stop: &'a dyn Fn() -> bool) -> Self {
        Tries { stop, tried: Cell::new(0), stopped: Cell::new(false) }
    }

    /// Counts one more tried object; `false` if stopped.
    pub(super) fn go_on(&self) -> bool {
        self.tried.set(self.tried.get().wrapping_add(1));
        if self.tried.get().is_multiple_of(TRIED_AT_ONCE) && (self.stop)() {
            self.stopped.set(true);
        }
        !self.stopped.get()
    }

    /// True once stopped; results after that are incomplete.
    pub(super) fn are_stopped(&self) -> bool {
        self.stopped.get()
    }
}

impl Statics<'_> {
    /// Initial value of a numeric function under a binding; NaN if undefined.
    pub(super) fn number(&self, named: &Named, binding: &[u32]) -> f64 {
        let arguments: Box<[u32]> = named.terms.iter().map(|t| t.bound(binding)).collect();
        self.numbers.get(&(named.index, arguments)).copied().unwrap_or(f64::NAN)
    }

    /// Value of an expression if it depends on static functions only; else `None`.
    pub(super) fn constant(&self, number: &Number, binding: &[u32]) -> Option<f64> {
        Some(match number {
            Number::Constant(value) => *value,
            Number::Fluent(named) if !self.written[named.index as usize] => self.number(named, binding),
            Number::Sum(parts) => {
                parts.iter().map(|p| self.constant(p, binding)).try_fold(0.0, |s, p| Some(s + p?))?
            }
            Number::Product(parts) => {
                parts.iter().map(|p| self.constant(p, binding)).try_fold(1.0, |s, p| Some(s * p?))?
            }
            Number::Difference(pair) => {
                self.constant(&pair[0], binding)? - self.constant(&pair[1], binding)?
            }
            Number::Quotient(pair) => {
                quotient(self.constant(&pair[0], binding)?, self.constant(&pair[1], binding)?)
            }
            Number::Negative(inner) => -self.constant(inner, binding)?,
            _ => return None,
        })
    }
}

impl Possible for &Statics<'_> {
    fn possible(
        &self,
        atoms: &Atoms,
        formula: &Formula,
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
    ) -> bool {
        match formula {
            Formula::And(parts) => parts.iter().all(|p| self.possible(atoms, p, binding, domains)),
            Formula::Or(parts) => parts.iter().any(|p| self.possible(atoms, p, binding, domains)),
            Formula::Literal(pattern, wanted) => {
                self.fluent[pattern.predicate as usize] || found(atoms, pattern, binding).is_some() == *wanted
            }
            Formula::Same(a, b, wanted) => (a.bound(binding) == b.bound(binding)) == *wanted,
            Formula::Compare(comparison, left, right, wanted) => {
                match (self.constant(left, binding), self.constant(right, binding)) {
                    (Some(left), Some(right)) => Relation::of(*comparison, *wanted).holds(left, right),
                    _ => true,
                }
            }
            Formula::Call(..) => true,
            Formula::Forall(slots, body) => each(slots, binding, domains, &mut |binding| {
                self.tries.go_on() && self.possible(atoms, body, binding, domains)
            }),
            Formula::Exists(slots, body) => !each(slots, binding, domains, &mut |binding| {
                self.tries.go_on() && !self.possible(atoms, body, binding, domains)
            }),
        }
    }

    fn is_stopped(&self) -> bool {
        self.tries.are_stopped()
    }
}

/// True if the test holds for every assignment of objects to the slots.
pub(super) fn each(
    slots: &[u32],
    binding: &mut Vec<u32>,
    domains: &[Arc<[ObjectId]>],
    test: &mut dyn FnMut(&mut Vec<u32>) -> bool,
) -> bool {
    let Some((&slot, rest)) = slots.split_first() else {
        return test(binding);
    };
    domains[slot as usize].iter().all(|object| {
        binding[slot as usize] = object.0;
        each(rest, binding, domains, test)
    })
}

pub(super) fn found(atoms: &Atoms, pattern: &Pattern, binding: &[u32]) -> Option<u32> {
    let mut arguments = [NONE; 32];
    for (out, term) in arguments.iter_mut().zip(&pattern.terms) {
        *out = term.bound(binding);
    }
    atoms.find(pattern.predicate, &arguments[..pattern.terms.len()])
}
