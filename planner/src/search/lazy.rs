//! Lazy best-first search with several open lists, preferred operators and lookahead; greedy or weighted A*
//! (Richter and Westphal 2010, sections 5 and 6).

use std::sync::atomic::{AtomicBool, Ordering};

use crate::classical::compiled::Compiled;
use crate::classical::successor::Successors;
use crate::ground::GroundFact;
use crate::heuristics::landmarks::{Landmarks, Status};
use crate::heuristics::relaxed::{Counting, Relaxed};
use crate::memory::MemoryLimit;

use super::lookahead::Lookahead;
use super::open::OpenList;
use super::store::{NO_STATE, Store};

/// Number of extra turns for open lists of preferred operators when a heuristic makes progress.
const BOOST: i64 = 1000;

/// Configuration of a lazy best-first search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strategy {
    /// Weight of the heuristic in weighted A*; `None` for greedy search.
    pub weight: Option<u32>,
    /// Operator costs that the heuristic counts.
    pub counting: Counting,
    /// True to try states along relaxed plans as well.
    pub lookahead: bool,
    /// True for lookahead that changes numbers towards conditions.
    pub steers: bool,
    /// True if ties go to the newest entry (LIFO), false if to the oldest (FIFO).
    pub newest: bool,
    /// True to use further open lists, ordered by the landmark count.
    pub landmarks: bool,
    /// True to prefer operators that achieve landmarks, too.
    pub towards_landmarks: bool,
    /// Only plans with search costs below this bound are accepted.
    pub bound: u32,
    /// Only plans whose final state has a metric value below this are accepted; `None` for no such
    /// bound.
    pub better_than: Option<f64>,
    /// Maximum work (see [`Relaxed::work`]).
    pub work_limit: u64,
    /// Maximum number of evaluated states.
    pub evaluation_limit: u64,
}

/// Result of a search.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// A plan was found: its operators in order.
    Plan(Vec<u32>),
    /// Nothing is left to search: no plan exists, or none below the bound, if the search is complete.
    Exhausted,
    /// The limit of work or evaluations was reached; the search can be continued.
    Limit,
    /// The caller stopped the search.
    Stopped,
    /// The memory limit was reached.
    Memory,
}

/// Counts of a search: evaluated states, expanded states, and work (see [`Relaxed::work`]).
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub evaluated: u64,
    pub expanded: u64,
    pub work: u64,
}

/// Data that all searches of a task share.
pub struct Shared<'a> {
    pub task: &'a Compiled,
    pub successors: &'a Successors,
    pub landmarks: &'a Landmarks,
    /// Mutex groups of facts.
    pub mutex_groups: &'a [Vec<GroundFact>],
    pub memory: MemoryLimit,
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// Limits of a search, counted from its beginning over all its turns.
#[derive(Clone, Copy, Debug)]
pub struct Allowed<'c> {
    /// Maximum work (see [`Relaxed::work`]).
    pub work: u64,
    /// Maximum number of evaluated states.
    pub evaluations: u64,
    /// Maximum memory.
    pub memory: MemoryLimit,
    /// True once the result of the search is no longer needed.
    pub cancelled: &'c AtomicBool,
}

impl Allowed<'_> {
    /// True if the search must end: the caller stopped, or the result is no longer needed.
    pub(crate) fn has_ended(&self, shared: &Shared<'_>) -> bool {
        self.cancelled.load(Ordering::Relaxed) || (shared.stop)()
    }
}

/// Lazy best-first search that can be continued after [`End::Limit`].
pub(crate) struct Search<'a, 's> {
    shared: &'s Shared<'a>,
    strategy: Strategy,
    started: bool,
    /// True if the caller stopped the search during a visit.
    stopped: bool,
    store: Store,
    relaxed: Relaxed,
    lookahead: Lookahead,
    /// Open lists: all operators and preferred operators by heuristic, then both by landmark count.
    lists: [OpenList; 4],
    best: [u32; 2],
    /// Accepted landmarks of each state.
    status: Status,
    counts: Counts,
    /// Number of open-list entries made since memory was last checked.
    unseen: usize,
    state: Vec<u32>,
    next: Vec<u32>,
    applicable: Vec<u32>,
    preferred: Vec<u32>,
    /// States along the last lookahead, in order.
    trail: Vec<u32>,
}

/// Runs a search from the initial state; returns its result and counts.
pub(crate) fn search(shared: &Shared<'_>, strategy: Strategy, cancelled: &AtomicBool) -> (End, Counts) {
    let mut search = Search::new(shared, strategy);
    let (work, evaluations) = (strategy.work_limit, strategy.evaluation_limit);
    let end = search.run(Allowed { work, evaluations, memory: shared.memory, cancelled });
    (end, search.counts())
}

impl Counts {
    /// Adds the counts of another search to these.
    pub(crate) fn add(&mut self, other: Counts) {
        self.evaluated += other.evaluated;
        self.expanded += other.expanded;
        self.work += other.work;
    }

