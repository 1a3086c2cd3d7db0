//! Best-first width search: states that show something new come first (Lipovetzky and Geffner 2017, BFWS with
//! evaluation f5). What is new is judged among states with as many landmarks left and as much of the last relaxed plan
//! made true. No heuristic is computed for most states, so this is fast, and strong where relaxed plans mislead.

use rustc_hash::FxHashMap;

use crate::heuristics::landmarks::Status;
use crate::heuristics::relaxed::{Counting, Relaxed};
use crate::memory::{MemoryLimit, Rows};

use super::lazy::{Allowed, Counts, End, MOST_UNSEEN, Shared, UNSEEN_A_ROUND};
use super::open::OpenList;
use super::store::{NO_STATE, Store};

/// Pairs of facts are told apart only where their tables stay below this.
const PAIR_TABLE_BYTES: usize = 256 << 20;
/// Facts of a relaxed plan that are followed.
const FOLLOWED: usize = 128;
/// Work that a state costs, in the units of the heuristics.
const STATE_WORK: u64 = 30;

/// What is remembered of a state besides what the store holds.
#[derive(Clone, Copy)]
struct Memory {
    /// Index of the relaxed plan that is followed.
    anchor: u32,
    /// Which of its facts have been true on the way.
    done: u128,
    left: u32,
}

struct Novelty {
    facts: usize,
    pairs: bool,
    /// By landmarks left and facts of the relaxed plan made true: facts and pairs of facts seen.
    seen: FxHashMap<(u32, u32), (Vec<u64>, Vec<u64>)>,
    bytes: usize,
}

impl Novelty {
    /// 1 for a new fact, 2 for a new pair, 3 for neither. `changed` are the facts that the last operator made true.
    fn of(&mut self, key: (u32, u32), state: &[u32], changed: &[u32]) -> u32 {
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

/// The search, which can be gone on with after it ended with [`End::Limit`].
pub(crate) struct Search<'a, 's> {
    shared: &'s Shared<'a>,
    /// Only cheaper plans (in the search's costs) are of interest.
    bound: u32,
    started: bool,
    store: Store,
    status: Status,
    memory: Rows<Memory>,
    /// Relaxed plans that are followed: their facts.
    anchors: Vec<Vec<u32>>,
    relaxed: Relaxed,
    novelty: Novelty,
    open: OpenList,
    facts: Vec<u32>,
    counts: Counts,
    /// States made since memory was looked at.
    unseen: usize,
}

impl<'a, 's> Search<'a, 's> {
    /// A search that has not begun.
    pub(crate) fn new(shared: &'s Shared<'a>, bound: u32) -> Search<'a, 's> {
        let task = shared.task;
        Search {
            shared,
            bound,
            started: false,
            store: Store::new(task),
            status: Status::new(shared.landmarks),
            memory: Rows::default(),
            anchors: Vec::new(),
            relaxed: Relaxed::new(task, Counting::Steps),
            novelty: Novelty { facts: task.facts, pairs: true, seen: FxHashMap::default(), bytes: 0 },
            open: OpenList::default(),
            facts: Vec::new(),
            counts: Counts::default(),
            unseen: 0,
        }
    }

    /// What the search took so far.
    pub(crate) fn counts(&self) -> Counts {
        Counts { work: self.work(), ..self.counts }
    }

    fn work(&self) -> u64 {
        self.relaxed.work + self.counts.work
    }

    /// Whether the first state may lead to the goal at all.
    fn start(&mut self) -> bool {
        let task = self.shared.task;
        let (first, _) = self.store.insert(&task.initial, NO_STATE, 0, 0);
        self.status.initial(self.shared.landmarks, task, &task.initial);
        let left = self.status.left(self.shared.landmarks, task, first, &task.initial);
        self.memory.push(Memory { anchor: 0, done: 0, left });
        self.open.push(0, (first, 0));
        self.anchor(&task.initial).is_some()
    }

    /// Searches on as far as is allowed.
    pub(crate) fn run(&mut self, allowed: Allowed) -> End {
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

    /// Makes the successors of a state; the plan if one of them is a goal. The buffers hold the state, a successor and
    /// the applicable operators.
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
            let cost = self.store.cost(id).saturating_add(task.costs[operator as usize]);
            if cost >= self.bound {
                continue;
            }
            task.apply(operator, state, next);
            self.counts.work += STATE_WORK;
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

    /// Bytes taken.
    pub(crate) fn bytes(&self) -> usize {
        self.store.bytes()[0]
            + self.status.bytes()
            + self.novelty.bytes
            + self.memory.bytes()
            + self.open.bytes()
            + self.anchors.iter().map(|a| a.len() * 4 + 24).sum::<usize>()
    }

    fn has_room(&self, memory: &MemoryLimit) -> bool {
        memory.has_room(|| self.bytes(), self.store.bytes()[1])
    }

    /// Follows a new relaxed plan from this state; `None` if there is none.
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
        facts.truncate(FOLLOWED);
        self.anchors.push(facts);
        Some(self.anchors.len() as u32 - 1)
    }

    fn evaluate(&mut self, parent: u32, operator: u32, child: u32, state: &[u32]) {
        let task = self.shared.task;
        let left = self.status.left(self.shared.landmarks, task, child, state);
        let before = self.memory[parent as usize];
        let mut memory = Memory { left, ..before };
        if left < before.left {
            match self.anchor(state) {
                Some(anchor) => memory = Memory { anchor, done: 0, left },
                None => {
                    self.memory.push(memory);
                    return;
                }
            }
        } else {
            for effect in task.effects.get(operator as usize) {
                let fact = task.id(effect.fact);
                if let Ok(place) = self.anchors[memory.anchor as usize].binary_search(&fact) {
                    memory.done |= 1 << place;
                }
            }
        }
        self.memory.push(memory);
        self.facts.clear();
        self.facts.extend(task.offsets.iter().zip(state).map(|(&offset, &value)| offset + value));
        let changed: Vec<u32> = task
            .effects
            .get(operator as usize)
            .iter()
            .map(|e| task.id(e.fact))
            .filter(|&f| task.holds(f, state))
            .collect();
        let novelty = self.novelty.of((left, memory.done.count_ones()), &self.facts, &changed);
        self.counts.work +=
            (changed.len() * if self.novelty.pairs { self.facts.len() } else { 1 }) as u64 / 8;
        let key = (novelty - 1).saturating_mul(1 << 20).saturating_add(left);
        self.open.push(key, (child, 0));
    }
}

#[cfg(test)]
mod tests {
    use rustc_hash::FxHashMap;

    use super::Novelty;

    #[test]
    fn a_fact_is_new_once_and_then_its_pairs_are() {
        let mut novelty = Novelty { facts: 4, pairs: true, seen: FxHashMap::default(), bytes: 0 };
        let key = (1, 0);
        for (state, changed, expected) in [
            (&[0, 2], &[0, 2][..], 1),
            (&[0, 2], &[0, 2], 3),
            (&[0, 3], &[3], 1),
            (&[1, 2], &[1], 1),
            (&[1, 3], &[1], 2),
            (&[1, 3], &[3], 3),
            (&[0, 3], &[], 3),
        ] {
            assert_eq!(novelty.of(key, state, changed), expected, "{state:?} {changed:?}");
        }
        assert_eq!(novelty.of((2, 0), &[1, 3], &[3]), 1, "states of another kind are not compared");
    }
}
