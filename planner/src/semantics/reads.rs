//! Read and write sets of the actions in a happening, for detecting interference (mutex).
//!
//! PDDL 2.1, section 8.1: two actions may happen at the same time only if neither writes what the other
//! reads, and neither undoes what the other does ("no moving targets").

use rustc_hash::FxHashSet;

use super::calls::{ReadSymbol, instances};
use super::effects::Changes;
use super::{Binding, CallFailure, Semantics};
use crate::state::State;
use crate::task::{
    Assignment, CallTerm, Change, Condition, Effect, Expression, Fact, GroundChange, GroundFluent, ObjectId,
    PredicateId, Task, Term, Written,
};

/// Read and write set of one action or timed literal in a happening.
#[derive(Debug, Clone, Default)]
pub struct Touched {
    facts: FxHashSet<Fact>,
    fluents: FxHashSet<GroundFluent>,
    /// Predicates read as a whole, because a derived fact that is read depends on them.
    predicates: FxHashSet<PredicateId>,
    /// Changes that are made (write set).
    pub changes: Changes,
}

impl Touched {
    /// First fact or fluent that one side writes and the other reads or writes differently; `None` if
    /// the two do not interfere.
    pub fn conflict(&self, other: &Touched, semantics: &Semantics<'_>) -> Option<String> {
        self.disturbs(other, semantics).or_else(|| other.disturbs(self, semantics))
    }

    fn disturbs(&self, other: &Touched, semantics: &Semantics<'_>) -> Option<String> {
        let written = self.changes.added.iter().chain(&self.changes.deleted);
        let read = |fact: &&Fact| other.facts.contains(*fact) || other.predicates.contains(&fact.predicate);
        if let Some(fact) = written.clone().find(read) {
            return Some(semantics.fact_text(fact));
        }
        if let Some(fact) = self.changes.added.iter().find(|fact| other.changes.deleted.contains(fact)) {
            return Some(semantics.fact_text(fact));
        }
        let numbers = self.changes.numbers.iter().map(|(fluent, assignment, ..)| (fluent, Some(*assignment)));
        let cleared = self.changes.cleared.iter().map(|fluent| (fluent, None));
        for (fluent, assignment) in numbers.chain(cleared) {
            let both_write = other.changes.numbers.iter().any(|(own, kind, ..)| {
                own == fluent && !(is_additive(*kind) && assignment.is_some_and(is_additive))
            });
            if other.fluents.contains(fluent) || both_write {
                return Some(semantics.ground_text(fluent));
            }
        }
        for (fluent, ..) in &self.changes.objects {
            if other.fluents.contains(fluent) || other.changes.objects.iter().any(|(own, ..)| own == fluent) {
                return Some(semantics.ground_text(fluent));
            }
        }
        None
    }
}

/// Joint read and write set of several participants of a happening; one lookup tells if a further
/// participant may interfere with any of them.
#[derive(Debug, Default)]
pub struct Together {
    facts: FxHashSet<Fact>,
    fluents: FxHashSet<GroundFluent>,
    predicates: FxHashSet<PredicateId>,
    added: FxHashSet<Fact>,
    deleted: FxHashSet<Fact>,
    written: FxHashSet<PredicateId>,
    /// Numbers that are increased or decreased.
    moved: FxHashSet<GroundFluent>,
    /// Numbers and object functions that are assigned, scaled or made undefined.
    set: FxHashSet<GroundFluent>,
}

impl Together {
    /// Adds the read and write set of a participant.
    pub fn extend(&mut self, touched: &Touched) {
        self.facts.extend(touched.facts.iter().cloned());
        self.fluents.extend(touched.fluents.iter().cloned());
        self.predicates.extend(touched.predicates.iter().copied());
        let Changes { added, deleted, numbers, cleared, objects } = &touched.changes;
        self.added.extend(added.iter().cloned());
        self.deleted.extend(deleted.iter().cloned());
        self.written.extend(added.iter().chain(deleted).map(|fact| fact.predicate));
        for (fluent, kind, ..) in numbers {
            if is_additive(*kind) { &mut self.moved } else { &mut self.set }.insert(fluent.clone());
        }
        self.set.extend(cleared.iter().chain(objects.iter().map(|(fluent, ..)| fluent)).cloned());
    }

