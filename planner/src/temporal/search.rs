//! Forward search over happenings; options decide how open entries are ordered.
//!
//! It is a lazy best-first search (Richter and Westphal 2010): an open entry is a parent state and a
//! step. The new state is generated, and evaluated by the heuristic, only once its entry is taken from
//! the queue. Preferred steps have a queue of their own, which is served more often after progress.

use std::collections::BTreeSet;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::calls::Failure;
use crate::ground::{Earns, Values};
use crate::memory::{Heap, Rows, soon};

use super::advance::{Gates, Open, Part, Situation, TemporalStep};
use super::destroy::shuffled;
use super::estimate::{Estimate, From};
use super::manner::{Counts, End, Manner};
use super::order::Inconsistent;
use super::overlap::starts_again;
use super::relaxed::Relaxed;
use super::space::{Base, Space};
use super::store::Store;
use super::timed::schedule;
use super::world::DurationRange;

/// Rank of an open entry: lower keys first, and among equal keys by age or in shuffled order.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rank(f64, u64);

impl Eq for Rank {}
impl PartialOrd for Rank {
    fn partial_cmp(&self, other: &Rank) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Rank {
    fn cmp(&self, other: &Rank) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    parent: u32,
    act: u32,
    part: Part,
    proposal: u32,
}

#[derive(Debug, Clone)]
struct Node {
    parent: u32,
    cost: f64,
}

const NONE: u32 = u32::MAX;
/// Bit in a state's extra word: a lookahead passed the state without evaluating it, and the search may
/// still reach it.
const PASSED: u64 = 1 << 63;
/// Work of scheduling one step of a path.
const WORK_A_STEP: u64 = 20;
/// Work of generating one state.
const WORK_A_STATE: u64 = 50;
/// Number of open entries between two checks of the memory limit.
const MOST_UNSEEN: usize = 4096;
/// Number of open entries that generating one state counts as, in addition to the entries made for it.
const UNSEEN_A_STATE: usize = 64;
/// Number of extra turns for the queue of preferred steps after progress (Richter and Westphal 2010).
const BOOST: i64 = 1000;

/// Part of a state's key for an action in progress: action, proposal, bits of its shortest duration,
/// and gates of its end effects.
type OpenKey = (u32, Option<Arc<str>>, u64, Gates);

/// Actions in progress, and number of past timed literals.
type Phase = (Vec<Open>, usize);

/// One temporal search, which starts from the situation after the steps of a base.
pub(crate) struct Search<'s, 'w, 'a> {
    space: &'s Space<'w, 'a>,
    relaxed: &'s mut Relaxed,
    base: &'s Base,
    manner: Manner,
    store: Store,
    nodes: Rows<Node>,
    steps: Rows<TemporalStep>,
    costs: Rows<f64>,
    phases: Rows<Phase>,
    phase_ids: FxHashMap<(Vec<OpenKey>, usize), u32>,
    /// Number of actions in progress, summed over all entries of `phases`.
    opened: usize,
    mark_ids: FxHashMap<u64, u32>,
    proposals: Vec<Arc<str>>,
    queues: [Heap<(Rank, Entry)>; 2],
    lead: [i64; 2],
    sequence: u64,
    best_heuristic: f64,
    counts: Counts,
    /// Number of open entries made since memory was last checked.
    unseen: usize,
    /// True if something was pruned that might have led to a plan.
    lossy: bool,
    /// Actions that could have started once more while running as often as allowed.
    overlapping: BTreeSet<u32>,
    /// Relaxed plan of the state evaluated last, to be followed next.
    ahead: Option<Ahead>,
}

/// Times of a path.
#[derive(Debug, Default)]
struct Times {
    makespan_s: f64,
    /// Number that distinguishes states with equal facts. In exact searches it covers everything on
    /// which future times depend; otherwise it is the time from the latest start of an action in
    /// progress to the end of all actions.
    mark: u64,
    /// Time from which each resource is free, in seconds; `None` if the heuristic does not need it.
    ready_s: Option<Vec<f64>>,
}

/// Relaxed plan to be followed as far as possible, and the state from which it starts.
struct Ahead {
    from: u32,
    plan: Vec<(u32, Part)>,
}

