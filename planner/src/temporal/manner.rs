//! Options, end and counts of a search.

use std::collections::BTreeSet;

use crate::memory::MemoryLimit;

use super::advance::Step;

/// Options of a search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Manner {
    /// Weight of the heuristic against what the plan costs so far; `None` for the heuristic alone.
    pub weight: Option<f64>,
    /// True if the heuristic counts time from when resources are free, instead of adding costs up.
    pub timed: bool,
    /// True to follow the relaxed plan of every state, instead of only those nearer to the goal than any
    /// before.
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
    /// True to distinguish equal states wherever their times leave different possibilities: then nothing is
    /// lost, and an exhausted search proves something.
    pub exact: bool,
    /// The number of times one action may be in progress at once.
    pub at_once: usize,
}

/// The end of a search.
#[derive(Debug, Clone)]
pub(crate) enum End {
    /// Steps from the base to the goal.
    Found(Vec<Step>),
    /// Nothing within the bound is left to look at.
    Exhausted {
        /// True if there is surely no plan within the bound: nothing was left out on the way, except starts
        /// of actions in progress.
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

/// Counts of the work of a search.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counts {
    /// States evaluated.
    pub evaluated: u64,
    /// States expanded.
    pub expanded: u64,
    /// Work done: what was looked at in estimates, states and times.
    pub work: u64,
}
