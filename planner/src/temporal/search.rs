//! Forward search over happenings: one search, parameterised by how open entries are ordered.
//!
//! Lazy best-first search (Richter and Westphal 2010): an entry is a parent and a step; its state is made, and its
//! heuristic evaluated, only when it is taken from the queue. Preferred steps have a queue of their own, which is
//! served more often after progress.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::calls::Failure;
use crate::ground::{Expression, Values};

use super::advance::{Accesses, Open, Situation, Step};
use super::order::{Inconsistent, Order};
use super::relaxed::{Part, Relaxed};
use super::store::Store;
use super::world::{Moment, Span, World};

/// How to search.
#[derive(Debug, Clone)]
pub(crate) struct Manner {
    /// Weight of the heuristic against what the plan costs so far; `None` for the heuristic alone.
    pub weight: Option<f64>,
    /// Only plans that cost less than this.
    pub bound: f64,
    /// Stop after this many evaluated states.
    pub evaluations: u64,
    /// Stop beyond this much memory.
    pub memory_bytes: usize,
}

/// How a search ended.
#[derive(Debug, Clone)]
pub(crate) enum End {
    /// A sequence of steps to the goal.
    Found(Vec<Step>),
    /// Every state within the bound was seen.
    Exhausted,
    /// The budget of evaluations is used up.
    Budget,
    /// Asked to stop.
    Stopped,
    /// Out of memory.
    Memory,
}

/// What plans are measured by.
#[derive(Debug, Clone)]
pub(crate) enum Measure {
    /// When the last action ends.
    Makespan,
    /// Costs of the actions, plus a weight times the makespan.
    Additive {
        /// Weight of the makespan.
        time_weight: f64,
    },
    /// An expression over the last state and the makespan, to be made small.
    Expression(Expression),
}

/// The key of an entry in the queue, smaller first, then older.
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
    closed: bool,
}

const NONE: u32 = u32::MAX;
/// How much more often the preferred queue is served after progress (Richter and Westphal 2010).
const BOOST: i64 = 1000;

/// A search space with everything that several searches on it share.
pub(crate) struct Space<'w, 'a> {
    /// The task.
    pub world: &'w World<'a>,
    /// By action, whether its start and end are apart.
    pub open_act: Vec<bool>,
    /// What plans are measured by.
    pub measure: Measure,
    /// What happenings touch.
    pub accesses: Accesses,
    /// By variable and value, the actions that are looked at where the fact holds.
    pivots: Vec<Vec<Vec<u32>>>,
    /// Actions that are looked at everywhere.
    everywhere: Vec<u32>,
    /// Whether times can make a sequence impossible.
    pub tight: bool,
}

impl<'w, 'a> Space<'w, 'a> {
    /// The space in which the given actions have start and end apart.
    pub fn new(world: &'w World<'a>, open_act: Vec<bool>, measure: Measure) -> Space<'w, 'a> {
        let ground = world.ground;
        let mut pivots: Vec<Vec<Vec<u32>>> =
            ground.variables.iter().map(|variable| vec![Vec::new(); variable.values.len()]).collect();
        let mut asked: Vec<Vec<u32>> =
            ground.variables.iter().map(|variable| vec![0; variable.values.len()]).collect();
        for fact in world.acts.iter().flat_map(|act| &act.at_start.facts) {
            asked[fact.variable as usize][fact.value as usize] += 1;
        }
        let mut everywhere = Vec::new();
        for (index, act) in world.acts.iter().enumerate() {
            let rarest = act
                .at_start
                .facts
                .iter()
                .min_by_key(|fact| asked[fact.variable as usize][fact.value as usize]);
            match rarest {
                Some(fact) => pivots[fact.variable as usize][fact.value as usize].push(index as u32),
                None => everywhere.push(index as u32),
            }
        }
        let accesses = Accesses::new(world);
        let tight = open_act.contains(&true) || !ground.timed.is_empty();
        Space { world, open_act, measure, accesses, pivots, everywhere, tight }
    }