impl<'s, 'w, 'a> Search<'s, 'w, 'a> {
    /// Search that has not begun.
    pub fn new(
        space: &'s Space<'w, 'a>,
        relaxed: &'s mut Relaxed,
        base: &'s Base,
        manner: Manner,
    ) -> Search<'s, 'w, 'a> {
        Search {
            store: Store::new(space.world.ground),
            space,
            relaxed,
            base,
            manner,
            nodes: Rows::default(),
            steps: Rows::default(),
            costs: Rows::default(),
            phases: Rows::default(),
            phase_ids: FxHashMap::default(),
            opened: 0,
            mark_ids: FxHashMap::default(),
            proposals: Vec::new(),
            queues: Default::default(),
            lead: [0, 0],
            sequence: 0,
            best_heuristic: f64::INFINITY,
            counts: Counts::default(),
            unseen: 0,
            lossy: false,
            overlapping: BTreeSet::new(),
            ahead: None,
        }
    }

    /// Runs the search to its end; returns its result and counts.
    pub fn run(mut self, stop: &dyn Fn() -> bool) -> Result<(End, Counts), Failure> {
        let nowhere = TemporalStep {
            act: NONE,
            part: Part::Free,
            proposal: None,
            taken_s: None,
            span: DurationRange { least_s: 0.0, most_s: 0.0 },
        };
        if let Some(end) = self.visit(NONE, nowhere, self.base.situation.clone(), self.base.costs)? {
            return Ok((end, self.counts));
        }
        let mut taken: u64 = 0;
        loop {
            self.counts.work += self.relaxed.spent();
            if self.counts.evaluated >= self.manner.evaluations || self.counts.work >= self.manner.work {
                return Ok((End::Budget, self.counts));
            }
            if taken.is_multiple_of(32) && stop() {
                return Ok((End::Stopped, self.counts));
            }
            if self.unseen > MOST_UNSEEN && !self.has_room() {
                return Ok((End::Memory, self.counts));
            }
            self.unseen %= MOST_UNSEEN;
            taken += 1;
            self.unseen += UNSEEN_A_STATE;
            if let Some(ahead) = self.ahead.take() {
                if let Some(end) = self.look_ahead(ahead)? {
                    return Ok((end, self.counts));
                }
                continue;
            }
            let Some(entry) = self.take() else {
                let proven = !self.lossy && self.space.world.is_complete();
                return Ok((End::Exhausted { proven, overlapping: self.overlapping }, self.counts));
            };
            if let Some(end) = self.follow(entry)? {
                return Ok((end, self.counts));
            }
        }
    }

    fn bytes(&self) -> usize {
        let key = size_of::<OpenKey>() + size_of::<Open>();
        self.store.bytes()[0]
            + self.nodes.bytes()
            + self.steps.bytes()
            + self.costs.bytes()
            + self.phases.bytes()
            + self.phase_ids.capacity() * size_of::<[usize; 6]>()
            + self.opened * key
            + self.queues.iter().map(Heap::bytes).sum::<usize>()
    }

    fn has_room(&self) -> bool {
        let phases = self.phase_ids.capacity();
        let next = if soon(self.phase_ids.len(), phases) { 2 * phases * size_of::<[usize; 6]>() } else { 0 };
        self.manner.memory.has_room(|| self.bytes(), next + self.store.bytes()[1])
    }

    fn take(&mut self) -> Option<Entry> {
        let queue = match (self.queues[0].is_empty(), self.queues[1].is_empty()) {
            (true, true) => return None,
            (true, false) => 1,
            (false, true) => 0,
            (false, false) => usize::from(self.lead[1] <= self.lead[0]),
        };
        self.lead[queue] += 1;
        self.queues[queue].pop().map(|(_, entry)| entry)
    }

    fn situation(&self, node: u32) -> Situation {
        let mut state = Values { values: Vec::new(), numbers: Vec::new() };
        let extra = self.store.get(node, &mut state);
        let (open, timed) = self.phases[((extra & !PASSED) >> 32) as usize].clone();
        Situation { state, open, timed }
    }

    fn path(&self, mut node: u32) -> Vec<TemporalStep> {
        let mut steps = Vec::new();
        while node != NONE && self.nodes[node as usize].parent != NONE {
            steps.push(self.steps[node as usize].clone());
            node = self.nodes[node as usize].parent;
        }
        steps.reverse();
        steps
    }

    fn follow(&mut self, entry: Entry) -> Result<Option<End>, Failure> {
        let from = self.situation(entry.parent);
        let proposal = self.proposals.get(entry.proposal as usize).cloned();
        let nothing = DurationRange { least_s: 0.0, most_s: 0.0 };
        let mut step =
            TemporalStep { act: entry.act, part: entry.part, proposal, taken_s: None, span: nothing };
        let Some(next) = self.space.world.advance(&from, &mut step)? else { return Ok(None) };
        let costs = self.costs[entry.parent as usize] + self.space.step_cost(&from.state, &step)?;
        self.visit(entry.parent, step, next, costs)
    }

    fn bounded(&self) -> bool {
        self.manner.bound.is_finite() || self.manner.weight.is_some()
    }

    /// Times of the path to a parent state and a new step; an error if they are inconsistent.
    fn times(&mut self, parent: u32, step: &TemporalStep, open: bool) -> Result<Times, Inconsistent> {
        let wanted = self.manner.timed || self.bounded() && self.space.timed_measure();
        if !self.space.tight && !wanted {
            return Ok(Times::default());
        }
        let path = self.path(parent);
        self.counts.work += WORK_A_STEP * path.len() as u64;
        let steps = path.iter().chain((parent != NONE).then_some(step));
        if !self.space.tight {
            let mut clock = self.base.clock.clone();
            steps.for_each(|step| self.space.tick(&mut clock, step));
            let ready_s = self.manner.timed.then(|| clock.ready_s());
            return Ok(Times { makespan_s: clock.makespan_s(), ready_s, ..Times::default() });
        }
        let mut track = self.base.track.clone();
        for step in steps {
            track.push(self.space, step)?;
        }
        let latest_s = track.latest_open_s();
        let exact = self.manner.exact.then(|| track.mark(self.space));
        if open {
            track.close(self.space)?;
        } else {
            // What is given from outside comes later in every continuation: it must not be too early already.
            track.clone().pass_timed(self.space)?;
        }
        let makespan_s = track.order.makespan_s();
        let slack_s = latest_s.map_or(0.0, |start_s| makespan_s - start_s);
        let mark = exact.unwrap_or_else(|| u64::from((slack_s as f32).to_bits()));
        Ok(Times { makespan_s, mark, ready_s: self.manner.timed.then(|| track.order.ready_s()) })
    }

    /// Processes a generated state: it is dropped if known or too expensive, else evaluated and
    /// expanded. Returns `Found` if a plan ends here.
    fn visit(
        &mut self,
        parent: u32,
        step: TemporalStep,
        situation: Situation,
        costs: f64,
    ) -> Result<Option<End>, Failure> {
        let Ok(times) = self.times(parent, &step, !situation.open.is_empty()) else { return Ok(None) };
        let measured = self.space.measured(costs, &situation.state, times.makespan_s)?;
        let too_dear = measured >= self.manner.bound;
        if too_dear && self.space.earns != Earns::Surely {
            self.lossy |= self.space.earns == Earns::Perhaps;
            return Ok(None);
        }
        self.counts.work += WORK_A_STATE + situation.state.values.len() as u64;
        let extra = self.extra(&situation, times.mark);
        let (node, new) = self.store.insert(&situation.state, extra);
        if new {
            self.nodes.push(Node { parent, cost: measured });
            self.steps.push(step);
            self.costs.push(costs);
        } else {
            self.lossy |= self.depends_on_times(&situation);
            let dearer = measured >= self.nodes[node as usize].cost - 1e-9;
            if !self.bounded() || dearer || self.is_ancestor(node, parent) {
                return Ok(None);
            }
            self.nodes[node as usize] = Node { parent, cost: measured };
            self.steps[node as usize] = step;
            self.costs[node as usize] = costs;
        }
        if !too_dear && self.space.world.is_goal(&situation)? {
            if self.works_out(node)? {
                return Ok(Some(End::Found(self.path(node))));
            }
            // What is stretched may do something else.
            self.lossy = true;
        }
        self.expand(node, &situation, times.ready_s.as_deref())?;
        Ok(None)
    }

    /// Follows a relaxed plan: applies its steps, the first applicable one each time, until none is
    /// applicable (Vidal 2004).
    fn look_ahead(&mut self, ahead: Ahead) -> Result<Option<End>, Failure> {
        let mut from = self.situation(ahead.from);
        let mut node = ahead.from;
        let mut left = ahead.plan;
        let nothing = DurationRange { least_s: 0.0, most_s: 0.0 };
        let mut last: Option<(TemporalStep, Situation, f64)> = None;
        loop {
            let mut taken = None;
            for (position, &(act, part)) in left.iter().enumerate() {
                // Proposed parameters are chosen by the search itself.
                if !self.space.world.acts[act as usize].grounding.is_empty() {
                    continue;
                }
                let mut step = TemporalStep { act, part, proposal: None, taken_s: None, span: nothing };
                if part == Part::Start && self.is_full(&from, act) {
                    continue;
                }
                if let Some(next) = self.space.world.advance(&from, &mut step)? {
                    taken = Some((position, step, next));
                    break;
                }
            }
            let Some((position, step, next)) = taken else { break };
            left.remove(position);
            if let Some((step, situation, costs)) = last.take() {
                let Some(made) = self.pass(node, step, &situation, costs) else { return Ok(None) };
                node = made;
            }
            let costs = self.costs[node as usize] + self.space.step_cost(&from.state, &step)?;
            last = Some((step, next.clone(), costs));
            from = next;
        }
        match last {
            Some((step, situation, costs)) => self.visit(node, step, situation, costs),
            None => Ok(None),
        }
    }

    /// True if the plan that ends in a state remains valid with its times. A plan whose first steps
    /// belong to a base counts as valid, as those steps are not known here.
    fn works_out(&self, node: u32) -> Result<bool, Failure> {
        let settled = !self.space.is_open && self.space.world.ground.timed.is_empty();
        if settled || !self.base.track.actions.is_empty() {
            return Ok(true);
        }
        let mut path = self.path(node);
        let reaches = self.space.replay_to_goal(&mut path, &|| false)?.is_some();
        Ok(reaches && (self.space.is_open || schedule(self.space, &path, &|| false).is_some()))
    }

    /// Adds a state on the path of a lookahead without evaluating it; `None` if it is known or its
    /// times are inconsistent.
    fn pass(&mut self, parent: u32, step: TemporalStep, situation: &Situation, costs: f64) -> Option<u32> {
        let times = self.times(parent, &step, !situation.open.is_empty()).ok()?;
        let extra = self.extra(situation, times.mark) | PASSED;
        let (node, new) = self.store.insert(&situation.state, extra);
        if new {
            let cost = self.space.measured(costs, &situation.state, times.makespan_s).ok()?;
            self.nodes.push(Node { parent, cost });
            self.steps.push(step);
            self.costs.push(costs);
            return Some(node);
        }
        None
    }

    fn is_ancestor(&self, node: u32, mut of: u32) -> bool {
        while of != NONE {
            if of == node {
                return true;
            }
            of = self.nodes[of as usize].parent;
        }
        false
    }

    /// True if a state's continuations depend on times of its path that its mark does not cover.
    fn depends_on_times(&self, situation: &Situation) -> bool {
        let fits =
            !self.manner.exact && (!situation.open.is_empty() || !self.space.world.ground.timed.is_empty());
        fits || self.bounded() && self.space.timed_measure()
    }

    fn extra(&mut self, situation: &Situation, mark: u64) -> u64 {
        let key = situation
            .open
            .iter()
            .map(|open| (open.act, open.proposal.clone(), open.span.least_s.to_bits(), open.gates.clone()))
            .collect();
        let next = self.phases.len() as u32;
        let phase = *self.phase_ids.entry((key, situation.timed)).or_insert(next);
        if phase == next {
            self.opened += situation.open.len();
            self.phases.push((situation.open.clone(), situation.timed));
        }
        let mark = match self.manner.exact {
            true => {
                let next = self.mark_ids.len() as u32;
                *self.mark_ids.entry(mark).or_insert(next)
            }
            false => mark as u32,
        };
        u64::from(phase) << 32 | u64::from(mark)
    }

    fn expand(&mut self, node: u32, situation: &Situation, ready_s: Option<&[f64]>) -> Result<(), Failure> {
        self.counts.evaluated += 1;
        let open: Vec<u32> = situation.open.iter().map(|open| open.act).collect();
        let from = From { state: &situation.state, open: &open, ready_s };
        let estimate = match self.relaxed.estimate(self.space.world, &from)? {
            Some(estimate) => estimate,
            // What a module will propose in later states is not known: an exact search looks there all the same.
            None if self.manner.exact && self.space.world.proposes => {
                Estimate { cost: f64::MAX, ..Estimate::default() }
            }
            None => {
                self.lossy |= self.space.world.proposes;
                return Ok(());
            }
        };
        let cost = self.nodes[node as usize].cost;
        let in_time = self.costs[node as usize] + self.space.time_weight() * estimate.finish_s;
        let reachable = if self.space.counts_time() { cost.max(in_time) } else { cost };
        if self.space.earns != Earns::Surely && reachable >= self.manner.bound {
            self.lossy |= self.space.earns == Earns::Perhaps;
            return Ok(());
        }
        self.counts.expanded += 1;
        let progress = estimate.cost < self.best_heuristic;
        if progress {
            self.best_heuristic = estimate.cost;
            self.lead[1] -= BOOST;
        }
        let follow = progress || self.manner.eager;
        if follow && self.manner.weight.is_none() && estimate.plan.len() > 1 {
            self.ahead = Some(Ahead { from: node, plan: estimate.plan.clone() });
        }
        let key = match self.manner.weight {
            None => estimate.cost,
            Some(weight) if self.manner.timed => reachable + (weight - 1.0) * estimate.cost,
            Some(weight) => cost + weight * estimate.cost,
        };
        self.enqueue(node, situation, &estimate, key)
    }

    /// True if as many instances of an action are in progress as allowed.
    fn is_full(&self, situation: &Situation, act: u32) -> bool {
        situation.open.iter().filter(|open| open.act == act).count() >= self.manner.at_once
    }

    /// Records that an action could have overlapped itself, if it can start once more.
    fn note_overlap(&mut self, situation: &Situation, act: u32) -> Result<(), Failure> {
        if self.overlapping.contains(&act) {
            return Ok(());
        }
        if starts_again(self.space.world, situation, act)? {
            self.overlapping.insert(act);
        }
        Ok(())
    }

    fn enqueue(
        &mut self,
        node: u32,
        situation: &Situation,
        estimate: &Estimate,
        key: f64,
    ) -> Result<(), Failure> {
        let add = |search: &mut Self, act: u32, part: Part, proposal: u32| {
            let entry = Entry { parent: node, act, part, proposal };
            search.sequence += 1;
            search.unseen += 1;
            let rank = Rank(key, shuffled(search.sequence, search.manner.shuffle));
            search.queues[0].push((rank, entry));
            if part == Part::Free || estimate.preferred.binary_search(&(act, part)).is_ok() {
                search.queues[1].push((rank, entry));
            }
        };
        for open in &situation.open {
            let proposal = open.proposal.as_ref().map_or(NONE, |name| self.proposal_id(name));
            add(self, open.act, Part::End, proposal);
        }
        if situation.timed < self.space.world.ground.timed.len() {
            add(self, NONE, Part::Free, NONE);
        }
        for act in self.space.candidates(&situation.state) {
            let part = if self.space.open_act[act as usize] { Part::Start } else { Part::Whole };
            if part == Part::Start && self.is_full(situation, act) {
                self.note_overlap(situation, act)?;
                continue;
            }
            let declared = &self.space.world.acts[act as usize];
            match declared.grounding.first() {
                None => add(self, act, part, NONE),
                Some((module, arguments)) => {
                    let names = self.space.world.calls.proposals(*module, arguments, &situation.state)?;
                    for name in names {
                        let proposal = self.proposal_id(&name);
                        add(self, act, part, proposal);
                    }
                }
            }
        }
        Ok(())
    }

    fn proposal_id(&mut self, name: &Arc<str>) -> u32 {
        let known = self.proposals.iter().position(|known| known == name);
        known.unwrap_or_else(|| {
            self.proposals.push(name.clone());
            self.proposals.len() - 1
        }) as u32
    }
}
