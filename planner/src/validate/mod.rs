//! Does a plan do what it should? Every happening is replayed exactly.
//!
//! Classical plans are replayed step by step; plans with times as happenings after PDDL 2.1 (Fox and Long 2003, section 8):
//! what happens at one time must not interfere, conditions over all hold strictly between start and end, durations
//! meet their bounds, timed literals happen by themselves, and the goal is judged after the last of them (PDDL 2.2; Edelkamp and
//! Hoffmann 2004).

mod after;
mod cause;
mod endless;
mod monitor;
mod replay;
mod timeline;
mod trajectory;

use serde::Serialize;

use crate::attachment::Attachments;
use crate::diagnostic::{Diagnostic, Findings};
use crate::plan::{Plan, Step};
use crate::semantics::{Binding, CallFailure, Semantics};
use crate::state::State;
use crate::task::{Action, Task};

pub use after::after;
pub use cause::{Cause, Moment, Unmet};
pub use endless::endless;
pub use monitor::{Broken, monitor};

/// Happenings closer than this are at the same time, in seconds. Plans are printed with few digits, and peers keep
/// their happenings as little as this apart.
pub const SEPARATION_S: f64 = 1e-4;

/// The validator's verdict on a plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// True if the plan reaches the goal as it stands.
    pub valid: bool,
    /// The reason it is invalid, in one sentence.
    pub reason: Option<String>,
    /// The step at fault, counted from 0.
    pub step: Option<usize>,
    /// Value of the metric, or the number of steps where there is none.
    pub cost: Option<f64>,
    /// End of the last step, in seconds; `None` for a plan without times.
    pub makespan: Option<f64>,
    /// Value of the metric.
    pub metric: Option<f64>,
    /// The fault, to be drawn under the text of the task.
    #[serde(skip)]
    pub findings: Findings,
}

/// The reason a replay stopped.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    pub reason: String,
    pub step: Option<usize>,
    pub cause: Cause,
    pub finding: Diagnostic,
}

/// The end of a replay.
pub(crate) struct Replayed {
    pub state: State,
    /// States with the times at which they begin, for constraints on the trajectory.
    pub trace: Vec<(f64, State)>,
    /// For each preference, the number of violations by preferred conditions of actions.
    pub violations: Vec<f64>,
    /// End of the plan: a time, or the number of steps.
    pub end: f64,
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
    let makespan =
        timeline::makespan_s(plan, &is_durative).filter(|_| !plan.steps.is_empty() || task.is_temporal());
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
fn whole(semantics: &Semantics<'_>, plan: &Plan) -> Result<Result<Replayed, Box<Fault>>, CallFailure> {
    let replayed = match replay::replay(semantics, plan, replay::Until::LastHappening)? {
        Ok(replayed) => replayed,
        Err(fault) => return Ok(Err(fault)),
    };
    let goal = &semantics.task.goal;
    if let Some(why) = semantics.why_not(&replayed.state, &goal.body, &mut Binding::new(goal.slots))? {
        let message = format!("the goal {} is not reached", why.condition);
        let cause = Cause::Goal(Unmet::of(&why));
        return Ok(Err(Box::new(replay::fault(message, None, cause, &why, "not reached", None))));
    }
    Ok(match trajectory::broken_constraint(semantics, &replayed)? {
        Some(fault) => Err(Box::new(fault)),
        None => Ok(replayed),
    })
}

/// The metric's value at the end.
fn metric(semantics: &Semantics<'_>, replayed: &Replayed) -> Result<Option<f64>, CallFailure> {
    if semantics.task.metric.is_none() {
        return Ok(None);
    }
    let violations = trajectory::violations(semantics, replayed)?;
    semantics.measured(&replayed.state, replayed.end, &violations)
}