    /// Whether the measure of a partial plan needs its times.
    fn timed_measure(&self) -> bool {
        match &self.measure {
            Measure::Makespan => true,
            Measure::Additive { time_weight } => *time_weight != 0.0,
            Measure::Expression(_) => true,
        }
    }

    /// The order that a sequence of steps stands for, those in progress at its end ended as soon as possible.
    pub fn order(&self, steps: &[Step]) -> Result<Ordered, Inconsistent> {
        let mut order = Order::new(self.accesses.resources);
        let mut open: Vec<(u32, Option<Arc<str>>, u32, Span)> = Vec::new();
        let mut starts = Vec::with_capacity(steps.len());
        let mut timed = 0;
        for (index, step) in steps.iter().enumerate() {
            let mut started = None;
            match step.part {
                Part::Free => {
                    order.push_fixed(&self.accesses.timed[timed], self.world.ground.timed[timed].time_s)?;
                    timed += 1;
                }
                Part::Whole => {
                    let (start, end) = &self.accesses.acts[step.act as usize];
                    let node = order.push(start);
                    let end = end.as_ref().map(|end| order.push_end(node, end, step.span)).transpose()?;
                    started = Some((node, end));
                }
                Part::Start => {
                    let node = order.push(&self.accesses.acts[step.act as usize].0);
                    open.push((step.act, step.proposal.clone(), node, step.span));
                    starts.push((index, node, None));
                }
                Part::End => {
                    let same = |(act, proposal, ..): &(u32, Option<Arc<str>>, u32, Span)| {
                        *act == step.act && *proposal == step.proposal
                    };
                    if let Some(position) = open.iter().position(same) {
                        let (_, _, node, span) = open.remove(position);
                        if let Some(access) = &self.accesses.acts[step.act as usize].1 {
                            let end = order.push_end(node, access, span)?;
                            starts
                                .iter_mut()
                                .filter(|(_, start, _)| *start == node)
                                .for_each(|own| own.2 = Some(end));
                        }
                    }
                }
            }
            if let Some((node, end)) = started {
                starts.push((index, node, end));
            }
        }
        for (act, _, node, span) in open {
            if let Some(access) = &self.accesses.acts[act as usize].1 {
                let end = order.push_end(node, access, span)?;
                starts.iter_mut().filter(|(_, start, _)| *start == node).for_each(|own| own.2 = Some(end));
            }
        }
        Ok(Ordered { order, starts })
    }

    /// What an action adds to an additive metric.
    fn step_cost(&self, before: &Values, step: &Step) -> Result<f64, Failure> {
        let Measure::Additive { .. } = self.measure else { return Ok(0.0) };
        if matches!(step.part, Part::End | Part::Free) {
            return Ok(0.0);
        }
        let moment = Moment {
            state: before,
            duration_s: step.span.least_s,
            proposal: step.proposal.as_ref(),
            level: crate::attachment::Level::Exact,
        };
        self.world.evaluate(&self.world.acts[step.act as usize].cost, &moment)
    }

    /// The measure of a plan or a beginning of one, from its additive costs, its last state and its makespan.
    pub fn measured(&self, costs: f64, state: &Values, makespan_s: f64) -> Result<f64, Failure> {
        match &self.measure {
            Measure::Makespan => Ok(makespan_s),
            Measure::Additive { time_weight } => Ok(costs + time_weight * makespan_s),
            Measure::Expression(expression) => {
                let moment =
                    Moment { state, duration_s: 0.0, proposal: None, level: crate::attachment::Level::Exact };
                let timed = with_total_time(expression, makespan_s);
                self.world.evaluate(&timed, &moment)
            }
        }
    }

