//! Options, statistics and outcomes of planning.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;

use serde::Serialize;

use crate::attachment::{AttachmentError, CallStatistics};
use crate::diagnostic::{Diagnostic, Findings};
use crate::explain::Explanation;
use crate::plan::Plan;

/// Options of planning.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Keep improving until stopped, or until the best plan is proven best. Otherwise stop after the first plan and a
    /// short improvement whose length is fixed by the task alone.
    pub anytime: bool,
    /// Return the first plan, without improvement.
    pub first: bool,
    /// Accept only plans whose metric (makespan or cost where there is none) is below this.
    pub bound: Option<f64>,
    /// Seed of random choices; the classical search makes none.
    pub seed: u64,
    /// Memory limit for grounded task and search, bytes; with `memory_used`, for the whole process.
    pub memory_limit_bytes: Option<u64>,
    /// Measures the memory of the whole process, bytes; polled now and then. `None`: only the
    /// searches' own memory is counted.
    pub memory_used: Option<fn() -> u64>,
    /// Maximum number of evaluated states.
    pub evaluation_limit: Option<u64>,
    /// Number of parallel searches for plans without durations; default 1. The plan is the same for
    /// any number unless limits run out. If states or search memory are limited, 1 is used.
    pub threads: Option<NonZeroUsize>,
}

/// Statistics of planning.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Statistics {
    /// States evaluated by a heuristic.
    pub evaluated: u64,
    /// States whose successors were made.
    pub expanded: u64,
    /// Number of plans found, each better than the one before.
    pub plans: u64,
    /// Ground actions.
    pub actions: u64,
    /// True if the plan is proven optimal among all plans, including those in which an action
    /// overlaps itself.
    pub optimal: bool,
    /// Proven lower bound on the metric (on the number of steps without one), if requested.
    pub lower_bound: Option<f64>,
    /// True if some preferences were not optimised, only scored: those outside the metric, or with
    /// times or attachments.
    pub scored_only: bool,
    /// Statistics by attachment, for this call alone.
    pub attachments: BTreeMap<String, CallStatistics>,
}

/// Outcome of planning.
#[derive(Debug, Clone)]
pub enum Outcome {
    /// A plan, validated.
    Solved {
        /// Best plan found.
        plan: Plan,
        /// Statistics.
        statistics: Statistics,
    },
    /// Proven to have no plan; if `why` names self-overlapping actions, only plans without
    /// self-overlap are excluded.
    Unsolvable {
        /// Explanation.
        why: Explanation,
        /// Statistics.
        statistics: Statistics,
    },
    /// Stopped before a plan was found, or (anytime) before optimality was proven, then with a
    /// plan.
    OutOfTime {
        /// Best plan so far.
        best: Option<Plan>,
        /// Statistics.
        statistics: Statistics,
    },
    /// The memory limit was reached.
    OutOfMemory {
        /// Best plan so far.
        best: Option<Plan>,
        /// Statistics.
        statistics: Statistics,
    },
}

impl Outcome {
    /// The plan, if one was found.
    pub fn plan(&self) -> Option<&Plan> {
        match self {
            Outcome::Solved { plan, .. } => Some(plan),
            Outcome::OutOfTime { best, .. } | Outcome::OutOfMemory { best, .. } => best.as_ref(),
            Outcome::Unsolvable { .. } => None,
        }
    }

    /// Statistics of any outcome.
    pub fn statistics(&self) -> &Statistics {
        match self {
            Outcome::Solved { statistics, .. }
            | Outcome::Unsolvable { statistics, .. }
            | Outcome::OutOfTime { statistics, .. }
            | Outcome::OutOfMemory { statistics, .. } => statistics,
        }
    }

    pub(crate) fn statistics_mut(&mut self) -> &mut Statistics {
        match self {
            Outcome::Solved { statistics, .. }
            | Outcome::Unsolvable { statistics, .. }
            | Outcome::OutOfTime { statistics, .. }
            | Outcome::OutOfMemory { statistics, .. } => statistics,
        }
    }
}

/// Error without any planning result.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The task uses an unsupported feature or a module without an attachment. Each finding points
    /// at its place.
    #[error("{}", first_message(.0))]
    Refused(Findings),
    /// All plans found violate constraints of kinds that no search supports, so solvability is
    /// unknown. Each finding points at a constraint.
    #[error("{}", first_message(.0))]
    Untried(Findings),
    /// An attachment failed; the finding points at the call in the domain.
    #[error("{error}")]
    Attachment {
        /// The failed call.
        error: Box<AttachmentError>,
        /// Findings, to be drawn under the text.
        findings: Findings,
    },
    /// A plan of the search failed validation: an internal error.
    #[error("internal error: a plan that was found is not valid: {reason}\n{plan}")]
    Internal {
        /// Message of the validator.
        reason: String,
        /// The plan.
        plan: Plan,
    },
}

impl PlanError {
    /// Findings to draw under the text of the domain, if the domain is at fault.
    pub fn findings(&self) -> Option<&Findings> {
        match self {
            PlanError::Refused(findings)
            | PlanError::Untried(findings)
            | PlanError::Attachment { findings, .. } => Some(findings),
            PlanError::Internal { .. } => None,
        }
    }
}

fn first_message(findings: &Findings) -> &str {
    findings.list.first().map_or("the task is refused", |finding: &Diagnostic| finding.message.as_str())
}
