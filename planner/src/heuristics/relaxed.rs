//! Additive heuristic h_add, and the relaxed plan made of its best supporters (FF heuristic with h_add
//! supporters; Bonet and Geffner 2001, Keyder and Geffner 2008).

use crate::classical::compiled::{Compiled, Lists};
use crate::classical::numbers::NumberChange;
use crate::ground::GroundFact;

use super::intervals::Intervals;
use super::queue::RadixHeap;

/// Value that stands for no node, no operator or infinite cost.
const NONE: u32 = u32::MAX;

/// Maximum number of repetitions of an operator that refills a consumed number.
const MOST_REFILLS: f64 = 1000.0;

/// Number of steps that weigh as much as one unit of cost, in tasks with zero-cost operators.
const COST_OVER_STEPS: u32 = 64;

/// Way in which a heuristic counts operator costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counting {
    /// Every operator costs one.
    Steps,
    /// Cost plus one; one for every operator if all costs are one.
    CostAndSteps,
    /// Cost; each step adds a small amount in tasks with zero-cost operators, so that plans do not grow
    /// longer for free.
    CostThenSteps,
}

impl Counting {
    /// Cost of an operator under this counting.
    pub(crate) fn of(self, task: &Compiled, operator: usize) -> u32 {
        match self {
            Counting::Steps => 1,
            Counting::CostAndSteps if task.unit_cost => 1,
            Counting::CostAndSteps => task.costs[operator] + 1,
            Counting::CostThenSteps if task.free_operators => {
                reached(task.costs[operator].saturating_mul(COST_OVER_STEPS), 1)
            }
            Counting::CostThenSteps => task.costs[operator],
        }
    }
}

/// Operator of a relaxed plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Relevant {
    /// Estimated cost up to and including the operator.
    pub at: u32,
    /// The operator.
    pub operator: u32,
    /// Number of times that the operator is applied, for the sake of a numeric condition.
    pub times: u32,
    /// Numeric condition (as a fact) that determines the repetitions; [`REFILL`] if the operator
    /// refills a consumed number, `u32::MAX` for neither.
    pub until: u32,
}

/// Sum of two costs, capped below infinity.
fn reached(cost: u32, more: u32) -> u32 {
    cost.saturating_add(more).min(NONE - 1)
}

/// Value of [`Relevant::until`] for an operator that refills a number consumed by the relaxed plan.
pub const REFILL: u32 = u32::MAX - 1;

/// Additive heuristic with its working memory. A node is an operator's unconditional effects, one of
/// its conditional effects, or an axiom.
#[derive(Clone)]
pub struct Relaxed {
    /// Precondition facts of each node.
    preconditions: Lists<u32>,
    effects: Lists<u32>,
    /// Index into `names` of each node's operator; `NONE` for an axiom.
    operators: Vec<u32>,
    names: Vec<u32>,
    base_costs: Vec<u32>,
    open: Vec<u32>,
    /// Nodes that have a fact as precondition, by fact.
    waiting: Lists<u32>,
    /// Nodes without preconditions.
    free: Vec<u32>,
    /// Facts that always hold in the relaxation: derived facts and numeric conditions being false.
    always: Vec<u32>,
    goal: Vec<u32>,
    is_goal: Vec<bool>,
    node_costs: Vec<u32>,
    missing: Vec<u32>,
    fact_costs: Vec<u32>,
    supporters: Vec<u32>,
    heap: RadixHeap,
    marked: Vec<u32>,
    mark: u32,
    stack: Vec<u32>,
    /// Position of each operator in the relaxed plan, by index into `names`.
    slots: Vec<u32>,
    /// Reachable intervals of numbers.
    intervals: Intervals,
    /// Operators of the last relaxed plan, in order of rising cost.
    pub plan: Vec<Relevant>,
    /// Operators of the last relaxed plan that are applicable in the evaluated state.
    pub preferred: Vec<u32>,
    /// Number of facts and nodes visited so far: a deterministic measure of work.
    pub work: u64,
}

impl Relaxed {
    /// Heuristic for the task's goal, with all operators.
    pub fn new(task: &Compiled, counting: Counting) -> Relaxed {
        let all: Vec<u32> = (0..task.operators() as u32).collect();
        let goal = task.goal.iter().map(|&f| task.id(f)).collect();
        Relaxed::with(task, counting, all, goal)
    }

