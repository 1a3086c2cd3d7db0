//! Best-first width search: novel states come first (Lipovetzky and Geffner 2017, BFWS(f5)). The
//! novelty of a state is judged among states with the same number of open landmarks and of achieved
//! facts of the last relaxed plan. Most states are not evaluated by a heuristic, so this is fast, and
//! helps where relaxed plans mislead.
//!
//! A narrow search counts open goals instead of landmarks, and prunes states without a new fact (first
//! pass of Dual-BFWS): it ends soon, and often with a plan.

use rustc_hash::FxHashMap;

use crate::heuristics::landmarks::Status;
use crate::heuristics::relaxed::{Counting, Relaxed};
use crate::memory::{MemoryLimit, Rows};

use super::lazy::{Allowed, Counts, End, MOST_UNSEEN, Shared, UNSEEN_A_ROUND};
use super::open::OpenList;
use super::store::{NO_STATE, Store};

/// Maximum memory of the tables of seen pairs of facts, in bytes; beyond it, novelty is judged by
/// single facts.
const PAIR_TABLE_BYTES: usize = 256 << 20;
/// Minimum and maximum number of 64-bit words for the facts of a relaxed plan that are followed, one
/// bit each.
const FOLLOWED_WORDS: [usize; 2] = [2, 8];
/// Number of bits of an open-list key that hold the depth of a state.
const DEPTH_BITS: u32 = 12;
/// Work of generating one state, in units of the heuristics.
const STATE_WORK: u64 = 30;
/// Work of generating one state in a narrow search, which soon ends or does not help.
const NARROW_STATE_WORK: u64 = 100;

/// Data that this search keeps about each state.
#[derive(Clone, Copy)]
struct Memory {
    /// Index in [`NoveltySearch::anchors`] of the relaxed plan that the state follows.
    anchor: u32,
    left: u32,
    /// Number of operators from the initial state to this state.
    depth: u32,
}

/// Facts and pairs of facts that were seen so far, by which the novelty of a state is judged.
pub struct Novelty {
    pub facts: usize,
    pub pairs: bool,
    /// Sets of seen facts and of seen pairs, as bits, for each number of open landmarks and of achieved
    /// facts of the relaxed plan.
    pub seen: FxHashMap<(u32, u32), (Vec<u64>, Vec<u64>)>,
    pub bytes: usize,
}

impl Novelty {
    /// Novelty of a state: 1 for a new fact, 2 for a new pair of facts, 3 for neither. `changed` are
    /// the facts that the last operator made true.
    pub fn of(&mut self, key: (u32, u32), state: &[u32], changed: &[u32]) -> u32 {
        let words = self.facts.div_ceil(64);
        let (facts, pairs) = self.seen.entry(key).or_insert_with(|| {
            self.bytes += words * 8;
            (vec![0; words], Vec::new())
        });
        let mut novelty = 3;
        for &fact in changed {
            let word = &mut facts[fact as usize / 64];
            if *word >> (fact % 64) & 1 == 0 {
                *word |= 1 << (fact % 64);
                novelty = 1;
            }
        }
        if !self.pairs {
            return novelty;
        }
        if pairs.is_empty() {
            let words = (self.facts * self.facts).div_ceil(64);
            if self.bytes + words * 8 > PAIR_TABLE_BYTES {
                self.pairs = false;
                return novelty;
            }
            self.bytes += words * 8;
            pairs.resize(words, 0);
        }
        for &fact in changed {
            let row = fact as usize * self.facts;
            for &other in state {
                let at = if other < fact {
                    other as usize * self.facts + fact as usize
                } else {
                    row + other as usize
                };
                let word = &mut pairs[at / 64];
                if *word >> (at % 64) & 1 == 0 {
                    *word |= 1 << (at % 64);
                    novelty = novelty.min(2);
                }
            }
        }
        novelty
    }
}

