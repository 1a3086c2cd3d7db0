//! Options, results and counts of a temporal search.

use std::collections::BTreeSet;

use crate::memory::MemoryLimit;

use super::advance::TemporalStep;

/// Options of a temporal search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Manner {
    /// Weight of the heuristic relative to the path cost; `None` to search by the heuristic alone.
    pub weight: Option<f64>,
    /// True if the heuristic estimates time, counted from when resources are free; false if it adds
    /// costs.
    pub timed: bool,
    /// True to follow the relaxed plan of every state; false to follow only those of states that improve
    /// on all earlier ones.
    pub eager: bool,
    /// Only plans with a measure below this bound are accepted.
    pub bound: f64,
    /// Maximum number of evaluated states.
    pub evaluations: u64,
    /// Maximum work (see [`Counts::work`]).
    pub work: u64,
    /// Maximum memory.
    pub memory: MemoryLimit,
    /// Seed of the order among open-list entries of equal rank; 0 for oldest first.
    pub shuffle: u64,
    /// True to distinguish states with equal facts after which different times are possible; exhaustion is
    /// then a proof.
    pub exact: bool,
    /// Maximum number of instances of one action that are in progress at once.
    pub at_once: usize,
}

/// Result of a temporal search.
#[derive(Debug, Clone)]
pub(crate) enum End {
    /// A plan was found: its steps from the base of the search to the goal.
    Found(Vec<TemporalStep>),
    /// Nothing is left to search within the bound.
    Exhausted {
        /// True if no plan within the bound exists, apart from plans in which an action overlaps
        /// itself.
        proven: bool,
        /// Actions that could have overlapped themselves.
        overlapping: BTreeSet<u32>,
    },
    /// The limit of evaluations or work was reached.
    Budget,
    /// The caller stopped the search.
    Stopped,
    /// The memory limit was reached.
    Memory,
}

/// Counts of the work of a search.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counts {
    /// States evaluated.
    pub evaluated: u64,
    /// States expanded.
    pub expanded: u64,
    /// Work done: a deterministic measure of effort on heuristics, states and schedules.
    pub work: u64,
}