    /// The measure of a complete sequence of steps from the first state; `None` if it does not work out.
    pub fn replay(&self, steps: &mut [Step]) -> Result<Option<(f64, Situation)>, Failure> {
        let mut situation = Situation { state: self.world.initial()?, open: Vec::new(), timed: 0 };
        let mut costs = 0.0;
        for step in steps.iter_mut() {
            let Some(next) = self.world.advance(&situation, step)? else { return Ok(None) };
            costs += self.step_cost(&situation.state, step)?;
            situation = next;
        }
        let Ok(ordered) = self.order(steps) else { return Ok(None) };
        let measured = self.measured(costs, &situation.state, ordered.order.makespan_s())?;
        Ok(Some((measured, situation)))
    }
}

/// An order with where the actions of its steps start and end.
pub(crate) struct Ordered {
    /// The order.
    pub order: Order,
    /// Step, its start, and its end if it is durative.
    pub starts: Vec<(usize, u32, Option<u32>)>,
}

fn with_total_time(expression: &Expression, makespan_s: f64) -> Expression {
    let inner = |inner: &Expression| with_total_time(inner, makespan_s);
    match expression {
        Expression::TotalTime => Expression::Constant(makespan_s),
        Expression::Sum(parts) => Expression::Sum(parts.iter().map(inner).collect()),
        Expression::Product(parts) => Expression::Product(parts.iter().map(inner).collect()),
        Expression::Difference(left, right) => {
            Expression::Difference(Box::new(inner(left)), Box::new(inner(right)))
        }
        Expression::Quotient(left, right) => {
            Expression::Quotient(Box::new(inner(left)), Box::new(inner(right)))
        }
        Expression::Negative(operand) => Expression::Negative(Box::new(inner(operand))),
        other => other.clone(),
    }
}

/// What a search has counted.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counts {
    /// States evaluated.
    pub evaluated: u64,
    /// States expanded.
    pub expanded: u64,
}

/// An action in progress as a key: action, proposal, bits of its duration, gates of its end.
type OpenKey = (u32, Option<Arc<str>>, u64, u64);

/// One search from the first state.
pub(crate) struct Search<'s, 'w, 'a> {
    space: &'s Space<'w, 'a>,
    relaxed: &'s mut Relaxed,
    manner: Manner,
    store: Store,
    nodes: Vec<Node>,
    steps: Vec<Step>,
    costs: Vec<f64>,
    opens: Vec<Vec<Open>>,
    open_ids: FxHashMap<Vec<OpenKey>, u32>,
    proposals: Vec<Arc<str>>,
    queues: [BinaryHeap<Reverse<(Rank, Entry)>>; 2],
    lead: [i64; 2],
    sequence: u64,
    best_heuristic: f64,
    counts: Counts,
}

