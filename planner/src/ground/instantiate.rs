//! Instantiation of lifted conditions, effects and expressions with objects; static parts are
//! evaluated and removed.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::task::ObjectId;

use super::atoms::{Atoms, NONE};
use super::normal::{Change_, Effect_, Formula, Named, Number, Pattern, Target, Term, module_writes};
use super::statics::{Statics, each, found};
use super::task::{Change, GroundComparison, GroundExpression, NumericFluent, Origin, Relation};

/// Conjunction of ground literals (`atom << 1 | negated`), comparisons, calls with the wanted
/// answer, and disjunctions of further conditions.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Clauses {
    pub literals: Vec<u32>,
    pub comparisons: Vec<u32>,
    pub calls: Vec<(u32, bool)>,
    pub ors: Vec<Vec<Clauses>>,
}

impl Clauses {
    /// True if the condition always holds.
    pub(super) fn is_true(&self) -> bool {
        self.literals.is_empty()
            && self.comparisons.is_empty()
            && self.calls.is_empty()
            && self.ors.is_empty()
    }

    /// Sorts and removes repetitions.
    pub(super) fn tidy(&mut self) {
        self.literals.sort_unstable();
        self.literals.dedup();
        self.comparisons.sort_unstable();
        self.comparisons.dedup();
        self.calls.sort_unstable();
        self.calls.dedup();
        for or in &mut self.ors {
            or.iter_mut().for_each(Clauses::tidy);
            or.sort();
            or.dedup();
        }
        self.ors.sort();
        self.ors.dedup();
    }

    fn merge(&mut self, other: Clauses) {
        self.literals.extend(other.literals);
        self.comparisons.extend(other.comparisons);
        self.calls.extend(other.calls);
        self.ors.extend(other.ors);
    }
}

/// Effect of a ground action, on an atom or a numeric fluent.
#[derive(Clone, Debug)]
pub(super) enum Deed {
    Add(u32),
    Delete(u32),
    Change(u32, Change, Box<GroundExpression>),
    Call(u32),
}

/// Ground call of an attachment, with the terms that it writes.
#[derive(Clone, Debug)]
pub(super) struct RawCall {
    pub origin: Origin,
    pub writes: Vec<RawPlace>,
}

/// Term that a call writes: a numeric fluent, an atom (`None`: never reached), or an object
/// function with the atoms of its values.
#[derive(Clone, Debug)]
pub(super) enum RawPlace {
    Number(u32),
    Truth(Option<u32>),
    Object(Vec<u32>),
}

impl RawCall {
    /// Atoms that the call may make true or false.
    pub(super) fn atoms(&self) -> impl Iterator<Item = u32> {
        self.writes
            .iter()
            .flat_map(|place| match place {
                RawPlace::Number(_) => &[][..],
                RawPlace::Truth(atom) => atom.as_slice(),
                RawPlace::Object(atoms) => atoms,
            })
            .copied()
    }
}

/// Ground effect with its condition.
#[derive(Clone, Debug)]
pub(super) struct RawEffect {
    /// Conditions at the effect's own time, at the action's start, and over all; `None`:
    /// unconditional.
    pub when: Option<Box<[Clauses; 3]>>,
    pub deed: Deed,
}

/// Error: the condition can never hold.
struct Never;

/// Instantiates lifted structures, and assigns numbers to numeric fluents, comparisons and calls.
pub(super) struct Instantiate<'a> {
    pub statics: &'a Statics<'a>,
    pub atoms: Atoms,
    /// True, by atom, if the atom holds in every reachable state.
    pub always: Vec<bool>,
    pub numerics: Vec<NumericFluent>,
    pub comparisons: Vec<GroundComparison>,
    pub calls: Vec<RawCall>,
    numeric_ids: FxHashMap<NumericFluent, u32>,
    comparison_ids: FxHashMap<Vec<u64>, u32>,
    /// Ids of calls, stored as atoms whose predicate is the module.
    call_ids: Atoms,
}

