//! Checks the constraints and preferences of PDDL3 (Gerevini and Long 2005) on the states that a plan
//! goes through.

use super::cause::{Cause, Fault};
use super::replay::{self, Replayed};
use crate::model::automaton::Automaton;
use crate::semantics::{Binding, CallFailure, Semantics, Why};
use crate::task::{Modal, Trajectory};

/// First hard constraint that a plan breaks; `None` if all hold.
pub(super) fn broken_constraint(
    semantics: &Semantics<'_>,
    replayed: &Replayed,
) -> Result<Option<Fault>, CallFailure> {
    for constraint in semantics.task.constraints.iter().filter(|one| one.preference.is_none()) {
        let mut broken = None;
        each_instance(semantics, constraint, &mut |binding| {
            if !holds(semantics, replayed, constraint, binding)? {
                let texts: Vec<String> =
                    constraint.conditions.iter().map(|one| semantics.condition_text(one, binding)).collect();
                broken = Some(texts.join(" "));
            }
            Ok(broken.is_some())
        })?;
        if let Some(text) = broken {
            let reason = format!("the constraint on {text} is broken");
            let why = Why { condition: text, compared: None, values: Vec::new(), span: constraint.span };
            let cause = Cause::Other { reason: reason.clone() };
            return Ok(Some(replay::fault(reason, None, cause, &why, "broken", None)));
        }
    }
    Ok(None)
}

/// Number of violations of each preference, from action conditions, the goal and constraints.
pub(super) fn violations(semantics: &Semantics<'_>, replayed: &Replayed) -> Result<Vec<f64>, CallFailure> {
    let mut counts = replayed.violations.clone();
    for (index, preference) in semantics.task.preferences.iter().enumerate() {
        for goal in &preference.goals {
            let mut binding = Binding::new(goal.slots);
            semantics.some_binding(&goal.forall, &mut binding, &mut |binding| {
                if !semantics.holds(&replayed.state, &goal.condition, binding)? {
                    counts[index] += 1.0;
                }
                Ok(false)
            })?;
        }
    }
    for constraint in &semantics.task.constraints {
        let Some(id) = constraint.preference else { continue };
        each_instance(semantics, constraint, &mut |binding| {
            if !holds(semantics, replayed, constraint, binding)? {
                counts[id.index()] += 1.0;
            }
            Ok(false)
        })?;
    }
    Ok(counts)
}

fn each_instance(
    semantics: &Semantics<'_>,
    constraint: &Trajectory,
    visit: &mut dyn FnMut(&mut Binding) -> Result<bool, CallFailure>,
) -> Result<bool, CallFailure> {
    semantics.some_binding(&constraint.forall, &mut Binding::new(constraint.slots), visit)
}

fn holds(
    semantics: &Semantics<'_>,
    replayed: &Replayed,
    constraint: &Trajectory,
    binding: &mut Binding,
) -> Result<bool, CallFailure> {
    let times: Vec<f64> = replayed.trace.iter().map(|(time, _)| *time).collect();
    let mut truth = |index: usize| -> Result<Vec<bool>, CallFailure> {
        let Some(condition) = constraint.conditions.get(index) else { return Ok(vec![false; times.len()]) };
        replayed.trace.iter().map(|(_, state)| semantics.holds(state, condition, binding)).collect()
    };
    let (first, second) = (truth(0)?, truth(1)?);
    let time = |index: usize| constraint.times_s.get(index).copied().unwrap_or(0.0);
    // The state that lasts from one happening to the next is there at every time between them.
    let ends = |at: usize| times.get(at + 1).copied().unwrap_or(f64::INFINITY);
    let all = 0..times.len();
    if let Some(automaton) = Automaton::of(constraint.operator) {
        return Ok(automaton.accepts(first.into_iter().zip(second)));
    }
    Ok(match constraint.operator {
        Modal::Within => all.into_iter().any(|at| first[at] && times[at] <= time(0)),
        Modal::AlwaysWithin => all.into_iter().all(|at| {
            let soon = |later: usize| second[later] && times[later] - times[at] <= time(0);
            !first[at] || (at..times.len()).any(soon)
        }),
        Modal::HoldDuring => {
            all.into_iter().all(|at| first[at] || ends(at) <= time(0) || times[at] >= time(1))
        }
        // The one that is left: `hold-after`.
        _ => all.into_iter().all(|at| first[at] || ends(at) <= time(0)),
    })
}
