//! Pre-order traversal of the conditions, expressions, calls and terms of a task.

use crate::task::{Action, CallTerm, Change, Condition, Effect, Expression, Fluent, Task, Term, Timed};

/// Node that a traversal visits.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Part<'t> {
    Condition(&'t Condition),
    Expression(&'t Expression),
    Call(&'t CallTerm),
    /// Function with arguments, whose value is read or changed.
    Fluent(&'t Fluent),
    /// Change by an effect.
    Change(&'t Change),
}

/// Visits a condition and all its parts.
pub(crate) fn condition<'t>(own: &'t Condition, visit: &mut dyn FnMut(Part<'t>)) {
    visit(Part::Condition(own));
    match own {
        Condition::And(parts) | Condition::Or(parts) => {
            parts.iter().for_each(|part| condition(part, visit));
        }
        Condition::Not(inner) | Condition::Forall(_, inner) | Condition::Exists(_, inner) => {
            condition(inner, visit);
        }
        Condition::Atom(atom) => terms(&atom.arguments, visit),
        Condition::Same(both, _) => terms(&**both, visit),
        Condition::Compare(_, sides, _) => sides.iter().for_each(|side| expression(side, visit)),
        Condition::Call(own) => call(own, visit),
    }
}

/// Visits an expression and all its parts.
pub(crate) fn expression<'t>(own: &'t Expression, visit: &mut dyn FnMut(Part<'t>)) {
    visit(Part::Expression(own));
    match own {
        Expression::Fluent(own) => fluent(own, visit),
        Expression::Add(parts) | Expression::Multiply(parts) => {
            parts.iter().for_each(|part| expression(part, visit));
        }
        Expression::Subtract(sides) | Expression::Divide(sides) => {
            sides.iter().for_each(|side| expression(side, visit));
        }
        Expression::Negative(inner) => expression(inner, visit),
        Expression::Call(own) => call(own, visit),
        Expression::Number(_) | Expression::Duration | Expression::TotalTime | Expression::Violated(_) => {}
    }
}

fn call<'t>(own: &'t CallTerm, visit: &mut dyn FnMut(Part<'t>)) {
    visit(Part::Call(own));
    terms(&own.arguments, visit);
}

fn terms<'t>(all: &'t [Term], visit: &mut dyn FnMut(Part<'t>)) {
    for term in all {
        if let Term::Function(own) = term {
            fluent(own, visit);
        }
    }
}

fn fluent<'t>(own: &'t Fluent, visit: &mut dyn FnMut(Part<'t>)) {
    visit(Part::Fluent(own));
    terms(&own.arguments, visit);
}

fn timed<'t>(own: &'t Timed<Condition>, visit: &mut dyn FnMut(Part<'t>)) {
    [&own.start, &own.over_all, &own.end].into_iter().for_each(|part| condition(part, visit));
}

fn effect<'t>(own: &'t Effect, visit: &mut dyn FnMut(Part<'t>)) {
    timed(&own.when, visit);
    visit(Part::Change(&own.change));
    match &own.change {
        Change::Add(atom) | Change::Delete(atom) => terms(&atom.arguments, visit),
        Change::Number(_, own, value) => {
            fluent(own, visit);
            expression(value, visit);
        }
        Change::Object(own, value) => {
            fluent(own, visit);
            terms(value.as_slice(), visit);
        }
        Change::Call(own) => call(own, visit),
    }
}

/// Visits all parts of an action.
pub(crate) fn action<'t>(own: &'t Action, visit: &mut dyn FnMut(Part<'t>)) {
    own.grounding.iter().for_each(|own| call(own, visit));
    own.duration.iter().flatten().for_each(|bound| expression(&bound.value, visit));
    timed(&own.condition, visit);
    own.effects.start.iter().chain(&own.effects.end).for_each(|own| effect(own, visit));
    for rate in &own.continuous {
        fluent(&rate.fluent, visit);
        expression(&rate.per_second, visit);
    }
    own.preferences.iter().for_each(|(_, preferred)| timed(preferred, visit));
}

/// Calls among the nodes that a traversal visits.
fn calls<'t>(walk: impl FnOnce(&mut dyn FnMut(Part<'t>))) -> Vec<&'t CallTerm> {
    let mut calls = Vec::new();
    walk(&mut |part| {
        if let Part::Call(call) = part {
            calls.push(call);
        }
    });
    calls
}

impl Action {
    /// All module calls of the action: grounding, duration, conditions, effects, rates and
    /// preferences.
    pub fn calls(&self) -> Vec<&CallTerm> {
        calls(|visit| action(self, visit))
    }
}

impl Expression {
    /// All module calls of the expression.
    pub fn calls(&self) -> Vec<&CallTerm> {
        calls(|visit| expression(self, visit))
    }
}

/// Visits the goal, constraints, preferences and metric of a task.
pub(crate) fn aims<'t>(task: &'t Task, visit: &mut dyn FnMut(Part<'t>)) {
    condition(&task.goal.body, visit);
    let constraints = task.constraints.iter().flat_map(|constraint| &constraint.conditions);
    let preferred =
        task.preferences.iter().flat_map(|preference| &preference.goals).map(|goal| &goal.condition);
    constraints.chain(preferred).for_each(|own| condition(own, visit));
    task.metric.iter().for_each(|metric| expression(&metric.value, visit));
}

/// Copy of an expression in which each subexpression is replaced for which `with` gives another.
pub(crate) fn replaced(own: &Expression, with: &dyn Fn(&Expression) -> Option<Expression>) -> Expression {
    let list = |parts: &[Expression]| parts.iter().map(|part| replaced(part, with)).collect();
    let both = |sides: &[Expression; 2]| Box::new(sides.each_ref().map(|side| replaced(side, with)));
    with(own).unwrap_or_else(|| match own {
        Expression::Add(parts) => Expression::Add(list(parts)),
        Expression::Multiply(parts) => Expression::Multiply(list(parts)),
        Expression::Subtract(sides) => Expression::Subtract(both(sides)),
        Expression::Divide(sides) => Expression::Divide(both(sides)),
        Expression::Negative(inner) => Expression::Negative(Box::new(replaced(inner, with))),
        other => other.clone(),
    })
}
