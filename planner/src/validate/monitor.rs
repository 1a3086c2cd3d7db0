//! Plan monitor: checks if the rest of a plan is still valid from the current state.

use std::fmt;

use serde::Serialize;

use super::cause::{Cause, Fault};
use super::verdict::whole;
use crate::attachment::Attachments;
use crate::diagnostic::{Findings, Span};
use crate::plan::Plan;
use crate::semantics::{CallFailure, Semantics};
use crate::task::Task;

/// Reason the rest of a plan no longer reaches the goal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Broken {
    /// The step at fault, counted from 0 in the rest; `None` if the goal itself is missed.
    pub step: Option<usize>,
    /// The reason, in one sentence.
    pub reason: String,
    /// Cause, with the deciding values.
    pub cause: Cause,
    /// Span in the task's texts.
    pub span: Span,
    /// Findings about the unmet condition, to be drawn under the text of the task.
    #[serde(skip)]
    pub findings: Findings,
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)
    }
}

impl std::error::Error for Broken {}

/// Checks that the rest of a plan, from the initial state of `task`, still reaches the goal.
///
/// Give the task the current state with [`Task::with_state`]. Times of the rest count from now.
///
/// # Errors
/// The first thing that no longer works.
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
