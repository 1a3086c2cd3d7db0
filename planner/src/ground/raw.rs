//! Ground task in terms of single atoms, before atoms are grouped into variables.

use rustc_hash::FxHashMap;

use super::instantiate::{Clauses, Deed, RawEffect};
use super::statics::Tries;
use super::task::{GroundDurationBound, GroundExpression};

/// Maximum number of copies of an action with a disjunctive condition; beyond, the disjunction
/// becomes a derived atom.
const MOST_COPIES: usize = 4;

/// Parts of a durative action other than its start.
#[derive(Clone, Debug)]
pub(super) struct Later {
    pub over_all: Clauses,
    pub end: Clauses,
    pub end_effects: Vec<RawEffect>,
    pub flows: Vec<(u32, GroundExpression)>,
    pub duration: Vec<GroundDurationBound>,
}

/// Ground action; its conditions contain no disjunctions.
#[derive(Clone, Debug)]
pub(super) struct RawAction {
    pub schema: u32,
    pub arguments: Box<[u32]>,
    pub start: Clauses,
    pub effects: Vec<RawEffect>,
    pub later: Option<Box<Later>>,
    /// Contribution of the action to the metric.
    pub cost: GroundExpression,
}

/// Ground axiom.
#[derive(Clone, Debug)]
pub(super) struct RawAxiom {
    pub head: u32,
    pub body: Clauses,
    pub stratum: u32,
}

/// Ground task over atoms; atoms from number `inner` on stand for disjunctions.
pub(super) struct RawTask {
    pub actions: Vec<RawAction>,
    pub axioms: Vec<RawAxiom>,
    pub goal: Clauses,
    /// True, by atom, if the atom holds initially (derived atoms are false).
    pub init: Vec<bool>,
    /// Number of the first atom that stands for a disjunction.
    pub inner: u32,
    pub timed: Vec<(f64, Vec<Deed>)>,
}

/// Replaces disjunctions by derived atoms, and collects the axioms that define these.
pub(super) struct Resolve<'a> {
    next: u32,
    tries: &'a Tries<'a>,
    known: FxHashMap<Vec<Clauses>, u32>,
    pub axioms: Vec<RawAxiom>,
}

impl<'a> Resolve<'a> {
    /// Creates the replacement, with new atoms numbered from `next`. Once `tries` is stopped,
    /// results are incomplete.
    pub(super) fn new(next: u32, tries: &'a Tries<'a>) -> Self {
        Resolve { next, tries, known: FxHashMap::default(), axioms: Vec::new() }
    }

    /// Number of atoms, new ones included.
    pub(super) fn atoms(&self) -> u32 {
        self.next
    }

    /// Replaces every disjunction of a condition by a derived atom.
    pub(super) fn flat(&mut self, mut clauses: Clauses, stratum: u32) -> Clauses {
        for or in std::mem::take(&mut clauses.ors) {
            if !self.tries.go_on() {
                break;
            }
            clauses.literals.push(self.derived(or, stratum) << 1);
        }
        clauses.tidy();
        clauses
    }

    fn derived(&mut self, branches: Vec<Clauses>, stratum: u32) -> u32 {
        if let Some(&atom) = self.known.get(&branches) {
            return atom;
        }
        let mut bodies = Vec::with_capacity(branches.len());
        for branch in &branches {
            if !self.tries.go_on() {
                break;
            }
            bodies.push(self.flat(branch.clone(), stratum));
        }
        let head = self.next;
        self.next += 1;
        self.axioms.extend(bodies.into_iter().map(|body| RawAxiom { head, body, stratum }));
        self.known.insert(branches, head);
        head
    }

    /// Splits a condition into at most [`MOST_COPIES`] alternatives without disjunctions; further
    /// disjunctions become derived atoms.
    pub(super) fn split(&mut self, mut clauses: Clauses, stratum: u32) -> Vec<Clauses> {
        if clauses.ors.is_empty() {
            clauses.tidy();
            return if contradictory(&clauses) { Vec::new() } else { vec![clauses] };
        }
        let mut all = vec![Clauses::default()];
        for or in std::mem::take(&mut clauses.ors) {
            if all.len() * or.len() > MOST_COPIES {
                let atom = self.derived(or, stratum);
                clauses.literals.push(atom << 1);
                continue;
            }
            let branches: Vec<Clauses> = or.into_iter().map(|b| self.flat(b, stratum)).collect();
            all = all.iter().flat_map(|left| branches.iter().map(move |right| join(left, right))).collect();
        }
        let mut done: Vec<Clauses> = all.iter().map(|extra| join(extra, &clauses)).collect();
        done.iter_mut().for_each(Clauses::tidy);
        done.retain(|c| !contradictory(c));
        done.dedup();
        done
    }
}

fn join(left: &Clauses, right: &Clauses) -> Clauses {
    let mut joined = left.clone();
    joined.literals.extend(&right.literals);
    joined.comparisons.extend(&right.comparisons);
    joined.calls.extend(&right.calls);
    joined
}

/// True if the clauses contain an atom and its negation (literals sorted).
pub(super) fn contradictory(clauses: &Clauses) -> bool {
    clauses.literals.windows(2).any(|pair| pair[0] ^ 1 == pair[1])
}