    /// Increase of the counts since they were `before`.
    pub(crate) fn since(self, before: Counts) -> Counts {
        Counts {
            evaluated: self.evaluated - before.evaluated,
            expanded: self.expanded - before.expanded,
            work: self.work - before.work,
        }
    }
}

/// Number of open-list entries between two checks of the memory limit.
pub const MOST_UNSEEN: usize = 4096;
/// Number of open-list entries that one iteration counts as, in addition to the entries that it makes.
pub const UNSEEN_A_ROUND: usize = 16;
/// Work of generating and storing one state, in units of [`Relaxed::work`].
const STATE_WORK: u64 = 20;

impl<'a, 's> Search<'a, 's> {
    /// Search that has not begun.
    pub(crate) fn new(shared: &'s Shared<'a>, strategy: Strategy) -> Search<'a, 's> {
        let task = shared.task;
        Search {
            shared,
            strategy,
            started: false,
            stopped: false,
            store: Store::new(task),
            relaxed: Relaxed::new(task, strategy.counting),
            lookahead: Lookahead::new(task).steering(strategy.steers),
            lists: Default::default(),
            best: [u32::MAX; 2],
            status: Status::new(shared.landmarks),
            counts: Counts::default(),
            unseen: 0,
            state: Vec::new(),
            next: Vec::new(),
            applicable: Vec::new(),
            preferred: Vec::new(),
            trail: Vec::new(),
        }
    }

    fn work(&self) -> u64 {
        self.relaxed.work + (self.counts.evaluated + self.counts.expanded) * STATE_WORK
    }

    /// Counts since the beginning of the search.
    pub(crate) fn counts(&self) -> Counts {
        Counts { work: self.work(), ..self.counts }
    }

    /// Continues the search within limits.
    pub(crate) fn run(&mut self, allowed: Allowed<'_>) -> End {
        if self.strategy.bound == 0 {
            return End::Exhausted;
        }
        if !std::mem::replace(&mut self.started, true) {
            let task = self.shared.task;
            let (first, _) = self.store.insert(&task.initial, NO_STATE, 0, 0);
            self.status.initial(self.shared.landmarks, task, &task.initial);
            self.state = task.initial.clone();
            if let Some(plan) = self.visit(first) {
                return End::Plan(plan);
            }
        }
        let mut round = 0u64;
        loop {
            round += 1;
            if self.stopped || (round.is_multiple_of(64) && allowed.has_ended(self.shared)) {
                return End::Stopped;
            }
            self.unseen += UNSEEN_A_ROUND;
            if self.unseen > MOST_UNSEEN && !self.has_room(&allowed.memory) {
                return End::Memory;
            }
            self.unseen %= MOST_UNSEEN;
            if self.work() > allowed.work || self.counts.evaluated >= allowed.evaluations {
                return End::Limit;
            }
            let list = (0..4).filter(|&i| self.lists[i].len() > 0).min_by_key(|&i| self.lists[i].priority);
            let Some(list) = list else { return End::Exhausted };
            self.lists[list].priority += 1;
            let Some((parent, operator)) = self.lists[list].pop(self.strategy.newest) else { continue };
            if let Some(plan) = self.follow(parent, operator) {
                return End::Plan(plan);
            }
        }
    }