/// Best-first width search that can be continued after [`End::Limit`].
pub struct NoveltySearch<'a, 's> {
    shared: &'s Shared<'a>,
    /// Only plans with search costs below this bound are accepted.
    bound: u32,
    narrow: bool,
    started: bool,
    store: Store,
    status: Status,
    memory: Rows<Memory>,
    /// Facts of the followed relaxed plan that have been true since that plan was computed, as bits, by
    /// state.
    done: Rows<u64>,
    /// Facts of each relaxed plan that is followed.
    anchors: Vec<Vec<u32>>,
    relaxed: Relaxed,
    novelty: Novelty,
    open: OpenList,
    facts: Vec<u32>,
    counts: Counts,
    /// Number of generated states since memory was last checked.
    unseen: usize,
}

impl<'a, 's> NoveltySearch<'a, 's> {
    /// Search that has not begun; `narrow` prunes states without a new fact.
    pub fn new(shared: &'s Shared<'a>, bound: u32, narrow: bool) -> NoveltySearch<'a, 's> {
        let task = shared.task;
        NoveltySearch {
            shared,
            bound,
            narrow,
            started: false,
            store: Store::new(task),
            status: Status::new(shared.landmarks),
            memory: Rows::default(),
            done: Rows::default(),
            anchors: Vec::new(),
            relaxed: Relaxed::new(task, Counting::Steps),
            novelty: Novelty { facts: task.facts, pairs: !narrow, seen: FxHashMap::default(), bytes: 0 },
            open: OpenList::default(),
            facts: Vec::new(),
            counts: Counts::default(),
            unseen: 0,
        }
    }

    /// Counts since the beginning of the search.
    pub(crate) fn counts(&self) -> Counts {
        Counts { work: self.work(), ..self.counts }
    }

    fn work(&self) -> u64 {
        self.relaxed.work + self.counts.work
    }

    /// Inserts the initial state; true if the goal is reachable in the relaxation.
    fn start(&mut self) -> bool {
        let task = self.shared.task;
        let (first, _) = self.store.insert(&task.initial, NO_STATE, 0, 0);
        self.status.initial(self.shared.landmarks, task, &task.initial);
        let left = self.left(first, &task.initial);
        self.memory.push(Memory { anchor: 0, left, depth: 0 });
        self.open.push(0, (first, 0));
        let reachable = self.anchor(&task.initial).is_some();
        let [least, most] = FOLLOWED_WORDS;
        self.done =
            Rows::new(self.anchors.first().map_or(least, |a| a.len().div_ceil(64).clamp(least, most)));
        self.done.push_row(&vec![0; self.done.width()]);
        reachable
    }

    /// Landmark count of a state, or its goal count in a narrow search.
    fn left(&self, id: u32, state: &[u32]) -> u32 {
        let (landmarks, task) = (self.shared.landmarks, self.shared.task);
        match self.narrow {
            true => self.status.goals_left(landmarks, task, id, state),
            false => self.status.left(landmarks, task, id, state),
        }
    }

    /// Continues the search within limits.
    pub fn run(&mut self, allowed: Allowed) -> End {
        if self.bound == 0 {
            return End::Exhausted;
        }
        if !std::mem::replace(&mut self.started, true) && !self.start() {
            return End::Exhausted;
        }
        let mut buffers = (Vec::new(), Vec::new(), Vec::new());
        let mut round = 0u64;
        loop {
            round += 1;
            if round.is_multiple_of(64) && allowed.has_ended(self.shared) {
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
            let Some((id, _)) = self.open.pop(false) else { return End::Exhausted };
            if let Some(plan) = self.expand(id, &mut buffers) {
                return End::Plan(plan);
            }
        }
    }

    /// Generates the successors of a state; returns a plan if one of them is a goal state. The buffers
    /// are working memory: the state, a successor and the applicable operators.
    fn expand(
        &mut self,
        id: u32,
        (state, next, applicable): &mut (Vec<u32>, Vec<u32>, Vec<u32>),
    ) -> Option<Vec<u32>> {
        let task = self.shared.task;
        self.store.load(task, id, state);
        self.counts.expanded += 1;
        applicable.clear();
        self.shared.successors.applicable(task, state, applicable);
        self.unseen += applicable.len();
        for &operator in applicable.iter() {
            let cost = task.with_cost(self.store.cost(id), operator);
            if cost >= self.bound {
                continue;
            }
            task.apply(operator, state, next);
            self.counts.work += if self.narrow { NARROW_STATE_WORK } else { STATE_WORK };
            let (child, new) = self.store.insert(next, id, operator, cost);
            if !new {
                continue;
            }
            self.status.follow(self.shared.landmarks, task, (id, child), next, true);
            if task.is_goal(next) {
                return Some(self.store.plan_to(child));
            }
            self.evaluate(id, operator, child, next);
        }
        None
    }

    /// Approximate memory of the search, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.store.bytes()[0]
            + self.status.bytes()
            + self.novelty.bytes
            + self.memory.bytes()
            + self.done.bytes()
            + self.open.bytes()
            + self.anchors.iter().map(|a| a.len() * 4 + 24).sum::<usize>()
    }

