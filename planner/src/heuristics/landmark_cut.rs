//! LM-cut, an admissible heuristic: it sums the costs of action landmarks, which are cuts in
//! justification graphs of h_max (Helmert and Domshlak 2009).
//!
//! Conditional effects become operators of their own that share one cost (Röger, Pommerening and
//! Helmert 2014), axioms cost nothing, and derived facts may always be false. A numeric condition that
//! does not hold costs at least one change of a number that it reads.

use crate::classical::compiled::{Compiled, Lists};
use crate::classical::numbers::NumberChange;
use crate::ground::{GroundFact, Relation};

use super::queue::RadixHeap;

/// Value that stands for no fact, no operator or infinite cost.
const NONE: u32 = u32::MAX;

/// Node of the relaxed task: an operator's unconditional effects, one of its conditional effects, or an
/// axiom.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Number of preconditions not yet reached.
    open: u32,
    /// Precondition with the greatest h_max; `NONE` until all preconditions are reached.
    supporter: u32,
    /// h_max value of the supporter.
    supported: u32,
    /// Part of the operator's cost that no landmark has used yet.
    left: u32,
}

/// LM-cut heuristic with its working memory; nodes are relaxed operators.
pub struct LandmarkCut {
    preconditions: Lists<u32>,
    effects: Lists<u32>,
    /// Operator of each node; `NONE` for an axiom.
    operators: Vec<u32>,
    /// Nodes that belong to each operator.
    parts: Lists<u32>,
    /// Nodes that have a fact as precondition, by fact.
    waiting: Lists<u32>,
    /// Nodes that have a fact as effect, by fact.
    achievers: Lists<u32>,
    /// Facts that hold in every relaxed state: absent derived facts, and the precondition of nodes that
    /// have no other.
    always: Vec<u32>,
    /// Artificial fact that stands for all goals together.
    goal: u32,
    /// State of all nodes at the beginning of an evaluation.
    fresh: Vec<Node>,
    nodes: Vec<Node>,
    /// h_max value of each fact.
    costs: Vec<u32>,
    heap: RadixHeap,
    /// Zone of each fact in the justification graph; every cut numbers its zones anew, so that zones of
    /// earlier cuts are void.
    zones: Vec<u32>,
    stamp: u32,
    stack: Vec<u32>,
    /// Operators in the current cut.
    cut: Vec<u32>,
}

impl LandmarkCut {
    /// Heuristic of a task, in the operator costs of the search.
    pub fn new(task: &Compiled) -> LandmarkCut {
        let mut build = Build::new(task);
        (0..task.operators()).for_each(|operator| build.operator(operator));
        for (axiom, &head) in task.axiom_heads.iter().enumerate() {
            build.node(task.axiom_bodies.get(axiom), vec![task.id(head)], NONE);
        }
        build.finish()
    }

    /// Lower bound on the cost of every plan from a state; `None` if the goal is unreachable even in
    /// the relaxation. Once `stop` returns true, the bound reached so far is returned.
    pub fn evaluate(&mut self, task: &Compiled, state: &[u32], stop: &dyn Fn() -> bool) -> Option<u32> {
        let values = task.offsets.iter().zip(state).map(|(&offset, &value)| offset + value);
        let initial: Vec<u32> = values.chain(self.always.iter().copied()).collect();
        self.explore(&initial);
        if self.costs[self.goal as usize] == NONE {
            return None;
        }
        self.zones.fill(0);
        self.stamp = 0;
        let mut total = 0u32;
        while self.costs[self.goal as usize] > 0 && !stop() {
            let cost = self.find_cut(&initial);
            total = sum(total, cost);
            for place in 0..self.cut.len() {
                for &node in self.parts.get(self.cut[place] as usize) {
                    self.nodes[node as usize].left -= cost;
                }
            }
            self.lower();
        }
        Some(total)
    }

    /// Computes the h_max value of every fact.
    fn explore(&mut self, initial: &[u32]) {
        self.nodes.copy_from_slice(&self.fresh);
        self.costs.fill(NONE);
        self.heap.clear();
        initial.iter().for_each(|&fact| reach(&mut self.costs, &mut self.heap, fact, 0));
        while let Some((cost, fact)) = self.heap.pop() {
            if cost > self.costs[fact as usize] {
                continue;
            }
            for &node in self.waiting.get(fact as usize) {
                let own = &mut self.nodes[node as usize];
                own.open -= 1;
                if own.open == 0 {
                    (own.supporter, own.supported) = (fact, cost);
                    let cost = sum(cost, own.left);
                    let effects = self.effects.get(node as usize);
                    effects.iter().for_each(|&effect| reach(&mut self.costs, &mut self.heap, effect, cost));
                }
            }
        }
    }