    /// Heuristic for other goal facts, with some of the operators.
    pub(crate) fn with(task: &Compiled, counting: Counting, operators: Vec<u32>, goal: Vec<u32>) -> Relaxed {
        let mut needed = vec![false; task.facts];
        goal.iter().for_each(|&f| needed[f as usize] = true);
        let mut need = |facts: &[GroundFact]| facts.iter().for_each(|&f| needed[task.id(f) as usize] = true);
        for &op in &operators {
            need(task.preconditions.get(op as usize));
            for e in task.effects.get(op as usize) {
                need(&task.conditions[e.from as usize..e.to as usize]);
            }
            task.numbers.changes.get(op as usize).into_iter().flatten().for_each(|c| need(&c.conditions));
        }
        (0..task.axiom_bodies.len()).for_each(|a| need(task.axiom_bodies.get(a)));
        let mut build = Build {
            task,
            goal,
            needed,
            preconditions: Lists::new(),
            effects: Lists::new(),
            changes: Lists::new(),
            operators: Vec::new(),
            base_costs: Vec::new(),
        };
        for (place, &op) in operators.iter().enumerate() {
            build.operator(op as usize, place as u32, counting.of(task, op as usize));
        }
        for (axiom, &head) in task.axiom_heads.iter().enumerate() {
            let body: Vec<u32> = task.axiom_bodies.get(axiom).iter().map(|&f| task.id(f)).collect();
            build.node(body, vec![task.id(head)], Vec::new(), (NONE, 0));
        }
        build.finish(operators)
    }

    /// Estimated cost from a state to the goal; `None` if the goal is unreachable even in the
    /// relaxation. Also sets `plan` and `preferred`.
    pub fn evaluate(&mut self, task: &Compiled, state: &[u32]) -> Option<u32> {
        if !self.explore(task, state) {
            return None;
        }
        Some(self.extract(task, state))
    }

    fn explore(&mut self, task: &Compiled, state: &[u32]) -> bool {
        self.node_costs.copy_from_slice(&self.base_costs);
        self.missing.copy_from_slice(&self.open);
        self.fact_costs.fill(NONE);
        self.heap.clear();
        self.work += (self.missing.len() / 8 + self.fact_costs.len() / 8) as u64;
        for (&offset, &value) in task.offsets.iter().zip(state) {
            self.fact_costs[(offset + value) as usize] = 0;
            self.supporters[(offset + value) as usize] = NONE;
            self.heap.push(0, offset + value);
        }
        for i in 0..self.always.len() {
            let fact = self.always[i];
            if self.fact_costs[fact as usize] != 0 {
                self.fact_costs[fact as usize] = 0;
                self.supporters[fact as usize] = NONE;
                self.heap.push(0, fact);
            }
        }
        self.intervals.start(task, state);
        for i in 0..self.free.len() {
            self.trigger(self.free[i] as usize);
        }
        let mut left = self.goal.len();
        while let Some((cost, fact)) = self.heap.pop() {
            if cost > self.fact_costs[fact as usize] {
                continue;
            }
            if self.is_goal[fact as usize] {
                left -= 1;
                if left == 0 {
                    return true;
                }
            }
            let waiting = &self.waiting.get(fact as usize);
            self.work += waiting.len() as u64 + 1;
            for i in 0..waiting.len() {
                let node = self.waiting.get(fact as usize)[i] as usize;
                self.missing[node] -= 1;
                self.node_costs[node] = reached(self.node_costs[node], cost);
                if self.missing[node] == 0 {
                    self.trigger(node);
                }
            }
        }
        left == 0
    }

    #[inline]
    fn trigger(&mut self, node: usize) {
        let cost = self.node_costs[node];
        for &fact in self.effects.get(node) {
            if cost < self.fact_costs[fact as usize] {
                self.fact_costs[fact as usize] = cost;
                self.supporters[fact as usize] = node as u32;
                self.heap.push(cost, fact);
            }
        }
        if !self.intervals.is_empty() {
            self.move_numbers(node);
        }
    }

