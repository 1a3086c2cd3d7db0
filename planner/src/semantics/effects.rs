//! Effects: the changes that they make, evaluated in the state before the happening.

use super::{Binding, CallFailure, Semantics};
use crate::attachment::{Answer, FactValue};
use crate::diagnostic::Span;
use crate::model::agreement::{contradictions, reset};
use crate::state::State;
use crate::task::{
    ActionId, Assignment, CallTerm, Change, Effect, Fact, Fluent, GroundFluent, ObjectId, Timed, Written,
};

/// Changes made by one happening.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Changes {
    /// Facts that become false, unless they are also added.
    pub deleted: Vec<Fact>,
    /// Facts that become true.
    pub added: Vec<Fact>,
    /// Numbers that change: fluent, kind of change, amount and span of the effect.
    pub numbers: Vec<(GroundFluent, Assignment, f64, Span)>,
    /// Numbers that become undefined.
    pub cleared: Vec<GroundFluent>,
    /// Object functions that get a value, or lose it (`None`), with the span of the effect.
    pub objects: Vec<(GroundFluent, Option<ObjectId>, Span)>,
}

impl Changes {
    /// First number or object function with contradicting changes, and the span of the second change;
    /// `None` if all changes agree.
    fn contradiction(&self) -> Option<(&GroundFluent, Span)> {
        let numbers = self.numbers.iter();
        let kinds = numbers.clone().map(|(fluent, assignment, number, _)| (fluent, *assignment, *number));
        if let Some(&(_, second)) = contradictions(kinds).first() {
            let (fluent, _, _, span) = &self.numbers[second];
            return Some((fluent, *span));
        }
        if let Some((fluent, _, _, span)) = numbers.into_iter().find(|(own, ..)| self.cleared.contains(own)) {
            return Some((fluent, *span));
        }
        let values = self.objects.iter().map(|(fluent, value, _)| (fluent, *value));
        let (_, second) = reset(values)?;
        let (fluent, _, span) = &self.objects[second];
        Some((fluent, *span))
    }
}

/// Effect that cannot be applied: a value is undefined, or two changes contradict each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Clash {
    /// Reason in a sentence.
    pub reason: String,
    /// Span of the effect.
    pub span: Span,
}

/// End effects of a running action whose conditions on earlier times have held so far.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pending {
    /// Index of each effect, with the objects of its quantified variables.
    instances: Vec<(usize, Vec<ObjectId>)>,
}