    /// True if a participant may conflict with an added one ([`Touched::conflict`]); may be true
    /// without a conflict.
    pub fn may_conflict(&self, touched: &Touched) -> bool {
        let Changes { added, deleted, numbers, cleared, objects } = &touched.changes;
        let mut written = added.iter().chain(deleted);
        let is_written = |fact: &Fact| self.added.contains(fact) || self.deleted.contains(fact);
        let touches = |fluent: &GroundFluent| self.fluents.contains(fluent) || self.set.contains(fluent);
        let changes = |fluent: &GroundFluent| self.moved.contains(fluent) || self.set.contains(fluent);
        written.any(|fact| self.facts.contains(fact) || self.predicates.contains(&fact.predicate))
            || touched.facts.iter().any(is_written)
            || touched.predicates.iter().any(|predicate| self.written.contains(predicate))
            || added.iter().any(|fact| self.deleted.contains(fact))
            || deleted.iter().any(|fact| self.added.contains(fact))
            || touched.fluents.iter().any(changes)
            || numbers.iter().any(|(fluent, kind, ..)| {
                touches(fluent) || !is_additive(*kind) && self.moved.contains(fluent)
            })
            || cleared
                .iter()
                .chain(objects.iter().map(|(fluent, ..)| fluent))
                .any(|fluent| touches(fluent) || self.moved.contains(fluent))
    }
}

fn is_additive(kind: Assignment) -> bool {
    matches!(kind, Assignment::Increase | Assignment::Decrease)
}

impl Semantics<'_> {
    /// Adds the facts and fluents that a condition reads to `touched`.
    pub fn reads(
        &self,
        state: &State,
        condition: &Condition,
        binding: &mut Binding,
        touched: &mut Touched,
    ) -> Result<(), CallFailure> {
        // What decides a condition once and for all leaves the rest of it without a meaning.
        if self.constant(state, condition, binding).is_some() {
            return Ok(());
        }
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                for part in parts {
                    self.reads(state, part, binding, touched)?;
                }
            }
            Condition::Not(inner) => self.reads(state, inner, binding, touched)?,
            Condition::Forall(variables, inner) | Condition::Exists(variables, inner) => {
                self.some_binding(variables, binding, &mut |binding| {
                    self.reads(state, inner, binding, touched)?;
                    Ok(false)
                })?;
            }
            Condition::Atom(atom) => {
                self.terms_read(state, &atom.arguments, binding, touched);
                if let Some(arguments) = self.objects(state, &atom.arguments, binding) {
                    self.fact_read(atom.predicate, arguments, touched);
                }
            }
            Condition::Same(terms, _) => self.terms_read(state, &**terms, binding, touched),
            Condition::Compare(_, sides, _) => {
                sides.iter().for_each(|side| self.expression_reads(state, side, binding, touched));
            }
            Condition::Call(call) => self.call_reads(state, call, binding, touched),
        }
        Ok(())
    }

    /// Truth of a condition that never changes; `None` if its truth may change or is not known to be
    /// constant.
    fn constant(&self, state: &State, condition: &Condition, binding: &Binding) -> Option<bool> {
        match condition {
            Condition::And(parts) => {
                let mut truths = parts.iter().map(|part| self.constant(state, part, binding));
                let all = truths.clone().all(|truth| truth == Some(true));
                if all { Some(true) } else { truths.any(|truth| truth == Some(false)).then_some(false) }
            }
            Condition::Or(parts) => {
                let mut truths = parts.iter().map(|part| self.constant(state, part, binding));
                let none = truths.clone().all(|truth| truth == Some(false));
                if none { Some(false) } else { truths.any(|truth| truth == Some(true)).then_some(true) }
            }
            Condition::Not(inner) => self.constant(state, inner, binding).map(|truth| !truth),
            Condition::Atom(atom) => {
                let fixed = atom.arguments.iter().all(|term| !matches!(term, Term::Function(_)));
                let arguments = (fixed && !self.changing[atom.predicate.index()])
                    .then(|| self.objects(state, &atom.arguments, binding))??;
                Some(state.holds(atom.predicate, &arguments))
            }
            Condition::Same(..)
            | Condition::Compare(..)
            | Condition::Call(_)
            | Condition::Forall(..)
            | Condition::Exists(..) => None,
        }
    }

    /// Adds the facts and fluents that effects read in their conditions and values to `touched`.
    pub fn effect_reads(
        &self,
        state: &State,
        effects: &[Effect],
        at_end: bool,
        binding: &mut Binding,
        touched: &mut Touched,
    ) -> Result<(), CallFailure> {
        for effect in effects {
            self.some_binding(&effect.forall, binding, &mut |binding| {
                let when = if at_end { &effect.when.end } else { &effect.when.start };
                self.reads(state, when, binding, touched)?;
                match &effect.change {
                    Change::Add(atom) | Change::Delete(atom) => {
                        self.terms_read(state, &atom.arguments, binding, touched);
                    }
                    Change::Number(_, fluent, value) => {
                        self.terms_read(state, &fluent.arguments, binding, touched);
                        self.expression_reads(state, value, binding, touched);
                    }
                    Change::Object(fluent, value) => {
                        self.terms_read(state, &fluent.arguments, binding, touched);
                        self.terms_read(state, value.as_slice(), binding, touched);
                    }
                    Change::Call(call) => self.call_reads(state, call, binding, touched),
                }
                Ok(false)
            })?;
        }
        Ok(())
    }

    fn fact_read(&self, predicate: PredicateId, arguments: Vec<ObjectId>, touched: &mut Touched) {
        if self.task.predicate(predicate).stratum.is_some() {
            depends_on(self.task, predicate, &mut touched.predicates);
        }
        touched.facts.insert(Fact { predicate, arguments: arguments.into() });
    }

    fn terms_read(&self, state: &State, terms: &[Term], binding: &Binding, touched: &mut Touched) {
        for term in terms {
            if let Term::Function(fluent) = term {
                self.terms_read(state, &fluent.arguments, binding, touched);
                touched.fluents.extend(self.ground(state, fluent, binding));
            }
        }
    }

    pub(crate) fn expression_reads(
        &self,
        state: &State,
        expression: &Expression,
        binding: &Binding,
        touched: &mut Touched,
    ) {
        match expression {
            Expression::Fluent(fluent) => {
                self.terms_read(state, &fluent.arguments, binding, touched);
                touched.fluents.extend(self.ground(state, fluent, binding));
            }
            Expression::Add(parts) | Expression::Multiply(parts) => {
                parts.iter().for_each(|part| self.expression_reads(state, part, binding, touched));
            }
            Expression::Subtract(sides) | Expression::Divide(sides) => {
                sides.iter().for_each(|side| self.expression_reads(state, side, binding, touched));
            }
            Expression::Negative(inner) => self.expression_reads(state, inner, binding, touched),
            Expression::Call(call) => self.call_reads(state, call, binding, touched),
            Expression::Number(_)
            | Expression::Duration
            | Expression::TotalTime
            | Expression::Violated(_) => {}
        }
    }

    fn call_reads(&self, state: &State, call: &CallTerm, binding: &Binding, touched: &mut Touched) {
        self.terms_read(state, &call.arguments, binding, touched);
        let Some(arguments) = self.objects(state, &call.arguments, binding) else { return };
        for read in self.attachments.reads(&self.bound[call.module.index()]) {
            for (symbol, arguments) in instances(self.task, read, &arguments) {
                match symbol {
                    ReadSymbol::Predicate(id) => self.fact_read(id, arguments, touched),
                    ReadSymbol::Function(function) => {
                        touched.fluents.insert(GroundFluent { function, arguments: arguments.into() });
                    }
                }
            }
        }
    }
}