    /// Updates h_max values after the costs of the operators in the cut have fallen.
    fn lower(&mut self) {
        self.heap.clear();
        for place in 0..self.cut.len() {
            for &node in self.parts.get(self.cut[place] as usize) {
                let own = self.nodes[node as usize];
                if own.supporter != NONE {
                    let cost = sum(own.supported, own.left);
                    let effects = self.effects.get(node as usize);
                    effects.iter().for_each(|&effect| reach(&mut self.costs, &mut self.heap, effect, cost));
                }
            }
        }
        while let Some((cost, fact)) = self.heap.pop() {
            if cost > self.costs[fact as usize] {
                continue;
            }
            for &node in self.waiting.get(fact as usize) {
                let own = &mut self.nodes[node as usize];
                if own.supporter != fact || own.supported <= cost {
                    continue;
                }
                let preconditions = self.preconditions.get(node as usize).iter();
                // A supporter stays one among equals: landmarks found from it before stay good ones.
                let key = |&other: &u32| (self.costs[other as usize], other == fact, other);
                let (supported, _, supporter) = preconditions.map(key).max().unwrap_or((cost, true, fact));
                let falls = supported < own.supported;
                (own.supported, own.supporter) = (supported, supporter);
                if falls {
                    let cost = sum(supported, own.left);
                    let effects = self.effects.get(node as usize);
                    effects.iter().for_each(|&effect| reach(&mut self.costs, &mut self.heap, effect, cost));
                }
            }
        }
    }

    /// Collects the operators that lead into the goal's zero-cost zone in `cut`; returns their minimum
    /// cost.
    fn find_cut(&mut self, initial: &[u32]) -> u32 {
        let (before, beyond) = (self.stamp + 1, self.stamp + 2);
        self.stamp = beyond;
        self.zones[self.goal as usize] = beyond;
        self.stack.push(self.goal);
        while let Some(fact) = self.stack.pop() {
            for &node in self.achievers.get(fact as usize) {
                let Node { supporter, left, .. } = self.nodes[node as usize];
                if left == 0 && supporter != NONE && self.zones[supporter as usize] != beyond {
                    self.zones[supporter as usize] = beyond;
                    self.stack.push(supporter);
                }
            }
        }
        self.cut.clear();
        let mut least = NONE;
        initial.iter().for_each(|&fact| self.zones[fact as usize] = before);
        self.stack.extend_from_slice(initial);
        while let Some(fact) = self.stack.pop() {
            for &node in self.waiting.get(fact as usize) {
                let Node { supporter, left, .. } = self.nodes[node as usize];
                if supporter != fact {
                    continue;
                }
                let effects = self.effects.get(node as usize);
                if effects.iter().any(|&effect| self.zones[effect as usize] == beyond) {
                    self.cut.push(self.operators[node as usize]);
                    least = least.min(left);
                    continue;
                }
                for &effect in effects {
                    if self.zones[effect as usize] != before {
                        self.zones[effect as usize] = before;
                        self.stack.push(effect);
                    }
                }
            }
        }
        self.cut.sort_unstable();
        self.cut.dedup();
        least
    }

    /// Approximate memory of the heuristic, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let lists = [&self.preconditions, &self.effects, &self.parts, &self.waiting, &self.achievers];
        let items: usize = lists.iter().map(|list| list.all().len() + list.len()).sum();
        4 * items + 2 * size_of_val(&self.nodes[..]) + 3 * size_of_val(&self.costs[..])
    }
}

/// Sum of two costs, capped below infinity.
fn sum(one: u32, other: u32) -> u32 {
    one.saturating_add(other).min(NONE - 1)
}

/// Lowers the cost of a fact and queues the fact, if `cost` is below its present cost.
#[inline]
fn reach(costs: &mut [u32], heap: &mut RadixHeap, fact: u32, cost: u32) {
    if cost < costs[fact as usize] {
        costs[fact as usize] = cost;
        heap.push(cost, fact);
    }
}

/// Facts of a comparison (it holds, it does not hold) that an operator may make true; a constant change
/// excludes the fact that lies the other way.
fn turned(task: &Compiled, operator: usize, comparison: usize) -> impl Iterator<Item = u32> {
    let (numbers, changes) = (&task.numbers, &task.numbers.changes[operator]);
    // Anything but adding may also give a value to what had none.
    let adds = |change: &NumberChange| change.conditions.is_empty() && change.constant_gain().is_some();
    let read = |change: &&NumberChange| numbers.reads[comparison].contains(&change.number);
    let gain = match changes.iter().filter(read).all(adds) {
        true => numbers.gain(comparison as u32, changes),
        false => f64::NAN,
    };
    let towards = match numbers.comparisons[comparison].relation {
        Relation::AtLeast | Relation::Greater => gain,
        Relation::AtMost | Relation::Less => -gain,
        Relation::Equal | Relation::Unequal => f64::NAN,
    };
    let holds = task.offsets[numbers.first + comparison];
    let facts = [(holds, towards > 0.0 || towards.is_nan()), (holds + 1, towards < 0.0 || towards.is_nan())];
    facts.into_iter().filter(|(_, is_turned)| *is_turned).map(|(fact, _)| fact)
}

