//! Options, end and counts of a search.

use std::collections::BTreeSet;

use crate::memory::MemoryLimit;

use super::advance::TemporalStep;

/// Options of a search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Manner {
    /// Weight of the heuristic relative to path cost; `None`: heuristic alone.
    pub weight: Option<f64>,
    /// True if the heuristic counts time from when resources are free, instead of adding costs up.
    pub timed: bool,
    /// True to follow the relaxed plan of every state; false: only for states that improve on all
    /// earlier ones.
    pub eager: bool,
    /// Only plans that cost less than this.
    pub bound: f64,
    /// Stop after this many evaluated states.
    pub evaluations: u64,
    /// Stop after this much work.
    pub work: u64,
    /// Stop beyond this much memory.
    pub memory: MemoryLimit,
    /// Decides between entries that rank the same; 0 for the order of their making.
    pub shuffle: u64,
    /// True to distinguish equal states with different temporal options; then nothing is lost, and
    /// exhaustion is a proof.
    pub exact: bool,
    /// Number of times one action may be in progress at once.
    pub at_once: usize,
}

/// The end of a search.
#[derive(Debug, Clone)]
pub(crate) enum End {
    /// Steps from the base to the goal.
    Found(Vec<TemporalStep>),
    /// Search space within the bound exhausted.
    Exhausted {
        /// True if no plan within the bound exists, except with self-overlapping actions; nothing
        /// else was pruned.
        proven: bool,
        /// Actions that could have overlapped themselves.
        overlapping: BTreeSet<u32>,
    },
    /// The budget of evaluations is used up.
    Budget,
    /// Asked to stop.
    Stopped,
    /// Out of memory.
    Memory,
}

/// Counts of the work of a search.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counts {
    /// States evaluated.
    pub evaluated: u64,
    /// States expanded.
    pub expanded: u64,
    /// Work done: units of estimates, states and times.
    pub work: u64,
}