    fn has_room(&self, memory: &MemoryLimit) -> bool {
        memory.has_room(|| self.bytes(), self.store.bytes()[1])
    }

    /// Computes a relaxed plan to follow from a state; returns its index, or `None` for a dead end.
    fn anchor(&mut self, state: &[u32]) -> Option<u32> {
        let task = self.shared.task;
        self.counts.evaluated += 1;
        self.relaxed.evaluate(task, state)?;
        let mut facts: Vec<u32> = self
            .relaxed
            .plan
            .iter()
            .flat_map(|r| task.effects.get(r.operator as usize).iter().map(|e| task.id(e.fact)))
            .filter(|&f| !task.holds(f, state) && task.symbols[f as usize] != u32::MAX)
            .collect();
        facts.sort_unstable();
        facts.dedup();
        facts.truncate(64 * FOLLOWED_WORDS[1]);
        self.anchors.push(facts);
        Some(self.anchors.len() as u32 - 1)
    }

    fn evaluate(&mut self, parent: u32, operator: u32, child: u32, state: &[u32]) {
        let task = self.shared.task;
        let before = self.memory[parent as usize];
        let mut done = self.done.row(parent as usize).to_vec();
        let mut memory = Memory { left: self.left(child, state), depth: before.depth + 1, ..before };
        let achieved = task.effects.get(operator as usize).iter().map(|e| task.id(e.fact));
        if memory.left < before.left {
            done.fill(0);
            match self.anchor(state) {
                Some(anchor) => memory.anchor = anchor,
                None => {
                    self.memory.push(memory);
                    self.done.push_row(&done);
                    return;
                }
            }
        } else {
            for fact in achieved.clone() {
                let place = self.anchors[memory.anchor as usize].binary_search(&fact);
                if let Some(place) = place.ok().filter(|place| place / 64 < done.len()) {
                    done[place / 64] |= 1 << (place % 64);
                }
            }
        }
        self.memory.push(memory);
        self.done.push_row(&done);
        self.facts.clear();
        self.facts.extend(task.offsets.iter().zip(state).map(|(&offset, &value)| offset + value));
        let (kind, parents) = (self.kind(child), self.kind(parent));
        let changed: Vec<u32> = match self.narrow && kind != parents {
            // What else holds may be new among states of this kind.
            true => self.facts.clone(),
            false => achieved.filter(|&f| task.holds(f, state)).collect(),
        };
        let novelty = self.novelty.of(kind, &self.facts, &changed);
        self.counts.work +=
            (changed.len() * if self.novelty.pairs { self.facts.len() } else { 1 }) as u64 / 8;
        if self.narrow {
            if novelty == 1 {
                self.open
                    .push(memory.left << DEPTH_BITS | memory.depth.min((1 << DEPTH_BITS) - 1), (child, 0));
            }
            return;
        }
        let key = (novelty - 1).saturating_mul(1 << 20).saturating_add(memory.left);
        self.open.push(key, (child, 0));
    }

    /// Key of the novelty tables: landmark or goal count, and number of achieved facts of the relaxed
    /// plan.
    fn kind(&self, id: u32) -> (u32, u32) {
        let done = self.done.row(id as usize);
        (self.memory[id as usize].left, done.iter().map(|word| word.count_ones()).sum())
    }
}
