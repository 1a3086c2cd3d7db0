//! The validator: replay, goal, constraints and metric of a plan.

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

/// The validator's verdict on a plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// True if the plan reaches the goal.
    pub valid: bool,
    /// Reason for being invalid, in one sentence.
    pub reason: Option<String>,
    /// The step at fault, counted from 0.
    pub step: Option<usize>,
    /// Value of the metric, or the number of steps without one.
    pub cost: Option<f64>,
    /// End of the last step, in seconds; `None` for a plan without times.
    pub makespan: Option<f64>,
    /// Value of the metric.
    pub metric: Option<f64>,
    /// The fault, to be drawn under the text of the task.
    #[serde(skip)]
    pub findings: Findings,
}

/// Replays a plan from the initial state to the goal.
///
/// A failing attachment makes the verdict invalid, with the failure as its reason.
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

/// Replays a plan and looks at the goal and the constraints.
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

/// The metric's value at the end.
fn metric(semantics: &Semantics<'_>, replayed: &Replayed) -> Result<Option<f64>, CallFailure> {
    if semantics.task.metric.is_none() {
        return Ok(None);
    }
    let violations = violations(semantics, replayed)?;
    semantics.measured(&replayed.state, replayed.end, &violations)
}
