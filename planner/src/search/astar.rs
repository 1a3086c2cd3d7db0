//! A* with LM-cut (Hart, Nilsson and Raphael 1968; Helmert and Domshlak 2009): an optimal plan with
//! its proof.

use std::collections::BTreeMap;

use crate::classical::compiled::{Compiled, MOST_COUNTED};
use crate::classical::successor::Successors;
use crate::heuristics::landmark_cut::LandmarkCut;
use crate::memory::{MemoryLimit, Rows};

use super::lazy::{Counts, End};
use super::store::{NO_STATE, Store};

/// Memory of an open-list entry, bytes, including spare capacity.
const ENTRY_BYTES: usize = 8;
/// Bytes of a bucket of the open list.
const BUCKET_BYTES: usize = 64;

/// Lower bound on the cost from a state to the goal.
#[derive(Clone, Copy, Debug)]
struct Bound {
    cost: u32,
    /// True if the bound is the state's own; false if inherited from its parent.
    is_own: bool,
}

/// The search.
pub(crate) struct AStar<'a> {
    task: &'a Compiled,
    successors: Successors,
    heuristic: LandmarkCut,
    store: Store,
    /// Lower bounds by state.
    bounds: Rows<Bound>,
    /// Open list by f, then by h; LIFO among ties.
    open: BTreeMap<(u32, u32), Vec<u32>>,
    entries: usize,
    counts: Counts,
}

/// Limits of the search.
#[derive(Clone, Copy)]
pub(crate) struct AStarLimits<'a> {
    pub memory: MemoryLimit,
    /// States evaluated at most.
    pub evaluations: u64,
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> AStar<'a> {
    /// Search of a task whose search costs are exact up to scale.
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

    /// Counts so far.
    pub(crate) fn counts(&self) -> Counts {
        self.counts
    }

    /// Searches to the end; `on_bound` gets every improved lower bound, in search costs.
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

    /// Evaluates a state whose bound is inherited, and reopens it unless it is a dead end.
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

    /// Lower bound on the cost of plans through a state.
    fn through(&self, id: u32) -> u32 {
        self.store.cost(id).saturating_add(self.bounds[id as usize].cost)
    }

    /// Opens a state.
    fn push(&mut self, id: u32) {
        self.open.entry((self.through(id), self.bounds[id as usize].cost)).or_default().push(id);
        self.entries += 1;
    }

    /// Pops the state with minimum f.
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

    /// Memory, bytes.
    fn bytes(&self) -> usize {
        let open = self.entries * ENTRY_BYTES + self.open.len() * BUCKET_BYTES;
        self.store.bytes()[0] + self.bounds.bytes() + open + self.heuristic.bytes()
    }
}
