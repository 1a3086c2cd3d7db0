//! How a search goes about it, how it ends, and what it has counted.

use std::collections::BTreeSet;

use crate::memory::MemoryLimit;

use super::advance::Step;

/// How to search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Manner {
    /// Weight of the heuristic against what the plan costs so far; `None` for the heuristic alone.
    pub weight: Option<f64>,
    /// Whether the heuristic counts time from when resources are free, instead of adding costs up.
    pub timed: bool,
    /// Whether to follow the relaxed plan of every state, instead of those alone that are nearer to the goal than any before.
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
    /// Whether equal states are told apart wherever their times leave different possibilities: then nothing is lost,
    /// and a search that comes to its end proves something.
    pub exact: bool,
    /// How many times one action may be in progress at once.
    pub at_once: usize,
}

/// How a search ended.
#[derive(Debug, Clone)]
pub(crate) enum End {
    /// Steps from the base to the goal.
    Found(Vec<Step>),
    /// Nothing within the bound is left to look at.
    Exhausted {
        /// Whether that proves that there is no plan within the bound: nothing was left out on the way, but the starts of
        /// actions in progress.
        proven: bool,
        /// Actions that could have started while they were in progress.
        overlapping: BTreeSet<u32>,
    },
    /// The budget of evaluations is used up.
    Budget,
    /// Asked to stop.
    Stopped,
    /// Out of memory.
    Memory,
}

/// What a search has counted.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counts {
    /// States evaluated.
    pub evaluated: u64,
    /// States expanded.
    pub expanded: u64,
    /// Work done: what was looked at in estimates, states and times.
    pub work: u64,
}
