//! Plan monitor: checks that the rest of a plan is still valid from the current state.

use std::fmt;

use serde::Serialize;

use super::cause::{Cause, Fault};
use super::verdict::whole;
use crate::attachment::Attachments;
use crate::diagnostic::{Findings, Span};
use crate::plan::Plan;
use crate::semantics::{CallFailure, Semantics};
use crate::task::Task;

/// Reason why the rest of a plan no longer reaches the goal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Broken {
    /// Step at fault, counted from 0 in the rest of the plan; `None` if no single step is at fault.
    pub step: Option<usize>,
    /// Reason in one sentence.
    pub reason: String,
    /// Cause, with the values that decide it.
    pub cause: Cause,
    /// Span in the task that the reason refers to.
    pub span: Span,
    /// Findings to be drawn under the text of the task.
    #[serde(skip)]
    pub findings: Findings,
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)
    }
}

impl std::error::Error for Broken {}

/// Checks that the rest of a plan reaches the goal from the initial state of `task`.
///
/// [`Task::with_state`] makes a task that starts from the current state. Times in the rest of the plan
/// count from now.
///
/// # Errors
/// The first condition, bound or goal that is not met.
pub fn monitor(task: &Task, attachments: &Attachments, rest: &Plan) -> Result<(), Box<Broken>> {
    let _span = tracing::debug_span!("monitor", steps = rest.steps.len()).entered();
    let semantics = Semantics::new(task, attachments);
    match whole(&semantics, rest) {
        Ok(Ok(_)) => Ok(()),
        Ok(Err(fault)) => Err(Box::new(Broken::of_fault(task, *fault))),
        Err(failure) => Err(Box::new(Broken::of_call(task, &failure))),
    }
}

impl Broken {
    pub(super) fn of_fault(task: &Task, fault: Fault) -> Broken {
        let Fault { reason, step, cause, finding } = fault;
        let span = finding.labels.first().map_or(Span::default(), |label| label.span);
        let findings = Findings { sources: task.sources.to_vec(), list: vec![finding] };
        Broken { step, reason, cause, span, findings }
    }

    pub(super) fn of_call(task: &Task, failure: &CallFailure) -> Broken {
        Broken {
            step: None,
            reason: failure.to_string(),
            cause: Cause::Other { reason: failure.to_string() },
            span: failure.span,
            findings: failure.findings(task),
        }
    }
}