impl<'a> Instantiate<'a> {
    pub(super) fn new(statics: &'a Statics<'a>, atoms: Atoms) -> Self {
        let always = vec![false; atoms.len()];
        Instantiate {
            statics,
            atoms,
            always,
            numerics: Vec::new(),
            comparisons: Vec::new(),
            calls: Vec::new(),
            numeric_ids: FxHashMap::default(),
            comparison_ids: FxHashMap::default(),
            call_ids: Atoms::new(statics.task.modules.len(), statics.task.objects.len()),
        }
    }

    /// Adds a formula under a binding to a conjunction; `false` if the result can never hold.
    pub(super) fn conjoin(
        &mut self,
        formula: &Formula,
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
        into: &mut Clauses,
    ) -> bool {
        match formula {
            Formula::And(parts) => parts.iter().all(|p| self.conjoin(p, binding, domains, into)),
            Formula::Literal(pattern, wanted) => self.literal(pattern, *wanted, binding, into),
            Formula::Same(a, b, wanted) => (a.bound(binding) == b.bound(binding)) == *wanted,
            Formula::Compare(comparison, left, right, wanted) => {
                let left = self.expression(left, binding);
                let right = self.expression(right, binding);
                self.comparison(Relation::of(*comparison, *wanted), left, right, into)
            }
            Formula::Call(call, wanted) => {
                let id = self.call(call, binding);
                into.calls.push((id, *wanted));
                true
            }
            Formula::Forall(slots, body) => each(slots, binding, domains, &mut |binding| {
                self.statics.tries.go_on() && self.conjoin(body, binding, domains, into)
            }),
            Formula::Or(parts) => {
                let mut branches = Vec::new();
                let mut certain = false;
                for part in parts {
                    certain |= !self.branch(part, binding, domains, &mut branches);
                }
                Self::close(branches, certain, into)
            }
            Formula::Exists(slots, body) => {
                let mut branches = Vec::new();
                let guards = guards_of(body);
                let mut certain = false;
                self.for_matches(slots, &guards, binding, domains, &mut |this, binding| {
                    certain |= !this.branch(body, binding, domains, &mut branches);
                });
                Self::close(branches, certain, into)
            }
        }
    }

    /// Adds one alternative of a disjunction to `branches`, unless it can never hold; `false` if
    /// the alternative always holds.
    fn branch(
        &mut self,
        part: &Formula,
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
        branches: &mut Vec<Clauses>,
    ) -> bool {
        let mut branch = Clauses::default();
        if !self.conjoin(part, binding, domains, &mut branch) {
            return true;
        }
        if branch.is_true() {
            return false;
        }
        branch.tidy();
        branches.push(branch);
        true
    }

    fn close(mut branches: Vec<Clauses>, certain: bool, into: &mut Clauses) -> bool {
        if certain {
            return true;
        }
        branches.sort();
        branches.dedup();
        match branches.len() {
            0 => return false,
            1 => into.merge(branches.remove(0)),
            _ => into.ors.push(branches),
        }
        true
    }

    fn literal(&mut self, pattern: &Pattern, wanted: bool, binding: &[u32], into: &mut Clauses) -> bool {
        let Some(atom) = found(&self.atoms, pattern, binding) else {
            return !wanted;
        };
        if !self.statics.fluent[pattern.predicate as usize] || self.always[atom as usize] {
            return wanted;
        }
        into.literals.push(atom << 1 | u32::from(!wanted));
        true
    }

    fn comparison(
        &mut self,
        relation: Relation,
        left: GroundExpression,
        right: GroundExpression,
        into: &mut Clauses,
    ) -> bool {
        if let (GroundExpression::Constant(left), GroundExpression::Constant(right)) = (&left, &right) {
            return relation.holds(*left, *right);
        }
        if [&left, &right].iter().any(|side| matches!(side, GroundExpression::Constant(v) if v.is_nan())) {
            return false;
        }
        let mut key = vec![relation as u64];
        encode(&left, &mut key);
        encode(&right, &mut key);
        let next = self.comparisons.len() as u32;
        let id = *self.comparison_ids.entry(key).or_insert(next);
        if id == next {
            self.comparisons.push(GroundComparison { left, relation, right });
        }
        into.comparisons.push(id);
        true
    }

