//! Determines the actions that may change the truth of a condition.

use rustc_hash::FxHashSet;

use crate::diagnostic::Span;
use crate::model::walk::{self, Part};
use crate::task::{
    Action, Atom, Change, Condition, Effect, Expression, FunctionId, GroundChange, PredicateId, Slot, Task,
    Term,
};

use super::conditions::{all, any};

/// Atoms, predicates and functions that conditions without variables depend on.
#[derive(Debug, Default)]
pub(super) struct Mentioned {
    atoms: Vec<Atom>,
    /// Predicates all of whose atoms count, because they are derived or occur in rules.
    predicates: FxHashSet<PredicateId>,
    functions: FxHashSet<FunctionId>,
    /// True if the conditions depend on attachments or `?duration`, which change without an effect.
    pub opaque: bool,
    /// True if the conditions themselves compare numbers.
    pub compares: bool,
}

impl Mentioned {
    pub(super) fn of<'t>(task: &'t Task, conditions: &'t [Condition]) -> Mentioned {
        let mut own = Mentioned::default();
        let mut derived: Vec<PredicateId> = Vec::new();
        for condition in conditions {
            walk::condition(condition, &mut |part| own.note(task, part, true, &mut derived));
        }
        while let Some(predicate) = derived.pop() {
            for rule in task.rules.iter().filter(|rule| rule.predicate == predicate) {
                walk::condition(&rule.body, &mut |part| own.note(task, part, false, &mut derived));
            }
        }
        own
    }

    fn note(&mut self, task: &Task, part: Part<'_>, ground: bool, derived: &mut Vec<PredicateId>) {
        match part {
            Part::Condition(Condition::Atom(atom)) => {
                let plain = ground && task.predicate(atom.predicate).stratum.is_none();
                if plain {
                    self.atoms.push(atom.clone());
                } else if self.predicates.insert(atom.predicate) {
                    derived.push(atom.predicate);
                }
            }
            Part::Condition(Condition::Compare(..)) => self.compares |= ground,
            Part::Fluent(fluent) => {
                self.functions.insert(fluent.function);
            }
            Part::Call(_) | Part::Expression(Expression::Duration) => self.opaque = true,
            _ => {}
        }
    }

    /// True if rates or timed literals may change the conditions between action starts and ends.
    pub(super) fn drifts(&self, task: &Task) -> bool {
        let mut rates = task.actions.iter().flat_map(|action| &action.continuous);
        let timed = |change: &GroundChange| match change {
            GroundChange::Add(fact) | GroundChange::Delete(fact) => {
                self.predicates.contains(&fact.predicate)
                    || self.atoms.iter().any(|atom| atom.predicate == fact.predicate)
            }
            GroundChange::Number(fluent, _) => self.functions.contains(&fluent.function),
            GroundChange::Object(fluent, _) => self.functions.contains(&fluent.function),
        };
        rates.any(|rate| self.functions.contains(&rate.fluent.function))
            || task.init.timed.iter().any(|entry| timed(&entry.change))
    }

    /// Condition on an action's parameters under which the given effects may change the conditions.
    pub(super) fn touched(&self, action: &Action, effects: &[Effect]) -> Condition {
        any(effects.iter().map(|effect| match &effect.change {
            Change::Add(atom) | Change::Delete(atom) if self.predicates.contains(&atom.predicate) => {
                Condition::TRUE
            }
            Change::Add(atom) | Change::Delete(atom) => {
                let same = self.atoms.iter().filter(|own| own.predicate == atom.predicate);
                any(same.filter_map(|own| unified(action, effect, &atom.arguments, &own.arguments)))
            }
            Change::Number(_, fluent, _) | Change::Object(fluent, _) => {
                let touched = self.functions.contains(&fluent.function);
                if touched { Condition::TRUE } else { Condition::Or(Vec::new()) }
            }
            Change::Call(_) => Condition::TRUE,
        }))
    }
}

/// Condition under which an effect's arguments are the given objects; `None` if they can never be.
fn unified(action: &Action, effect: &Effect, written: &[Term], own: &[Term]) -> Option<Condition> {
    let mut parts = Vec::new();
    for (written, own) in written.iter().zip(own) {
        let Term::Object(object) = own else { continue };
        match written {
            Term::Object(other) if other != object => return None,
            Term::Variable(slot) => {
                let parameter = action.parameters.get(slot.index());
                let quantified = effect.forall.iter().find(|variable| variable.slot == *slot);
                let variable = parameter.or(quantified.map(|variable| &variable.parameter));
                if variable.is_some_and(|variable| variable.objects.binary_search(object).is_err()) {
                    return None;
                }
                if parameter.is_some() {
                    parts.push(is(*slot, own));
                }
            }
            _ => {}
        }
    }
    Some(all(parts))
}

fn is(slot: Slot, object: &Term) -> Condition {
    Condition::Same(Box::new([Term::Variable(slot), object.clone()]), Span::default())
}
