//! The order in which searches are tried, and the improvement of what they find.

use tracing::debug_span;

use crate::ground::GroundTask;
use crate::heuristics::relaxed::Counting;
use crate::landmarks::Landmarks;

use super::compiled::Compiled;
use super::lazy::{Counts, End, Shared, Strategy, search};
use super::successor::Successors;

/// How a classical task is to be solved.
#[derive(Clone, Debug)]
pub(crate) struct ClassicalOptions {
    /// Keep improving until stopped or nothing cheaper is left.
    pub anytime: bool,
    /// Only plans whose cost is below this.
    pub bound: Option<f64>,
    /// Bytes that the search may take.
    pub memory_limit_bytes: Option<usize>,
    /// States to evaluate at most.
    pub evaluation_limit: Option<u64>,
}

/// How it ended.
#[derive(Clone, Debug)]
pub(crate) struct ClassicalOutcome {
    /// Indices of [`GroundTask::actions`], and the cost.
    pub plan: Option<(Vec<u32>, f64)>,
    /// Why it ended.
    pub end: ClassicalEnd,
    /// States evaluated.
    pub evaluated: u64,
    /// States expanded.
    pub expanded: u64,
}

/// Why a classical search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ClassicalEnd {
    /// With what was asked for.
    Done,
    /// The search space is exhausted: there is no plan, or none that is cheaper.
    Exhausted,
    /// Stopped from outside or by the evaluation limit.
    Stopped,
    /// Out of memory.
    Memory,
}

/// Solves a task that is [`super::compiled::is_classical`].
pub(crate) fn solve(
    ground: &GroundTask,
    options: &ClassicalOptions,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&[u32], f64),
) -> ClassicalOutcome {
    let _span = debug_span!("classical").entered();
    let task = Compiled::new(ground);
    let successors = Successors::new(&task);
    let landmarks = debug_span!("landmarks").in_scope(|| Landmarks::new(&task));
    let shared = Shared {
        task: &task,
        successors: &successors,
        landmarks: &landmarks,
        memory_limit: options.memory_limit_bytes.unwrap_or(usize::MAX),
        stop,
    };
    let mut counts = Counts::default();
    let strategy = Strategy {
        weight: None,
        counting: Counting::CostAndSteps,
        lookahead: true,
        landmarks: true,
        bound: u32::MAX,
        work_limit: u64::MAX,
    };
    let end = search(&shared, strategy, &mut counts);
    let (plan, end) = match end {
        End::Plan(plan) => {
            let cost = task.plan_cost(&plan);
            on_plan(&plan, cost);
            (Some((plan, cost)), ClassicalEnd::Done)
        }
        End::Exhausted => (None, ClassicalEnd::Exhausted),
        End::Memory => (None, ClassicalEnd::Memory),
        End::Limit | End::Stopped => (None, ClassicalEnd::Stopped),
    };
    tracing::debug!(landmarks = landmarks.len(), counts.evaluated, counts.work);
    ClassicalOutcome { plan, end, evaluated: counts.evaluated, expanded: counts.expanded }
}
