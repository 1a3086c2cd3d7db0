//! The validator: judges a plan by replay, goal, constraints and metric.

use serde::Serialize;

use crate::attachment::Attachments;
use crate::diagnostic::{Diagnostic, Findings};
use crate::plan::{Plan, Step};
use crate::semantics::{Binding, CallFailure, Semantics};
use crate::task::{Action, Task};

use super::cause::{Cause, Fault, Unmet};
use super::replay::{Replayed, Until, fault, replay};
use super::timeline::makespan_s;
use super::trajectory::{broken_constraint, violations};

/// Verdict of the validator on a plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// True if every step can be executed, and the goal and all hard constraints hold.
    pub valid: bool,
    /// Reason why the plan is invalid, in one sentence; `None` for a valid plan.
    pub reason: Option<String>,
    /// Step at fault, counted from 0; `None` if no single step is at fault.
    pub step: Option<usize>,
    /// Value of the metric, or the number of steps for a task without metric; `None` for an invalid
    /// plan.
    pub cost: Option<f64>,
    /// End of the last step, in seconds; `None` for a plan without times.
    pub makespan: Option<f64>,
    /// Value of the metric; `None` for a task without metric or an invalid plan.
    pub metric: Option<f64>,
    /// Findings about the fault, to be drawn under the text of the task; empty for a valid plan.
    #[serde(skip)]
    pub findings: Findings,
}

/// Validates a plan by replaying it from the initial state.
///
/// If an attachment fails, the verdict is invalid, with the failure as its reason.
pub fn validate(task: &Task, attachments: &Attachments, plan: &Plan) -> Verdict {
    said(&Semantics::new(task, attachments), plan)
}

/// Validates a plan; `None` once `stop` returns true.
pub fn validate_until(
    task: &Task,
    attachments: &Attachments,
    plan: &Plan,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Verdict> {
    let semantics = Semantics::until(task, attachments, stop);
    let verdict = said(&semantics, plan);
    (!semantics.is_stopped()).then_some(verdict)
}

fn said(semantics: &Semantics<'_>, plan: &Plan) -> Verdict {
    let _span = tracing::debug_span!("validate", steps = plan.steps.len()).entered();
    let task = semantics.task;
    let takes_time = |step: &Step| {
        let mut named = task.actions.iter().filter(|action| action.name.eq_ignore_ascii_case(&step.action));
        named.next().is_none_or(Action::is_durative)
    };
    let is_durative: Vec<bool> = plan.steps.iter().map(takes_time).collect();
    let makespan = makespan_s(plan, &is_durative).filter(|_| !plan.steps.is_empty() || task.is_temporal());
    let invalid = |reason: String, step: Option<usize>, finding: Option<Diagnostic>| Verdict {
        valid: false,
        reason: Some(reason),
        step,
        cost: None,
        makespan,
        metric: None,
        findings: Findings { sources: task.sources.to_vec(), list: finding.into_iter().collect() },
    };
    let failed = |failure: CallFailure| {
        let finding = failure.findings(task).list.into_iter().next();
        invalid(failure.to_string(), None, finding)
    };
    match whole(semantics, plan) {
        Err(failure) => failed(failure),
        Ok(Err(fault)) => invalid(fault.reason, fault.step, Some(fault.finding)),
        Ok(Ok(replayed)) => match metric(semantics, &replayed) {
            Err(failure) => failed(failure),
            Ok(metric) => Verdict {
                valid: true,
                reason: None,
                step: None,
                cost: if task.metric.is_some() { metric } else { Some(plan.steps.len() as f64) },
                makespan,
                metric,
                findings: Findings { sources: task.sources.to_vec(), list: Vec::new() },
            },
        },
    }
}

/// Replays a plan, then checks the goal and the hard constraints.
pub(super) fn whole(
    semantics: &Semantics<'_>,
    plan: &Plan,
) -> Result<Result<Replayed, Box<Fault>>, CallFailure> {
    let replayed = match replay(semantics, plan, Until::LastHappening)? {
        Ok(replayed) => replayed,
        Err(fault) => return Ok(Err(fault)),
    };
    let goal = &semantics.task.goal;
    if let Some(why) = semantics.why_not(&replayed.state, &goal.body, &mut Binding::new(goal.slots))? {
        let message = format!("the goal {} is not reached", why.condition);
        let cause = Cause::Goal(Unmet::of(&why));
        return Ok(Err(Box::new(fault(message, None, cause, &why, "not reached", None))));
    }
    Ok(match broken_constraint(semantics, &replayed)? {
        Some(fault) => Err(Box::new(fault)),
        None => Ok(replayed),
    })
}

/// Value of the metric after a replay; `None` without metric.
fn metric(semantics: &Semantics<'_>, replayed: &Replayed) -> Result<Option<f64>, CallFailure> {
    if semantics.task.metric.is_none() {
        return Ok(None);
    }
    let violations = violations(semantics, replayed)?;
    semantics.measured(&replayed.state, replayed.end, &violations)
}
