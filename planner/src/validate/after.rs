//! State after the steps of a plan, by the semantics of the validator.

use std::sync::Arc;

use super::monitor::Broken;
use super::replay::{Until, replay};
use crate::attachment::{Attachments, FactValue, Reading};
use crate::plan::{Plan, Step};
use crate::semantics::Semantics;
use crate::state::State;
use crate::task::{Comparison, Task, When};

/// Facts that hold and numbers that are defined after a plan's steps, for the named predicates and
/// functions, in the order of the names and then of the objects. The goal is not checked. A step takes
/// the duration that its action gives it in the initial state, where defined, and the duration of the
/// plan otherwise.
///
/// # Errors
/// The first condition that does not hold, in the form of [`monitor`](super::monitor()).
pub fn after(
    task: &Task,
    attachments: &Attachments,
    steps: &Plan,
    names: &[&str],
) -> Result<Vec<Reading>, Box<Broken>> {
    let semantics = Semantics::new(task, attachments);
    let replayed = match replay(&semantics, &timed(&semantics, steps), Until::LastStep) {
        Ok(Ok(replayed)) => replayed,
        Ok(Err(fault)) => return Err(Box::new(Broken::of_fault(task, *fault))),
        Err(failure) => return Err(Box::new(Broken::of_call(task, &failure))),
    };
    Ok(names.iter().flat_map(|name| instances(task, &replayed.state, name)).collect())
}

/// Plan in which each step has the duration that its action fixes by `(= ?duration …)`, evaluated in
/// the initial state; a step keeps its own duration where that is undefined.
fn timed(semantics: &Semantics<'_>, steps: &Plan) -> Plan {
    let Ok(state) = semantics.initial() else { return steps.clone() };
    let asked_s = |step: &Step| -> Option<f64> {
        let (action, binding) = semantics.bind(step).ok()?;
        let bounds = semantics.task.action(action).duration.as_ref()?;
        let bound = bounds.iter().find(|b| b.comparison == Comparison::Equal && b.when == When::Start)?;
        semantics.number(&state, &bound.value, &binding).ok()?.filter(|s| s.is_finite())
    };
    let timed = |step: &Step| Step { duration_s: asked_s(step).unwrap_or(step.duration_s), ..step.clone() };
    Plan { steps: steps.steps.iter().map(timed).collect(), ..steps.clone() }
}

fn instances(task: &Task, state: &State, name: &str) -> Vec<Reading> {
    let named = |arguments: &[crate::task::ObjectId]| -> Arc<[Arc<str>]> {
        arguments.iter().map(|id| Arc::from(task.object(*id).name.as_str())).collect()
    };
    let mut found: Vec<(Vec<u32>, Reading)> = Vec::new();
    let mut add = |arguments: &[crate::task::ObjectId], value: FactValue| {
        let reading = Reading { symbol: Arc::from(name), arguments: named(arguments), value };
        found.push((arguments.iter().map(|id| id.0).collect(), reading));
    };
    for (id, _) in (0..).zip(&task.predicates).filter(|(_, p)| p.name == name) {
        state.instances(crate::task::PredicateId(id)).for_each(|a| add(a, FactValue::Truth(true)));
    }
    for (id, _) in (0..).zip(&task.functions).filter(|(_, f)| f.name == name) {
        state.values(crate::task::FunctionId(id)).for_each(|(a, v)| add(a, FactValue::Number(v)));
    }
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found.into_iter().map(|(_, reading)| reading).collect()
}