    /// Approximate memory of the search, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let lists: usize = self.lists.iter().map(OpenList::bytes).sum();
        self.store.bytes()[0] + lists + self.status.bytes() + self.relaxed.bytes()
    }

    fn has_room(&self, memory: &MemoryLimit) -> bool {
        memory.has_room(|| self.bytes(), self.store.bytes()[1])
    }

    /// Generates the successor of an open-list entry and visits it if it is new or worth another visit;
    /// returns a plan if one is found.
    fn follow(&mut self, parent: u32, operator: u32) -> Option<Vec<u32>> {
        let task = self.shared.task;
        let cost = task.with_cost(self.store.cost(parent), operator);
        if cost >= self.strategy.bound {
            return None;
        }
        let mut state = std::mem::take(&mut self.state);
        let mut next = std::mem::take(&mut self.next);
        self.store.load(task, parent, &mut state);
        task.apply(operator, &state, &mut next);
        (self.state, self.next) = (next, state);
        let (id, new) = self.store.insert(&self.state, parent, operator, cost);
        self.status.follow(self.shared.landmarks, task, (parent, id), &self.state, new);
        if !new && !self.again(id, parent, operator, cost) {
            return None;
        }
        self.visit(id)
    }

    /// True if a known state is to be visited again: it was never expanded, or is now reached at lower
    /// cost in weighted A* or a search with a cost bound.
    fn again(&mut self, id: u32, parent: u32, operator: u32, cost: u32) -> bool {
        let reopens = self.strategy.weight.is_some() || self.strategy.bound != u32::MAX;
        if cost < self.store.cost(id) && reopens {
            self.store.improve(id, parent, operator, cost);
            return true;
        }
        !self.store.is_expanded(id)
    }

    /// Evaluates and expands `self.state`, then the lookahead states from there while the estimate
    /// improves; returns a plan if one is found. After a dead end in a lookahead, the state in the
    /// middle of it is tried.
    fn visit(&mut self, mut id: u32) -> Option<Vec<u32>> {
        let task = self.shared.task;
        let mut last = u32::MAX;
        self.trail.clear();
        loop {
            if task.is_goal(&self.state) && self.is_better() {
                return Some(self.store.plan_to(id));
            }
            if (self.shared.stop)() {
                self.stopped = true;
                return None;
            }
            self.store.set_expanded(id, true);
            self.counts.evaluated += 1;
            let Some(estimate) = self.relaxed.evaluate(task, &self.state) else {
                id = self.step_back()?;
                continue;
            };
            let left = self.status.left(self.shared.landmarks, task, id, &self.state);
            self.progress([estimate, left]);
            self.expand(id, estimate, left);
            if !self.strategy.lookahead || estimate >= last {
                return None;
            }
            last = estimate;
            id = self.look_ahead(id)?;
        }
    }

    /// True if a plan that ends in `self.state` meets the bound on the metric.
    fn is_better(&self) -> bool {
        let task = self.shared.task;
        let costs = || task.measure.of_last(&task.numbers, &self.state);
        self.strategy.better_than.is_none_or(|bound| costs().is_none_or(|cost| cost < bound))
    }

    /// Moves `self.state` to the middle of the last lookahead; `None` if that state has been expanded.
    fn step_back(&mut self) -> Option<u32> {
        self.trail.truncate(self.trail.len() / 2);
        let id = self.trail.last().copied().filter(|&id| !self.store.is_expanded(id))?;
        self.store.load(self.shared.task, id, &mut self.state);
        Some(id)
    }

    fn progress(&mut self, estimates: [u32; 2]) {
        let mut better = false;
        for (best, estimate) in self.best.iter_mut().zip(estimates) {
            if estimate < *best {
                *best = estimate;
                better = true;
            }
        }
        if better {
            self.lists[1].priority -= BOOST;
            self.lists[3].priority -= BOOST;
        }
    }

    fn expand(&mut self, id: u32, estimate: u32, left: u32) {
        let task = self.shared.task;
        self.counts.expanded += 1;
        self.applicable.clear();
        self.shared.successors.applicable(task, &self.state, &mut self.applicable);
        self.preferred.clear();
        self.preferred.extend_from_slice(&self.relaxed.preferred);
        if self.strategy.landmarks && self.strategy.towards_landmarks {
            let ahead = |op: &&u32| self.status.advances(self.shared.landmarks, task, id, **op);
            let more: Vec<u32> = self.applicable.iter().filter(ahead).copied().collect();
            self.preferred.extend(more);
        }
        self.unseen += self.applicable.len();
        let cost = self.store.cost(id);
        let key = |h: u32| match self.strategy.weight {
            None => h,
            Some(weight) => h.saturating_mul(weight).saturating_add(cost),
        };
        let keys = [key(estimate), key(left)];
        let lists = if self.strategy.landmarks { 2 } else { 1 };
        for (pair, &key) in self.lists.chunks_exact_mut(2).zip(&keys).take(lists) {
            for &operator in &self.applicable {
                pair[0].push(key, (id, operator));
            }
            for &operator in &self.preferred {
                pair[1].push(key, (id, operator));
            }
        }
    }

    /// Moves `self.state` to the end of a new lookahead; `None` if the lookahead is too short, too
    /// costly or ends in an expanded state.
    fn look_ahead(&mut self, mut id: u32) -> Option<u32> {
        let task = self.shared.task;
        self.lookahead.run(task, &self.state, &self.relaxed.plan);
        let plan = std::mem::take(&mut self.lookahead.plan);
        let mut fresh = None;
        self.trail.clear();
        if plan.len() > 1 {
            for &operator in &plan {
                let cost = task.with_cost(self.store.cost(id), operator);
                if cost >= self.strategy.bound {
                    fresh = None;
                    break;
                }
                task.apply(operator, &self.state, &mut self.next);
                std::mem::swap(&mut self.state, &mut self.next);
                let (next, new) = self.store.insert(&self.state, id, operator, cost);
                if !new && self.strategy.weight.is_some() && cost < self.store.cost(next) {
                    self.store.improve(next, id, operator, cost);
                }
                self.status.follow(self.shared.landmarks, task, (id, next), &self.state, new);
                id = next;
                self.trail.push(id);
                fresh = (new || !self.store.is_expanded(id)).then_some(id);
            }
        }
        self.lookahead.plan = plan;
        fresh
    }
}