    /// Ground expression under a binding, with constants folded.
    pub(super) fn expression(&mut self, number: &Number, binding: &[u32]) -> GroundExpression {
        if let Some(value) = self.statics.constant(number, binding) {
            return GroundExpression::Constant(value);
        }
        let mut pair = |p: &[Number; 2]| {
            (Box::new(self.expression(&p[0], binding)), Box::new(self.expression(&p[1], binding)))
        };
        match number {
            Number::Constant(value) => GroundExpression::Constant(*value),
            Number::Fluent(named) => GroundExpression::Fluent(self.numeric(named, binding)),
            Number::Call(call) => GroundExpression::Call(self.call(call, binding)),
            Number::Sum(parts) => {
                GroundExpression::Sum(parts.iter().map(|p| self.expression(p, binding)).collect())
            }
            Number::Product(parts) => {
                GroundExpression::Product(parts.iter().map(|p| self.expression(p, binding)).collect())
            }
            Number::Difference(sides) => {
                let (left, right) = pair(sides);
                GroundExpression::Difference(left, right)
            }
            Number::Quotient(sides) => {
                let (left, right) = pair(sides);
                GroundExpression::Quotient(left, right)
            }
            Number::Negative(inner) => GroundExpression::Negative(Box::new(self.expression(inner, binding))),
            Number::Duration => GroundExpression::Duration,
            Number::TotalTime => GroundExpression::TotalTime,
            Number::Violated(preference) => GroundExpression::Violated(*preference),
        }
    }

    /// Id of the numeric fluent that an effect changes.
    pub(super) fn numeric(&mut self, named: &Named, binding: &[u32]) -> u32 {
        let arguments = named.terms.iter().map(|t| t.bound(binding)).collect();
        self.numeric_id(NumericFluent { function: named.index, arguments })
    }

    /// Id of a numeric fluent; a new fluent gets the next id.
    pub(super) fn numeric_id(&mut self, fluent: NumericFluent) -> u32 {
        let next = self.numerics.len() as u32;
        let id = *self.numeric_ids.entry(fluent.clone()).or_insert(next);
        if id == next {
            self.numerics.push(fluent);
        }
        id
    }

    fn call(&mut self, call: &Named, binding: &[u32]) -> u32 {
        let arguments: Vec<u32> = call.terms.iter().map(|t| t.bound(binding)).collect();
        let (id, new) = self.call_ids.insert(call.index, &arguments);
        if !new {
            return id;
        }
        let origin = Origin { schema: call.index, arguments };
        let mut writes = Vec::new();
        let written = match self.statics.task.modules[call.index as usize].writes.is_empty() {
            true => Vec::new(),
            false => module_writes(self.statics.task, call.index),
        };
        for target in written {
            writes.push(match target {
                Target::Number(named) => RawPlace::Number(self.numeric(&named, &origin.arguments)),
                Target::Truth(pattern) => RawPlace::Truth(found(&self.atoms, &pattern, &origin.arguments)),
                Target::Object(pattern) => {
                    let prefix: Vec<u32> = pattern.terms.iter().map(|t| t.bound(&origin.arguments)).collect();
                    RawPlace::Object(self.values_of(pattern.predicate, &prefix))
                }
            });
        }
        self.calls.push(RawCall { origin, writes });
        id
    }

    /// Appends the ground effects of a lifted effect.
    pub(super) fn effect(
        &mut self,
        effect: &Effect_,
        at_end: bool,
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
        into: &mut Vec<RawEffect>,
    ) {
        if effect.forall.is_empty() {
            return self.one_effect(effect, at_end, binding, domains, into);
        }
        let guards = guards_of(if at_end { &effect.when.end } else { &effect.when.start });
        self.for_matches(&effect.forall, &guards, binding, domains, &mut |this, binding| {
            this.one_effect(effect, at_end, binding, domains, into);
        });
    }