    /// Applies a node's numeric changes, then those of triggered nodes whose amounts depend on changed
    /// numbers.
    fn move_numbers(&mut self, node: usize) {
        let now = self.node_costs[node];
        let mut waiting = vec![node as u32];
        while let Some(node) = waiting.pop() {
            let at = self.node_costs[node as usize].max(now);
            let missing = &self.missing;
            self.intervals.fire(node, &|n| missing[n as usize] == 0, &mut waiting);
            self.work += self.intervals.found.len() as u64 + 1;
            for i in 0..self.intervals.found.len() {
                let (fact, times) = self.intervals.found[i];
                let more = self.base_costs[node as usize].saturating_mul(times - 1);
                let cost = reached(at, more);
                if cost < self.fact_costs[fact as usize] {
                    self.fact_costs[fact as usize] = cost;
                    self.supporters[fact as usize] = node;
                    self.intervals.support(fact, times);
                    self.heap.push(cost, fact);
                }
            }
        }
    }

    fn extract(&mut self, task: &Compiled, state: &[u32]) -> u32 {
        self.plan.clear();
        self.preferred.clear();
        self.mark += 1;
        self.stack.clear();
        self.stack.extend_from_slice(&self.goal);
        let mut total = 0u32;
        self.follow_back(&mut total);
        if !self.intervals.is_empty() {
            self.refill(task, state, &mut total);
        }
        self.plan.sort_unstable();
        self.preferred.retain(|&operator| task.applicable(operator, state));
        self.preferred.sort_unstable();
        total
    }

    /// Adds operators that refill numbers of which the relaxed plan consumes more than there is.
    fn refill(&mut self, task: &Compiled, state: &[u32], total: &mut u32) {
        for (number, missing) in self.intervals.shortages(task, state, &self.plan) {
            let givers = self.intervals.givers(number).iter();
            let open = givers.filter(|giver| self.missing[giver.0 as usize] == 0);
            let Some(&(node, gain)) = open.min_by_key(|giver| (self.node_costs[giver.0 as usize], giver.0))
            else {
                continue;
            };
            let times = (missing / gain).ceil().clamp(1.0, MOST_REFILLS) as u32;
            let times = times + self.known(node).map_or(0, |known| known.times);
            self.take(node, (times, REFILL), total);
            self.follow_back(total);
        }
    }

    /// Adds the supporters of all facts on the stack, and of their preconditions, to the relaxed plan.
    fn follow_back(&mut self, total: &mut u32) {
        while let Some(fact) = self.stack.pop() {
            if self.marked[fact as usize] == self.mark || self.supporters[fact as usize] == NONE {
                continue;
            }
            self.marked[fact as usize] = self.mark;
            let node = self.supporters[fact as usize];
            match self.intervals.repeats(fact) {
                None => self.take(node, (1, NONE), total),
                Some(times) => {
                    self.take(node, (times, fact), total);
                    let mut movers = std::mem::take(&mut self.intervals.movers);
                    self.intervals.collect_movers(fact, &mut movers);
                    self.intervals.collect_levers(fact, node, &mut movers);
                    movers.drain(..).for_each(|mover| self.take(mover, (1, NONE), total));
                    self.intervals.movers = movers;
                }
            }
        }
    }

    /// Entry of a node's operator in the relaxed plan; `None` if the plan does not contain it.
    fn known(&self, node: u32) -> Option<&Relevant> {
        let place = self.operators[node as usize] as usize;
        let marked = self.marked.get(self.fact_costs.len() + place)? == &self.mark;
        marked.then(|| &self.plan[self.slots[place] as usize])
    }

    /// Adds a node's operator to the relaxed plan, to be applied `times` times for the condition
    /// `until`, and puts the node's preconditions on the stack.
    fn take(&mut self, node: u32, (times, until): (u32, u32), total: &mut u32) {
        let preconditions = self.preconditions.get(node as usize);
        self.stack.extend_from_slice(preconditions);
        let place = self.operators[node as usize];
        if place == NONE {
            return;
        }
        let base = self.base_costs[node as usize];
        let mark = self.fact_costs.len() + place as usize;
        if self.marked[mark] != self.mark {
            self.marked[mark] = self.mark;
            self.slots[place as usize] = self.plan.len() as u32;
            let (at, operator) = (self.node_costs[node as usize], self.names[place as usize]);
            self.plan.push(Relevant { at, operator, times, until });
            if at == base {
                self.preferred.push(operator);
            }
            *total = total.saturating_add(base.saturating_mul(times));
            return;
        }
        let known = &mut self.plan[self.slots[place as usize] as usize];
        if times > known.times {
            *total = total.saturating_add(base.saturating_mul(times - known.times));
            (known.times, known.until) = (times, until);
        }
    }

