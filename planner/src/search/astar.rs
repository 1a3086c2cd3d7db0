//! A* with LM-cut (Hart, Nilsson and Raphael 1968; Helmert and Domshlak 2009): finds an optimal plan
//! and proves it optimal.

use std::collections::BTreeMap;

use crate::classical::compiled::{Compiled, MOST_COUNTED};
use crate::classical::successor::Successors;
use crate::heuristics::landmark_cut::LandmarkCut;
use crate::memory::{MemoryLimit, Rows};

use super::lazy::{Counts, End};
use super::store::{NO_STATE, Store};

/// Memory of an open-list entry in bytes, including spare capacity.
const ENTRY_BYTES: usize = 8;
/// Memory of a bucket of the open list, in bytes.
const BUCKET_BYTES: usize = 64;

/// Lower bound on the cost from a state to the goal, in search costs.
#[derive(Clone, Copy, Debug)]
struct Bound {
    cost: u32,
    /// True if the heuristic was computed for the state itself, false if the bound is inherited from
    /// the parent.
    is_own: bool,
}

/// A* search.
pub(crate) struct AStar<'a> {
    task: &'a Compiled,
    successors: Successors,
    heuristic: LandmarkCut,
    store: Store,
    /// Lower bound of each state.
    bounds: Rows<Bound>,
    /// Open list ordered by f, then by h; the newest entry first among ties.
    open: BTreeMap<(u32, u32), Vec<u32>>,
    entries: usize,
    counts: Counts,
}

/// Limits of an A* search.
#[derive(Clone, Copy)]
pub(crate) struct AStarLimits<'a> {
    pub memory: MemoryLimit,
    /// Maximum number of evaluated states.
    pub evaluations: u64,
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> AStar<'a> {
    /// Search of a task whose search costs are proportional to those of its metric.
    pub(crate) fn new(task: &'a Compiled) -> AStar<'a> {
        AStar {
            task,
            successors: Successors::new(task),
            heuristic: LandmarkCut::new(task),
            store: Store::new(task),
            bounds: Rows::default(),
            open: BTreeMap::new(),
            entries: 0,
            counts: Counts::default(),
        }
    }

    /// Counts since the beginning of the search.
    pub(crate) fn counts(&self) -> Counts {
        self.counts
    }

    /// Searches until a plan is found, none exists or a limit is reached; `on_bound` gets every
    /// improved lower bound on plan costs, in search costs.
    pub(crate) fn run(&mut self, limits: AStarLimits<'_>, on_bound: &mut dyn FnMut(u32)) -> End {
        let (mut state, mut proven) = (self.task.initial.clone(), None);
        let (first, _) = self.store.insert(&state, NO_STATE, 0, 0);
        self.bounds.push(Bound { cost: 0, is_own: false });
        self.push(first);
        while let Some((bound, id)) = self.pop() {
            if proven.is_none_or(|proven| bound > proven) {
                proven = Some(bound);
                on_bound(bound);
            }
            if bound >= MOST_COUNTED || self.counts.evaluated >= limits.evaluations || (limits.stop)() {
                return End::Stopped;
            }
            if self.counts.expanded.is_multiple_of(64)
                && !limits.memory.has_room(|| self.bytes(), self.store.bytes()[1])
            {
                return End::Memory;
            }
            if self.store.is_expanded(id) {
                continue;
            }
            self.store.load(self.task, id, &mut state);
            if !self.bounds[id as usize].is_own {
                self.evaluate(id, &state, limits.stop);
                continue;
            }
            if self.through(id) > bound {
                // A later entry of the same state has the greater bound.
                continue;
            }
            if self.task.is_goal(&state) {
                return End::Plan(self.store.plan_to(id));
            }
            self.expand(id, &state);
        }
        End::Exhausted
    }

    /// Computes the heuristic of a state whose bound is inherited, and puts the state back into the
    /// open list unless it is a dead end.
    fn evaluate(&mut self, id: u32, state: &[u32], stop: &(dyn Fn() -> bool + Sync)) {
        self.counts.evaluated += 1;
        let inherited = self.bounds[id as usize].cost;
        let own = self.heuristic.evaluate(self.task, state, &|| stop());
        self.bounds[id as usize] =
            Bound { cost: own.map_or(u32::MAX, |own| own.max(inherited)), is_own: true };
        match own {
            None => self.store.set_expanded(id, true),
            Some(_) => self.push(id),
        }
    }

    fn expand(&mut self, id: u32, state: &[u32]) {
        self.counts.expanded += 1;
        self.store.set_expanded(id, true);
        let (cost, bound) = (self.store.cost(id), self.bounds[id as usize].cost);
        let (mut operators, mut next) = (Vec::new(), Vec::new());
        self.successors.applicable(self.task, state, &mut operators);
        for operator in operators {
            self.task.apply(operator, state, &mut next);
            let reached = self.task.with_cost(cost, operator);
            let (child, is_new) = self.store.insert(&next, id, operator, reached);
            if is_new {
                let left = bound.saturating_sub(self.task.costs[operator as usize]);
                self.bounds.push(Bound { cost: left, is_own: false });
            } else if reached < self.store.cost(child) && self.bounds[child as usize].cost < u32::MAX {
                self.store.improve(child, id, operator, reached);
                self.store.set_expanded(child, false);
            } else {
                continue;
            }
            self.push(child);
        }
    }

    /// Lower bound on the cost of plans through a state (f), in search costs.
    fn through(&self, id: u32) -> u32 {
        self.store.cost(id).saturating_add(self.bounds[id as usize].cost)
    }

    /// Adds a state to the open list.
    fn push(&mut self, id: u32) {
        self.open.entry((self.through(id), self.bounds[id as usize].cost)).or_default().push(id);
        self.entries += 1;
    }

    /// Removes the state with minimum f from the open list; returns f and the state.
    fn pop(&mut self) -> Option<(u32, u32)> {
        let mut bucket = self.open.first_entry()?;
        let (through, _) = *bucket.key();
        let id = bucket.get_mut().pop();
        if bucket.get().is_empty() {
            bucket.remove();
        }
        self.entries -= 1;
        id.map(|id| (through, id))
    }

    /// Approximate memory of the search, in bytes.
    fn bytes(&self) -> usize {
        let open = self.entries * ENTRY_BYTES + self.open.len() * BUCKET_BYTES;
        self.store.bytes()[0] + self.bounds.bytes() + open + self.heuristic.bytes()
    }
}