impl Semantics<'_> {
    /// Adds the changes of effects to `changes`. `pending` is `None` for effects at start; for effects
    /// at end it holds those whose conditions on earlier times held, and others with such conditions do
    /// not happen.
    pub fn changes(
        &self,
        state: &State,
        effects: &[Effect],
        binding: &mut Binding,
        pending: Option<&Pending>,
        changes: &mut Changes,
    ) -> Result<Result<(), Clash>, CallFailure> {
        for (index, effect) in effects.iter().enumerate() {
            let mut clash = None;
            let at_end = pending.is_some();
            self.some_binding(&effect.forall, binding, &mut |binding| {
                let now = if at_end { &effect.when.end } else { &effect.when.start };
                if at_end && is_remembered(effect) {
                    let objects = objects_of(effect, binding);
                    let known = pending.is_some_and(|pending| pending.instances.contains(&(index, objects)));
                    if !known {
                        return Ok(false);
                    }
                }
                if self.holds(state, now, binding)? {
                    clash = self.change(state, effect, binding, changes)?.err();
                }
                Ok(clash.is_some())
            })?;
            if let Some(clash) = clash {
                return Ok(Err(clash));
            }
        }
        Ok(Ok(()))
    }

    /// End effects with conditions on earlier times whose start conditions hold in the state.
    pub fn remember(
        &self,
        state: &State,
        effects: &[Effect],
        binding: &mut Binding,
    ) -> Result<Pending, CallFailure> {
        let mut pending = Pending::default();
        for (index, effect) in effects.iter().enumerate().filter(|(_, effect)| is_remembered(effect)) {
            self.some_binding(&effect.forall, binding, &mut |binding| {
                if self.holds(state, &effect.when.start, binding)? {
                    pending.instances.push((index, objects_of(effect, binding)));
                }
                Ok(false)
            })?;
        }
        Ok(pending)
    }

    /// Drops the pending effects whose over-all conditions do not hold in the state.
    pub fn keep(
        &self,
        state: &State,
        effects: &[Effect],
        binding: &mut Binding,
        pending: &mut Pending,
    ) -> Result<(), CallFailure> {
        let mut kept = Vec::with_capacity(pending.instances.len());
        for (index, objects) in std::mem::take(&mut pending.instances) {
            let effect = &effects[index];
            for (quantified, object) in effect.forall.iter().zip(&objects) {
                binding.set(quantified.slot, *object);
            }
            if self.holds(state, &effect.when.over_all, binding)? {
                kept.push((index, objects));
            }
        }
        pending.instances = kept;
        Ok(())
    }

    fn change(
        &self,
        state: &State,
        effect: &Effect,
        binding: &Binding,
        changes: &mut Changes,
    ) -> Result<Result<(), Clash>, CallFailure> {
        let undefined =
            |what: String| Err(Clash { reason: format!("{what} has no value"), span: effect.span });
        match &effect.change {
            Change::Add(atom) | Change::Delete(atom) => {
                let Some(arguments) = self.objects(state, &atom.arguments, binding) else {
                    return Ok(undefined(self.atom_text(atom, binding)));
                };
                let fact = Fact { predicate: atom.predicate, arguments: arguments.into() };
                let list = if matches!(effect.change, Change::Add(_)) {
                    &mut changes.added
                } else {
                    &mut changes.deleted
                };
                list.push(fact);
            }
            Change::Number(assignment, fluent, value) => {
                let Some(ground) = self.ground(state, fluent, binding) else {
                    return Ok(undefined(self.fluent_text(fluent, binding)));
                };
                let Some(number) = self.number(state, value, binding)?.filter(|number| number.is_finite())
                else {
                    return Ok(undefined(self.expression_text(value, binding)));
                };
                changes.numbers.push((ground, *assignment, number, effect.span));
            }
            Change::Object(fluent, value) => {
                let Some(ground) = self.ground(state, fluent, binding) else {
                    return Ok(undefined(self.fluent_text(fluent, binding)));
                };
                let value = match value {
                    None => None,
                    Some(term) => match self.object(state, term, binding) {
                        Some(object) => Some(object),
                        None => return Ok(undefined(self.term_text(term, binding))),
                    },
                };
                changes.objects.push((ground, value, effect.span));
            }
            Change::Call(call) => return self.written(state, call, binding, changes),
        }
        Ok(Ok(()))
    }

    /// Adds the changes that an effect module answers.
    fn written(
        &self,
        state: &State,
        call: &CallTerm,
        binding: &Binding,
        changes: &mut Changes,
    ) -> Result<Result<(), Clash>, CallFailure> {
        let module = self.task.module(call.module);
        let clash = |reason: String| Ok(Err(Clash { reason, span: call.span }));
        let (Some(answer), Some(arguments)) =
            (self.ask(state, call, binding)?, self.objects(state, &call.arguments, binding))
        else {
            return clash(format!("an argument of {} has no value", self.call_text(call, binding)));
        };
        let Answer::Writes(values) = answer else { return Ok(Ok(())) };
        if values.len() != module.writes.len() {
            let reason = format!(
                "module `{}` writes {} values, answered {}",
                module.name,
                module.writes.len(),
                values.len()
            );
            return clash(reason);
        }
        let mut inner = Binding::new(module.parameters.len());
        inner.objects = arguments;
        for (place, value) in module.writes.iter().zip(values) {
            let fluent = match place {
                Written::Number(fluent) | Written::Object(fluent) => self.ground(state, fluent, &inner),
                Written::Truth(_) => None,
            };
            match (place, value, fluent) {
                (Written::Number(_), FactValue::Number(number), Some(fluent)) => {
                    changes.numbers.push((fluent, Assignment::Assign, number, call.span));
                }
                (Written::Number(_), FactValue::Undefined, Some(fluent)) => changes.cleared.push(fluent),
                (Written::Object(_), FactValue::Undefined, Some(fluent)) => {
                    changes.objects.push((fluent, None, call.span));
                }
                (Written::Object(_), FactValue::Object(name), Some(fluent)) => match self
                    .task
                    .find_object(&name)
                {
                    Some(object) => changes.objects.push((fluent, Some(object), call.span)),
                    None => {
                        return clash(format!("module `{}` wrote the unknown object `{name}`", module.name));
                    }
                },
                (Written::Truth(atom), FactValue::Truth(truth), _) => {
                    let Some(arguments) = self.objects(state, &atom.arguments, &inner) else { continue };
                    let fact = Fact { predicate: atom.predicate, arguments: arguments.into() };
                    if truth { changes.added.push(fact) } else { changes.deleted.push(fact) }
                }
                (place, value, _) => {
                    let wanted = match place {
                        Written::Number(_) => "a number",
                        Written::Object(_) => "an object",
                        Written::Truth(_) => "true or false",
                    };
                    return clash(format!("module `{}` wrote {value:?} where {wanted} belongs", module.name));
                }
            }
        }
        Ok(Ok(()))
    }

    pub(crate) fn ground(&self, state: &State, fluent: &Fluent, binding: &Binding) -> Option<GroundFluent> {
        let arguments = self.objects(state, &fluent.arguments, binding)?;
        Some(GroundFluent { function: fluent.function, arguments: arguments.into() })
    }

    /// Applies changes (deletions, additions, then values) and updates the derived facts.
    pub fn apply(&self, state: &mut State, changes: &Changes) -> Result<Result<(), Clash>, CallFailure> {
        if let Some((fluent, span)) = changes.contradiction() {
            let reason = format!("two changes of {} at once contradict each other", self.ground_text(fluent));
            return Ok(Err(Clash { reason, span }));
        }
        for fact in &changes.deleted {
            state.set_fact(fact.predicate, &fact.arguments, false);
        }
        for fact in &changes.added {
            state.set_fact(fact.predicate, &fact.arguments, true);
        }
        for fluent in &changes.cleared {
            state.set_number(fluent.function, &fluent.arguments, None);
        }
        for (fluent, assignment, number, span) in &changes.numbers {
            let before = state.number(fluent.function, &fluent.arguments);
            let after = match (assignment, before) {
                (Assignment::Assign, _) => *number,
                (_, None) => {
                    let reason = format!("{} has no value yet", self.ground_text(fluent));
                    return Ok(Err(Clash { reason, span: *span }));
                }
                (Assignment::Increase, Some(before)) => before + number,
                (Assignment::Decrease, Some(before)) => before - number,
                (Assignment::ScaleUp, Some(before)) => before * number,
                (Assignment::ScaleDown, Some(before)) => before / number,
            };
            if !after.is_finite() {
                let reason = format!("{} would not be a finite number", self.ground_text(fluent));
                return Ok(Err(Clash { reason, span: *span }));
            }
            state.set_number(fluent.function, &fluent.arguments, Some(after));
        }
        for (fluent, value, _) in &changes.objects {
            state.set_object(fluent.function, &fluent.arguments, *value);
        }
        self.derive(state)?;
        Ok(Ok(()))
    }

    /// Applies the effects of an instantaneous action; its condition is not checked.
    pub fn apply_action(
        &self,
        state: &mut State,
        action: ActionId,
        binding: &mut Binding,
    ) -> Result<Result<(), Clash>, CallFailure> {
        let mut changes = Changes::default();
        let effects = &self.task.action(action).effects.start;
        if let Err(clash) = self.changes(state, effects, binding, None, &mut changes)? {
            return Ok(Err(clash));
        }
        self.apply(state, &changes)
    }
}

/// True if an end effect has a condition on the start or the over-all interval of its action.
fn is_remembered(effect: &Effect) -> bool {
    let Timed { start, over_all, .. } = &effect.when;
    !start.is_true() || !over_all.is_true()
}

fn objects_of(effect: &Effect, binding: &Binding) -> Vec<ObjectId> {
    effect.forall.iter().map(|quantified| binding.get(quantified.slot)).collect()
}