    /// Approximate memory of the heuristic, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.base_costs.len() * 40 + self.fact_costs.len() * 24
    }
}

/// Builder that collects the nodes of the heuristic.
struct Build<'a> {
    task: &'a Compiled,
    goal: Vec<u32>,
    needed: Vec<bool>,
    preconditions: Lists<u32>,
    effects: Lists<u32>,
    /// Numeric effects of each node.
    changes: Lists<NumberChange>,
    operators: Vec<u32>,
    base_costs: Vec<u32>,
}

impl Build<'_> {
    fn node(
        &mut self,
        mut preconditions: Vec<u32>,
        effects: Vec<u32>,
        changes: Vec<NumberChange>,
        (operator, cost): (u32, u32),
    ) {
        let effects: Vec<u32> =
            effects.into_iter().filter(|&f| self.needed[f as usize] && !preconditions.contains(&f)).collect();
        if effects.is_empty() && changes.is_empty() {
            return;
        }
        self.changes.push(changes);
        preconditions.sort_unstable();
        preconditions.dedup();
        self.preconditions.push(preconditions);
        self.effects.push(effects);
        self.operators.push(operator);
        self.base_costs.push(cost);
    }

    fn operator(&mut self, op: usize, place: u32, cost: u32) {
        let task = self.task;
        let own: Vec<u32> = task.preconditions.get(op).iter().map(|&f| task.id(f)).collect();
        let mut plain = Vec::new();
        for effect in task.effects.get(op) {
            if effect.from == effect.to {
                plain.push(task.id(effect.fact));
                continue;
            }
            let mut needs = own.clone();
            let conditions = &task.conditions[effect.from as usize..effect.to as usize];
            needs.extend(conditions.iter().map(|&f| task.id(f)));
            self.node(needs, vec![task.id(effect.fact)], Vec::new(), (place, cost));
        }
        let mut changes = task.numbers.changes.get(op).cloned().unwrap_or_default();
        for change in changes.extract_if(.., |change| !change.conditions.is_empty()) {
            let needs = own.iter().copied().chain(change.conditions.iter().map(|&f| task.id(f))).collect();
            self.node(needs, Vec::new(), vec![change], (place, cost));
        }
        self.node(own, plain, changes, (place, cost));
    }

    fn finish(self, names: Vec<u32>) -> Relaxed {
        let task = self.task;
        let nodes = self.operators.len();
        let lists = &self.preconditions;
        let pairs = (0..nodes).flat_map(|n| lists.get(n).iter().map(move |&f| (f, n as u32)));
        let waiting = Lists::group(task.facts, pairs);
        let open: Vec<u32> = (0..nodes).map(|n| self.preconditions.get(n).len() as u32).collect();
        let always = (task.basic..task.domains.len()).map(|v| task.offsets[v] + 1).collect();
        let goal = self.goal;
        let mut is_goal = vec![false; task.facts];
        goal.iter().for_each(|&f| is_goal[f as usize] = true);
        let intervals = Intervals::new(task, &self.needed, self.changes);
        Relaxed {
            intervals,
            slots: vec![0; names.len()],
            free: (0..nodes as u32).filter(|&n| open[n as usize] == 0).collect(),
            node_costs: vec![0; nodes],
            missing: vec![0; nodes],
            fact_costs: vec![NONE; task.facts],
            supporters: vec![NONE; task.facts],
            heap: RadixHeap::new(),
            marked: vec![0; task.facts + names.len()],
            names,
            mark: 0,
            stack: Vec::new(),
            plan: Vec::new(),
            preferred: Vec::new(),
            work: 0,
            preconditions: self.preconditions,
            effects: self.effects,
            operators: self.operators,
            base_costs: self.base_costs,
            open,
            waiting,
            always,
            goal,
            is_goal,
        }
    }
}