impl<'s, 'w, 'a> Search<'s, 'w, 'a> {
    /// Prepares a search.
    pub fn new(space: &'s Space<'w, 'a>, relaxed: &'s mut Relaxed, manner: Manner) -> Search<'s, 'w, 'a> {
        Search {
            store: Store::new(space.world.ground),
            space,
            relaxed,
            manner,
            nodes: Vec::new(),
            steps: Vec::new(),
            costs: Vec::new(),
            opens: Vec::new(),
            open_ids: FxHashMap::default(),
            proposals: Vec::new(),
            queues: Default::default(),
            lead: [0, 0],
            sequence: 0,
            best_heuristic: f64::INFINITY,
            counts: Counts::default(),
        }
    }

    /// Searches.
    pub fn run(mut self, stop: &dyn Fn() -> bool) -> Result<(End, Counts), Failure> {
        let first = Situation { state: self.space.world.initial()?, open: Vec::new(), timed: 0 };
        let nowhere =
            Step { act: NONE, part: Part::Free, proposal: None, span: Span { least_s: 0.0, most_s: 0.0 } };
        if let Some(end) = self.visit(NONE, nowhere, first, 0.0)? {
            return Ok((end, self.counts));
        }
        loop {
            if self.counts.evaluated >= self.manner.evaluations {
                return Ok((End::Budget, self.counts));
            }
            if self.counts.evaluated.is_multiple_of(16) && stop() {
                return Ok((End::Stopped, self.counts));
            }
            if self.counts.evaluated.is_multiple_of(256) && self.bytes() > self.manner.memory_bytes {
                return Ok((End::Memory, self.counts));
            }
            let Some(entry) = self.take() else { return Ok((End::Exhausted, self.counts)) };
            if let Some(end) = self.follow(entry)? {
                return Ok((end, self.counts));
            }
        }
    }

    fn bytes(&self) -> usize {
        let entries: usize = self.queues.iter().map(BinaryHeap::capacity).sum();
        self.store.bytes()
            + self.nodes.capacity() * (size_of::<Node>() + size_of::<Step>() + 8)
            + entries * size_of::<(Rank, Entry)>()
    }

    fn take(&mut self) -> Option<Entry> {
        let queue = match (self.queues[0].is_empty(), self.queues[1].is_empty()) {
            (true, true) => return None,
            (true, false) => 1,
            (false, true) => 0,
            (false, false) => usize::from(self.lead[1] <= self.lead[0]),
        };
        self.lead[queue] += 1;
        self.queues[queue].pop().map(|Reverse((_, entry))| entry)
    }

    fn situation(&self, node: u32) -> Situation {
        let mut state = Values { values: Vec::new(), numbers: Vec::new() };
        let extra = self.store.get(node, &mut state);
        let (open, timed) = ((extra >> 40) as usize, (extra >> 32) & 0xff);
        Situation { state, open: self.opens[open].clone(), timed: timed as usize }
    }

    fn path(&self, mut node: u32) -> Vec<Step> {
        let mut steps = Vec::new();
        while self.nodes[node as usize].parent != NONE {
            steps.push(self.steps[node as usize].clone());
            node = self.nodes[node as usize].parent;
        }
        steps.reverse();
        steps
    }

    fn follow(&mut self, entry: Entry) -> Result<Option<End>, Failure> {
        let from = self.situation(entry.parent);
        let proposal = self.proposals.get(entry.proposal as usize).cloned();
        let nothing = Span { least_s: 0.0, most_s: 0.0 };
        let mut step = Step { act: entry.act, part: entry.part, proposal, span: nothing };
        let Some(next) = self.space.world.advance(&from, &mut step)? else { return Ok(None) };
        let costs = self.costs[entry.parent as usize] + self.space.step_cost(&from.state, &step)?;
        self.visit(entry.parent, step, next, costs)
    }

    /// Takes a situation in: forgets it if it is known or too dear, else evaluates and expands it.
    fn visit(
        &mut self,
        parent: u32,
        step: Step,
        situation: Situation,
        costs: f64,
    ) -> Result<Option<End>, Failure> {
        let bounded = self.manner.bound.is_finite() || self.manner.weight.is_some();
        let (mut makespan_s, mut slack_s) = (0.0, 0.0);
        let needs_order = self.space.tight || (bounded && self.space.timed_measure());
        let mut path = None;
        if needs_order && parent != NONE {
            let mut steps = self.path(parent);
            steps.push(step.clone());
            let Ok(ordered) = self.space.order(&steps) else { return Ok(None) };
            makespan_s = ordered.order.makespan_s();
            if !situation.open.is_empty() {
                slack_s = latest_open_start(&ordered, &steps).map_or(0.0, |start_s| makespan_s - start_s);
            }
            path = Some(steps);
        }
        let measured = self.space.measured(costs, &situation.state, makespan_s)?;
        if measured >= self.manner.bound {
            return Ok(None);
        }
        let extra = self.extra(&situation, slack_s);
        let (node, new) = self.store.insert(&situation.state, extra);
        if new {
            self.nodes.push(Node { parent, cost: measured, closed: false });
            self.steps.push(step);
            self.costs.push(costs);
        } else {
            let known = &mut self.nodes[node as usize];
            if !bounded || measured >= known.cost - 1e-9 || known.parent == NONE {
                return Ok(None);
            }
            if self.is_ancestor(node, parent) {
                return Ok(None);
            }
            self.nodes[node as usize] = Node { parent, cost: measured, closed: false };
            self.steps[node as usize] = step;
            self.costs[node as usize] = costs;
        }
        if self.space.world.is_goal(&situation)? {
            return Ok(Some(End::Found(path.unwrap_or_else(|| self.path(node)))));
        }
        self.expand(node, &situation)?;
        Ok(None)
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

    fn extra(&mut self, situation: &Situation, slack_s: f64) -> u64 {
        let key: Vec<OpenKey> = situation
            .open
            .iter()
            .map(|open| (open.act, open.proposal.clone(), open.span.least_s.to_bits(), open.gates))
            .collect();
        let next = self.opens.len() as u32;
        let id = *self.open_ids.entry(key).or_insert(next);
        if id == next {
            self.opens.push(situation.open.clone());
        }
        u64::from(id) << 40 | (situation.timed as u64 & 0xff) << 32 | u64::from((slack_s as f32).to_bits())
    }

    fn expand(&mut self, node: u32, situation: &Situation) -> Result<(), Failure> {
        self.counts.evaluated += 1;
        let open: Vec<u32> = situation.open.iter().map(|open| open.act).collect();
        let Some(estimate) = self.relaxed.estimate(self.space.world, &situation.state, &open)? else {
            return Ok(());
        };
        self.counts.expanded += 1;
        self.nodes[node as usize].closed = true;
        if estimate.cost < self.best_heuristic {
            self.best_heuristic = estimate.cost;
            self.lead[1] -= BOOST;
        }
        let key = match self.manner.weight {
            None => estimate.cost,
            Some(weight) => self.nodes[node as usize].cost + weight * estimate.cost,
        };
        let preferred = estimate.preferred;
        let add = |search: &mut Self, act: u32, part: Part, proposal: u32| {
            let entry = Entry { parent: node, act, part, proposal };
            search.sequence += 1;
            let rank = Rank(key, search.sequence);
            search.queues[0].push(Reverse((rank, entry)));
            if preferred.contains(&(act, part)) || part == Part::Free {
                search.queues[1].push(Reverse((rank, entry)));
            }
        };
        for open in &situation.open {
            let proposal = open.proposal.as_ref().map_or(NONE, |name| self.proposal_id(name));
            add(self, open.act, Part::End, proposal);
        }
        if situation.timed < self.space.world.ground.timed.len() {
            add(self, NONE, Part::Free, NONE);
        }
        for act in self.candidates(&situation.state) {
            let part = if self.space.open_act[act as usize] { Part::Start } else { Part::Whole };
            // PDDL 2.1 lets no instance of an action overlap itself.
            if open.contains(&act) {
                continue;
            }
            let declared = &self.space.world.acts[act as usize];
            match declared.grounding.first() {
                None => add(self, act, part, NONE),
                Some((module, arguments)) => {
                    let own = &declared.origin.arguments;
                    let names =
                        self.space.world.calls.proposals(*module, arguments, own, &situation.state)?;
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

    /// Actions whose facts at start hold, in order.
    fn candidates(&self, state: &Values) -> Vec<u32> {
        let pivots = &self.space.pivots;
        let by_fact =
            state.values.iter().enumerate().flat_map(|(variable, &value)| &pivots[variable][value as usize]);
        let fits = |act: &&u32| {
            let facts = &self.space.world.acts[**act as usize].at_start.facts;
            facts.iter().all(|fact| state.values[fact.variable as usize] == fact.value)
        };
        let mut found: Vec<u32> = by_fact.chain(&self.space.everywhere).filter(fits).copied().collect();
        found.sort_unstable();
        found
    }
}

fn latest_open_start(ordered: &Ordered, steps: &[Step]) -> Option<f64> {
    let ended = |index: usize| {
        steps[index + 1..].iter().any(|step| step.part == Part::End && step.act == steps[index].act)
    };
    let open =
        ordered.starts.iter().filter(|(index, ..)| steps[*index].part == Part::Start && !ended(*index));
    open.map(|&(_, node, _)| ordered.order.earliest_s(node)).max_by(f64::total_cmp)
}