/// Builder that collects the nodes of the heuristic.
struct Build<'a> {
    task: &'a Compiled,
    /// True, by fact, if some precondition, condition, axiom or goal contains the fact.
    needed: Vec<bool>,
    preconditions: Lists<u32>,
    effects: Lists<u32>,
    operators: Vec<u32>,
}

impl<'a> Build<'a> {
    fn new(task: &'a Compiled) -> Build<'a> {
        let mut needed = vec![false; task.facts];
        let changes = task.numbers.changes.iter().flatten().flat_map(|change| &change.conditions);
        let own = task.preconditions.all().iter().chain(&task.conditions).chain(changes);
        let facts = own.chain(task.axiom_bodies.all()).chain(&task.goal);
        facts.for_each(|&fact| needed[task.id(fact) as usize] = true);
        Build { task, needed, preconditions: Lists::new(), effects: Lists::new(), operators: Vec::new() }
    }

    /// Adds a node, unless no condition needs any of its effects.
    fn node(&mut self, preconditions: &[GroundFact], mut effects: Vec<u32>, operator: u32) {
        let mut preconditions: Vec<u32> = preconditions.iter().map(|&fact| self.task.id(fact)).collect();
        preconditions.sort_unstable();
        preconditions.dedup();
        effects.retain(|effect| self.needed[*effect as usize] && !preconditions.contains(effect));
        if effects.is_empty() {
            return;
        }
        effects.sort_unstable();
        effects.dedup();
        if preconditions.is_empty() {
            preconditions.push(self.task.facts as u32);
        }
        self.preconditions.push(preconditions);
        self.effects.push(effects);
        self.operators.push(operator);
    }

    fn operator(&mut self, operator: usize) {
        let task = self.task;
        let own = task.preconditions.get(operator);
        let mut plain = Vec::new();
        let with = |conditions: &[GroundFact]| [own, conditions].concat();
        for effect in task.effects.get(operator) {
            match &task.conditions[effect.from as usize..effect.to as usize] {
                [] => plain.push(task.id(effect.fact)),
                conditions => self.node(&with(conditions), vec![task.id(effect.fact)], operator as u32),
            }
        }
        for change in task.numbers.changes.get(operator).into_iter().flatten() {
            let read_by = task.numbers.read_by.get(change.number as usize).iter();
            let facts = read_by.flat_map(|&comparison| turned(task, operator, comparison as usize));
            match &change.conditions[..] {
                [] => plain.extend(facts),
                conditions => self.node(&with(conditions), facts.collect(), operator as u32),
            }
        }
        self.node(own, plain, operator as u32);
    }

    fn finish(mut self) -> LandmarkCut {
        let task = self.task;
        let (free, goal) = (task.facts as u32, task.facts as u32 + 1);
        let goals: Vec<u32> = task.goal.iter().map(|&fact| task.id(fact)).chain([free]).collect();
        self.preconditions.push(goals);
        self.effects.push([goal]);
        self.operators.push(NONE);
        let count = self.operators.len();
        let by_fact = |lists: &Lists<u32>| {
            let pairs = (0..count).flat_map(|node| lists.get(node).iter().map(move |&f| (f, node as u32)));
            Lists::group(task.facts + 2, pairs)
        };
        let own = (0..count as u32).map(|node| (self.operators[node as usize], node));
        let parts = Lists::group(task.operators(), own.filter(|&(operator, _)| operator != NONE));
        let fresh = (0..count).map(|node| Node {
            open: self.preconditions.get(node).len() as u32,
            supporter: NONE,
            supported: NONE,
            left: task.costs.get(self.operators[node] as usize).copied().unwrap_or(0),
        });
        let fresh: Vec<Node> = fresh.collect();
        let absences = (task.basic..task.numbers.first).map(|variable| task.offsets[variable] + 1);
        LandmarkCut {
            parts,
            waiting: by_fact(&self.preconditions),
            achievers: by_fact(&self.effects),
            always: absences.chain([free]).collect(),
            goal,
            nodes: fresh.clone(),
            fresh,
            costs: vec![NONE; task.facts + 2],
            zones: vec![0; task.facts + 2],
            heap: RadixHeap::new(),
            stamp: 0,
            stack: Vec::new(),
            cut: Vec::new(),
            preconditions: self.preconditions,
            effects: self.effects,
            operators: self.operators,
        }
    }
}