    fn one_effect(
        &mut self,
        effect: &Effect_,
        at_end: bool,
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
        into: &mut Vec<RawEffect>,
    ) {
        let Ok(when) = self.when(effect, at_end, binding, domains) else { return };
        let mut push = |deed| into.push(RawEffect { when: when.clone(), deed });
        match &effect.change {
            Change_::Add(pattern) => {
                if let Some(atom) = found(&self.atoms, pattern, binding)
                    && !self.always[atom as usize]
                {
                    push(Deed::Add(atom));
                }
            }
            Change_::Delete(pattern) => {
                if let Some(atom) = found(&self.atoms, pattern, binding) {
                    push(Deed::Delete(atom));
                }
            }
            Change_::Unset(pattern) => {
                let prefix: Vec<u32> = pattern.terms.iter().map(|t| t.bound(binding)).collect();
                for atom in self.values_of(pattern.predicate, &prefix) {
                    push(Deed::Delete(atom));
                }
            }
            Change_::Number(how, fluent, amount) => {
                let fluent = self.numeric(fluent, binding);
                push(Deed::Change(fluent, *how, Box::new(self.expression(amount, binding))));
            }
            Change_::Call(call) => push(Deed::Call(self.call(call, binding))),
        }
    }

    /// Ground condition of an effect; `None`: unconditional; `Err`: can never hold.
    fn when(
        &mut self,
        effect: &Effect_,
        at_end: bool,
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
    ) -> Result<Option<Box<[Clauses; 3]>>, Never> {
        let formulas = [&effect.when.start, &effect.when.over_all, &effect.when.end];
        if formulas.iter().all(|formula| matches!(formula, Formula::And(parts) if parts.is_empty())) {
            return Ok(None);
        }
        let mut parts = [Clauses::default(), Clauses::default(), Clauses::default()];
        for (formula, part) in formulas.into_iter().zip(&mut parts) {
            if !self.conjoin(formula, binding, domains, part) {
                return Err(Never);
            }
            part.tidy();
        }
        let [start, over_all, end] = parts;
        let (here, at_start) = if at_end { (end, start) } else { (start, Clauses::default()) };
        let always = here.is_true() && at_start.is_true() && over_all.is_true();
        Ok(if always { None } else { Some(Box::new([here, at_start, over_all])) })
    }

    /// Reached atoms of an object function with the arguments `prefix`, one per value.
    pub(super) fn values_of(&mut self, predicate: u32, prefix: &[u32]) -> Vec<u32> {
        let mut pattern = prefix.to_vec();
        pattern.push(NONE);
        let (index, mut row) = self.atoms.first(predicate, &pattern);
        let mut found = Vec::new();
        while row != NONE {
            let (atom, arguments) = self.atoms.row(predicate, row);
            if arguments[..prefix.len()] == *prefix {
                found.push(atom);
            }
            row = self.atoms.next(predicate, index, row);
        }
        found
    }

    /// Calls `body` for every binding of the slots under which all guards (positive literals) are
    /// reached atoms.
    fn for_matches(
        &mut self,
        slots: &[u32],
        guards: &[&Pattern],
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
        body: &mut dyn FnMut(&mut Self, &mut Vec<u32>),
    ) {
        for &slot in slots {
            binding[slot as usize] = NONE;
        }
        self.match_next(slots, guards, binding, domains, body);
    }