/// Adds a predicate and all predicates on which its rules depend to `into`.
pub(crate) fn depends_on(task: &Task, derived: PredicateId, into: &mut FxHashSet<PredicateId>) {
    if !into.insert(derived) {
        return;
    }
    for rule in task.rules.iter().filter(|rule| rule.predicate == derived) {
        predicates_in(task, &rule.body, into);
    }
}

fn predicates_in(task: &Task, condition: &Condition, into: &mut FxHashSet<PredicateId>) {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            parts.iter().for_each(|part| predicates_in(task, part, into));
        }
        Condition::Not(inner) | Condition::Forall(_, inner) | Condition::Exists(_, inner) => {
            predicates_in(task, inner, into);
        }
        Condition::Atom(atom) if task.predicate(atom.predicate).stratum.is_some() => {
            depends_on(task, atom.predicate, into);
        }
        Condition::Atom(atom) => {
            into.insert(atom.predicate);
        }
        Condition::Same(..) | Condition::Compare(..) | Condition::Call(_) => {}
    }
}

/// True, by predicate, if it is derived, or an action, module or timed literal may change it.
pub(super) fn changing(task: &Task) -> Vec<bool> {
    let mut changing: Vec<bool> =
        task.predicates.iter().map(|predicate| predicate.stratum.is_some()).collect();
    for action in &task.actions {
        for effect in action.effects.start.iter().chain(&action.effects.end) {
            if let Change::Add(atom) | Change::Delete(atom) = &effect.change {
                changing[atom.predicate.index()] = true;
            }
        }
    }
    for written in task.modules.iter().flat_map(|module| &module.writes) {
        if let Written::Truth(atom) = written {
            changing[atom.predicate.index()] = true;
        }
    }
    for timed in &task.init.timed {
        if let GroundChange::Add(fact) | GroundChange::Delete(fact) = &timed.change {
            changing[fact.predicate.index()] = true;
        }
    }
    changing
}
