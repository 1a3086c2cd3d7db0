//! Options, statistics and outcomes of planning.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;

use serde::Serialize;

use crate::attachment::{AttachmentError, CallStatistics};
use crate::diagnostic::{Diagnostic, Findings};
use crate::explain::Explanation;
use crate::plan::Plan;
use crate::technique::Without;

/// Options of planning.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Keep improving the plan until stopped or until it is proven optimal. Otherwise planning
    /// stops after the first plan and a short improvement whose length depends on the task alone.
    pub anytime: bool,
    /// Return the first plan, without improvement.
    pub first: bool,
    /// Accept only plans whose metric value is below this; without a metric, the makespan (temporal
    /// tasks) or the cost.
    pub bound: Option<f64>,
    /// Seed of random choices; the classical search makes none.
    pub seed: u64,
    /// Memory limit, bytes: for the grounded task and the search, or for the whole process if
    /// `memory_used` is given.
    pub memory_limit_bytes: Option<u64>,
    /// Function that measures the memory of the whole process, bytes; called now and then. `None`:
    /// only the memory of the grounded task and of the searches is counted.
    pub memory_used: Option<fn() -> u64>,
    /// Maximum number of states that a heuristic evaluates.
    pub evaluation_limit: Option<u64>,
    /// Number of searches in parallel, for plans without durations; default 1. The plan is the same
    /// for any number unless a limit is reached. One is used if states or the searches' memory are
    /// limited.
    pub threads: Option<NonZeroUsize>,
    /// Techniques that are left out, for ablation studies.
    pub without: Without,
}

/// Statistics of one planning call.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Statistics {
    /// Number of states evaluated by a heuristic.
    pub evaluated: u64,
    /// Number of states whose successors were generated.
    pub expanded: u64,
    /// Number of plans found, each better than the one before.
    pub plans: u64,
    /// Number of ground actions.
    pub actions: u64,
    /// True if the plan is proven optimal among all plans, including those in which an action
    /// overlaps itself.
    pub optimal: bool,
    /// Proven lower bound on the metric value (without a metric: on the number of steps); `None` if
    /// not computed.
    pub lower_bound: Option<f64>,
    /// True if some preferences were only scored, not optimised: those outside the metric, or with
    /// times or attachments.
    pub scored_only: bool,
    /// Statistics of each attachment for this planning call alone, by name.
    pub attachments: BTreeMap<String, CallStatistics>,
}

/// Outcome of planning.
#[derive(Debug, Clone)]
pub enum Outcome {
    /// A validated plan.
    Solved {
        /// Best plan found.
        plan: Plan,
        /// Statistics of the planning call.
        statistics: Statistics,
    },
    /// Proof that no plan exists. If `why` names actions that may overlap themselves, the proof
    /// covers only plans in which they do not.
    Unsolvable {
        /// Explanation why there is no plan.
        why: Explanation,
        /// Statistics of the planning call.
        statistics: Statistics,
    },
    /// Planning was stopped before a plan was found, or (with `anytime`) before the plan was proven
    /// optimal.
    OutOfTime {
        /// Best plan found; `None` if there is none yet.
        best: Option<Plan>,
        /// Statistics of the planning call.
        statistics: Statistics,
    },
    /// The memory limit was reached.
    OutOfMemory {
        /// Best plan found; `None` if there is none yet.
        best: Option<Plan>,
        /// Statistics of the planning call.
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

/// Error because of which planning gives neither a plan nor a proof that there is none.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The task uses an unsupported feature, or a module without an attachment. Each finding points
    /// at its place in the text.
    #[error("{}", first_message(.0))]
    Refused(Findings),
    /// All plans found violate constraints of a kind that no search supports, so it is unknown
    /// whether a plan exists. Each finding points at a constraint.
    #[error("{}", first_message(.0))]
    Untried(Findings),
    /// An attachment failed. The finding points at the call in the domain.
    #[error("{error}")]
    Attachment {
        /// Error of the failed call.
        error: Box<AttachmentError>,
        /// Findings with the domain's text.
        findings: Findings,
    },
    /// A plan that the search found failed validation: an error in the planner.
    #[error("internal error: a plan that was found is not valid: {reason}\n{plan}")]
    Internal {
        /// Reason why the validator rejects the plan.
        reason: String,
        /// Plan that failed validation.
        plan: Plan,
    },
}

impl PlanError {
    /// Findings that point into the task's text; `None` for an internal error.
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