    fn match_next(
        &mut self,
        slots: &[u32],
        guards: &[&Pattern],
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
        body: &mut dyn FnMut(&mut Self, &mut Vec<u32>),
    ) {
        if !self.statics.tries.go_on() {
            return;
        }
        let mut best: Option<(u32, usize)> = None;
        for (i, guard) in guards.iter().enumerate() {
            let pattern = guard.terms.iter().map(|t| t.bound(binding)).collect::<Vec<_>>();
            let open = |t: &Term| matches!(*t, Term::Slot(s) if binding[s as usize] == NONE);
            if guard.terms.iter().any(|t| open(t) && !matches!(*t, Term::Slot(s) if slots.contains(&s))) {
                continue;
            }
            if guard.terms.iter().any(open) {
                let count = self.atoms.count(guard.predicate, &pattern);
                if best.is_none_or(|(least, _)| count < least) {
                    best = Some((count, i));
                }
            }
        }
        if let Some((_, i)) = best {
            return self.match_guard(slots, guards, i, binding, domains, body);
        }
        match slots.iter().find(|&&slot| binding[slot as usize] == NONE) {
            None => body(self, binding),
            Some(&slot) => {
                for object in domains[slot as usize].iter() {
                    binding[slot as usize] = object.0;
                    self.match_next(slots, guards, binding, domains, body);
                }
                binding[slot as usize] = NONE;
            }
        }
    }

    fn match_guard(
        &mut self,
        slots: &[u32],
        guards: &[&Pattern],
        i: usize,
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
        body: &mut dyn FnMut(&mut Self, &mut Vec<u32>),
    ) {
        let guard = guards[i];
        let pattern = guard.terms.iter().map(|t| t.bound(binding)).collect::<Vec<_>>();
        let rest: Vec<&Pattern> =
            guards.iter().enumerate().filter(|&(j, _)| j != i).map(|(_, &g)| g).collect();
        let (index, mut row) = self.atoms.first(guard.predicate, &pattern);
        while row != NONE {
            let arguments = self.atoms.row(guard.predicate, row).1.to_vec();
            let mut bound = Vec::new();
            let fits = guard.terms.iter().zip(&arguments).all(|(term, &argument)| match *term {
                Term::Object(object) => object == argument,
                Term::Slot(slot) if binding[slot as usize] == NONE => {
                    binding[slot as usize] = argument;
                    bound.push(slot);
                    domains[slot as usize].binary_search(&ObjectId(argument)).is_ok()
                }
                Term::Slot(slot) => binding[slot as usize] == argument,
            });
            if fits {
                self.match_next(slots, &rest, binding, domains, body);
            }
            for slot in bound {
                binding[slot as usize] = NONE;
            }
            row = self.atoms.next(guard.predicate, index, row);
        }
    }
}

/// Positive literals that must hold for the formula to hold.
fn guards_of(formula: &Formula) -> Vec<&Pattern> {
    match formula {
        Formula::And(parts) => parts.iter().flat_map(guards_of).collect(),
        Formula::Literal(pattern, true) => vec![pattern],
        _ => Vec::new(),
    }
}

/// Appends an encoding of an expression to a key; different expressions have different keys.
fn encode(expression: &GroundExpression, key: &mut Vec<u64>) {
    let mut list = |tag: u64, parts: &[&GroundExpression]| {
        key.push(tag << 32 | parts.len() as u64);
        for part in parts {
            encode(part, key);
        }
    };
    match expression {
        GroundExpression::Constant(value) => key.extend([1, value.to_bits()]),
        GroundExpression::Fluent(id) => key.extend([2, u64::from(*id)]),
        GroundExpression::Call(id) => key.extend([3, u64::from(*id)]),
        GroundExpression::Duration => key.push(4),
        GroundExpression::TotalTime => key.push(5),
        GroundExpression::Violated(id) => key.extend([7, u64::from(*id)]),
        GroundExpression::Sum(parts) => list(8, &parts.iter().collect::<Vec<_>>()),
        GroundExpression::Product(parts) => list(9, &parts.iter().collect::<Vec<_>>()),
        GroundExpression::Difference(left, right) => list(10, &[left, right]),
        GroundExpression::Quotient(left, right) => list(11, &[left, right]),
        GroundExpression::Negative(inner) => list(12, &[inner]),
    }
}
