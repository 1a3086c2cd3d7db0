//! The additive heuristic and the relaxed plan that its best supporters make (h_FF with h_add supporters;
//! Bonet and Geffner 2001, Keyder and Geffner 2008).

use crate::ground::Fact;
use crate::search::compiled::{Compiled, Lists};

use super::queue::RadixHeap;

/// No node, no operator, no cost.
const NONE: u32 = u32::MAX;

/// How many steps weigh as much as a unit of cost where operators without cost exist.
const COST_OVER_STEPS: u32 = 64;

/// How the heuristic counts operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Counting {
    /// Every operator counts one.
    Steps,
    /// Cost, plus one unless all costs are one.
    CostAndSteps,
    /// Cost first; steps only where operators without cost would make plans longer for nothing.
    CostThenSteps,
}

impl Counting {
    /// What an operator of this cost counts.
    pub(crate) fn of(self, task: &Compiled, operator: usize) -> u32 {
        match self {
            Counting::Steps => 1,
            Counting::CostAndSteps if task.unit_cost => 1,
            Counting::CostAndSteps => task.costs[operator] + 1,
            Counting::CostThenSteps if task.free_operators => {
                task.costs[operator].saturating_mul(COST_OVER_STEPS).saturating_add(1)
            }
            Counting::CostThenSteps => task.costs[operator],
        }
    }
}

/// An operator in a relaxed plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Relevant {
    /// The estimated cost at which it can be applied and has been.
    pub at: u32,
    /// The operator.
    pub operator: u32,
}

/// The heuristic with its working memory.
#[derive(Clone)]
pub(crate) struct Relaxed {
    /// By node (an operator's unconditional effects, one conditional effect, or an axiom).
    preconditions: Lists<u32>,
    effects: Lists<u32>,
    /// By node: place of its operator in `names`; `NONE` for an axiom.
    operators: Vec<u32>,
    names: Vec<u32>,
    base_costs: Vec<u32>,
    open: Vec<u32>,
    /// By fact: nodes that need it.
    waiting: Lists<u32>,
    /// Nodes that need nothing.
    free: Vec<u32>,
    /// Facts that hold always in the relaxation: absences of derived facts.
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
    /// Operators of the last relaxed plan, by rising cost.
    pub plan: Vec<Relevant>,
    /// Those of them that can be applied right away.
    pub preferred: Vec<u32>,
    /// Facts and nodes touched since the beginning: a measure of work that no clock is part of.
    pub work: u64,
}

impl Relaxed {
    /// For a task, counting operators in this way, towards the task's goal.
    pub(crate) fn new(task: &Compiled, counting: Counting) -> Relaxed {
        let all: Vec<u32> = (0..task.operators() as u32).collect();
        let goal = task.goal.iter().map(|&f| task.id(f)).collect();
        Relaxed::with(task, counting, all, goal)
    }

    /// With these operators only, towards these facts.
    pub(crate) fn with(task: &Compiled, counting: Counting, operators: Vec<u32>, goal: Vec<u32>) -> Relaxed {
        let mut needed = vec![false; task.facts];
        goal.iter().for_each(|&f| needed[f as usize] = true);
        let mut need = |facts: &[Fact]| facts.iter().for_each(|&f| needed[task.id(f) as usize] = true);
        for &op in &operators {
            need(task.preconditions.get(op as usize));
            for e in task.effects.get(op as usize) {
                need(&task.conditions[e.from as usize..e.to as usize]);
            }
        }
        (0..task.axiom_bodies.len()).for_each(|a| need(task.axiom_bodies.get(a)));
        let mut build = Build {
            task,
            goal,
            needed,
            preconditions: Lists::new(),
            effects: Lists::new(),
            operators: Vec::new(),
            base_costs: Vec::new(),
        };
        for (place, &op) in operators.iter().enumerate() {
            build.operator(op as usize, place as u32, counting.of(task, op as usize));
        }
        for (axiom, &head) in task.axiom_heads.iter().enumerate() {
            let body: Vec<u32> = task.axiom_bodies.get(axiom).iter().map(|&f| task.id(f)).collect();
            build.node(body, vec![task.id(head)], NONE, 0);
        }
        build.finish(operators)
    }

    /// The estimate from a state, or `None` if the goal is out of reach even relaxed. Leaves the relaxed plan and the
    /// preferred operators.
    pub(crate) fn evaluate(&mut self, task: &Compiled, state: &[u32]) -> Option<u32> {
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
                self.node_costs[node] = self.node_costs[node].saturating_add(cost);
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
    }

    fn extract(&mut self, task: &Compiled, state: &[u32]) -> u32 {
        self.plan.clear();
        self.preferred.clear();
        self.mark += 1;
        let facts = self.fact_costs.len();
        self.stack.clear();
        self.stack.extend_from_slice(&self.goal);
        let mut total = 0u32;
        while let Some(fact) = self.stack.pop() {
            if self.marked[fact as usize] == self.mark || self.supporters[fact as usize] == NONE {
                continue;
            }
            self.marked[fact as usize] = self.mark;
            let node = self.supporters[fact as usize] as usize;
            let preconditions = self.preconditions.get(node);
            self.stack.extend_from_slice(preconditions);
            let place = self.operators[node];
            if place == NONE {
                continue;
            }
            let operator = self.names[place as usize];
            let place = facts + place as usize;
            if self.marked[place] != self.mark {
                self.marked[place] = self.mark;
                total = total.saturating_add(self.base_costs[node]);
                self.plan.push(Relevant { at: self.node_costs[node], operator });
                if self.node_costs[node] == self.base_costs[node] && task.applicable(operator, state) {
                    self.preferred.push(operator);
                }
            }
        }
        self.plan.sort_unstable();
        self.preferred.sort_unstable();
        total
    }

    /// Bytes taken.
    pub(crate) fn bytes(&self) -> usize {
        self.base_costs.len() * 40 + self.fact_costs.len() * 24
    }
}

/// Collects the nodes.
struct Build<'a> {
    task: &'a Compiled,
    goal: Vec<u32>,
    needed: Vec<bool>,
    preconditions: Lists<u32>,
    effects: Lists<u32>,
    operators: Vec<u32>,
    base_costs: Vec<u32>,
}

impl Build<'_> {
    fn node(&mut self, mut preconditions: Vec<u32>, effects: Vec<u32>, operator: u32, cost: u32) {
        let effects: Vec<u32> =
            effects.into_iter().filter(|&f| self.needed[f as usize] && !preconditions.contains(&f)).collect();
        if effects.is_empty() {
            return;
        }
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
            self.node(needs, vec![task.id(effect.fact)], place, cost);
        }
        self.node(own, plain, place, cost);
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
        Relaxed {
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
