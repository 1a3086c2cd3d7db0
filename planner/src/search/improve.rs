//! Plan improvement: action elimination, reordering of blocks, and replanning of windows of steps (in
//! the spirit of Nakhost and Müller 2010 and of Siddiqui and Haslum 2015).

mod undo;

use std::collections::BinaryHeap;

use crate::classical::compiled::{Compiled, Lists};
use crate::classical::successor::Successors;
use crate::heuristics::relaxed::{Counting, Relaxed};

use crate::technique::{Technique, Without};

use super::lookahead::Lookahead;
use super::store::{NO_STATE, Store};

/// Number of steps in the smallest windows.
const SMALLEST_WINDOW: usize = 4;
/// Number of states evaluated for a window in the first round.
const FIRST_EVALUATIONS: u32 = 12;
/// Share of the heuristic estimate that counts when a state is compared with the budget, in per cent.
const TRUST_PERCENT: u64 = 80;

/// Plan improver for a task.
pub struct Improve<'a> {
    task: &'a Compiled,
    successors: &'a Successors,
    stop: &'a (dyn Fn() -> bool + Sync),
    /// Operators that write a variable, by variable.
    writers: Lists<u32>,
    /// True, by variable, if the window being replanned writes the variable.
    touched: Vec<bool>,
    lookahead: Lookahead,
    store: Store,
    /// Cost of each operator, by [`Counting::CostThenSteps`].
    costs: Vec<u32>,
    queue: BinaryHeap<std::cmp::Reverse<(u64, u32, u32, u32)>>,
    state: Vec<u32>,
    next: Vec<u32>,
    applicable: Vec<u32>,
    /// Number of states evaluated so far.
    pub evaluated: u64,
    /// Maximum number of states to evaluate.
    pub evaluation_limit: u64,
    /// Work done so far (see [`Relaxed::work`]).
    work: u64,
    work_limit: u64,
    /// Techniques that are left out.
    pub without: Without,
}

impl<'a> Improve<'a> {
    /// Plan improver for a task that ends early once `stop` returns true.
    pub fn new(
        task: &'a Compiled,
        successors: &'a Successors,
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> Improve<'a> {
        let counting = Counting::CostThenSteps;
        Improve {
            task,
            successors,
            stop,
            writers: Lists::group(task.domains.len() + task.numbers.len(), writes(task)),
            touched: vec![false; task.domains.len() + task.numbers.len()],
            lookahead: Lookahead::new(task),
            store: Store::new(task),
            costs: (0..task.operators()).map(|op| counting.of(task, op)).collect(),
            queue: BinaryHeap::new(),
            state: Vec::new(),
            next: Vec::new(),
            applicable: Vec::new(),
            evaluated: 0,
            evaluation_limit: u64::MAX,
            work: 0,
            work_limit: 0,
            without: Without::default(),
        }
    }

    /// Cost of a plan, by [`Counting::CostThenSteps`].
    pub(crate) fn cost(&self, plan: &[u32]) -> u64 {
        plan.iter().map(|&op| u64::from(self.costs[op as usize])).sum()
    }

    /// Work done so far (see [`Relaxed::work`]).
    pub(crate) fn work(&self) -> u64 {
        self.work
    }

    /// Improves a plan in place until no window gets better or the limits are reached; `on_better` gets
    /// every better plan. True if it ended because nothing got better.
    pub fn run(&mut self, plan: &mut Vec<u32>, work: u64, on_better: &mut dyn FnMut(&[u32])) -> bool {
        self.work_limit = self.work().saturating_add(work);
        let mut best = self.cost(plan);
        let mut tell = |this: &Self, plan: &[u32]| {
            let cost = this.cost(plan);
            if cost < best {
                best = cost;
                on_better(plan);
            }
        };
        self.eliminate(plan);
        self.undo(plan);
        tell(self, plan);
        let mut evaluations = FIRST_EVALUATIONS;
        let mut idle = 0;
        let mut round = 0usize;
        while idle < 6 && !self.over() {
            let before = self.cost(plan);
            if self.task.axiom_heads.is_empty() && self.without.uses(Technique::BlockReordering) {
                self.rearrange(plan, round);
            }
            let mut size = SMALLEST_WINDOW << (round % 2);
            while self.without.uses(Technique::Windows) && size < plan.len() * 2 && !self.over() {
                self.windows(plan, size, evaluations, round % 3 == 2);
                tell(self, plan);
                size *= 2;
            }
            self.eliminate(plan);
            if self.cost(plan) < before {
                self.undo(plan);
            }
            tell(self, plan);
            let better = self.cost(plan) < before;
            idle = if better { 0 } else { idle + 1 };
            if !better {
                evaluations = evaluations.saturating_mul(2);
            }
            round += 1;
        }
        !self.over()
    }

    fn over(&self) -> bool {
        self.work() > self.work_limit || self.evaluated >= self.evaluation_limit || (self.stop)()
    }

    /// Action elimination: removes a step, with all later ones that are then inapplicable, if the goal
    /// is still reached.
    fn eliminate(&mut self, plan: &mut Vec<u32>) {
        if !self.without.uses(Technique::Elimination) {
            return;
        }
        let task = self.task;
        let mut state = task.initial.clone();
        let mut i = 0;
        // Without the next of equal steps in a row, the plan is the same as without the one before.
        let mut tried = None;
        while i < plan.len() && !self.over() {
            if tried == Some(plan[i]) {
                task.advance(plan[i], &mut state);
                i += 1;
                continue;
            }
            self.next.clear();
            self.next.extend_from_slice(&state);
            let mut kept = Vec::with_capacity(plan.len());
            let mut saved = u64::from(self.costs[plan[i] as usize]);
            for &operator in &plan[i + 1..] {
                if task.applicable(operator, &self.next) {
                    task.advance(operator, &mut self.next);
                    kept.push(operator);
                } else {
                    saved += u64::from(self.costs[operator as usize]);
                }
            }
            self.work += (plan.len() - i) as u64 * 2 + state.len() as u64 / 4;
            if task.is_goal(&self.next) && saved > 0 {
                plan.truncate(i);
                plan.extend(kept);
            } else {
                tried = Some(plan[i]);
                task.advance(plan[i], &mut state);
                i += 1;
            }
        }
    }

    /// Reorders a plan so that dependent steps are next to each other; interfering steps keep their
    /// order, so the plan's effect is the same.
    fn rearrange(&mut self, plan: &mut Vec<u32>, round: usize) {
        let reverse = round % 2 == 1;
        let (mut after, mut waits) = dependencies(self.task, plan);
        if reverse {
            let mut before = vec![Vec::new(); plan.len()];
            waits = vec![0; plan.len()];
            for (i, list) in after.iter().enumerate() {
                for &j in list {
                    before[j as usize].push(i as u32);
                }
                waits[i] = list.len() as u32;
            }
            after = before;
        }
        self.work += plan.len() as u64 * 8;
        let mut ready: Vec<u32> = (0..plan.len() as u32).filter(|&i| waits[i as usize] == 0).collect();
        if !reverse {
            ready.reverse();
        }
        let mut order = Vec::with_capacity(plan.len());
        while let Some(i) = ready.pop() {
            order.push(plan[i as usize]);
            let mut freed: Vec<u32> = Vec::new();
            for &j in &after[i as usize] {
                waits[j as usize] -= 1;
                if waits[j as usize] == 0 {
                    freed.push(j);
                }
            }
            freed.sort_unstable();
            if !reverse {
                freed.reverse();
            }
            ready.extend(freed);
        }
        if reverse {
            order.reverse();
        }
        *plan = order;
    }

    /// Replans every window of `size` steps; consecutive windows overlap by half.
    fn windows(&mut self, plan: &mut Vec<u32>, size: usize, evaluations: u32, all: bool) {
        let task = self.task;
        let mut needs = Needs::new(task, plan);
        let mut state = task.initial.clone();
        let mut at = 0;
        let mut start = 0;
        while start + 1 < plan.len() && !self.over() {
            while at < start {
                task.advance(plan[at], &mut state);
                at += 1;
            }
            let end = (start + size).min(plan.len());
            let goal = needs.at(task, plan, end);
            let better = self.replan(&state, &goal, &plan[start..end], evaluations, all);
            if let Some(better) = better.filter(|better| self.fits(&state, better, &plan[end..])) {
                plan.splice(start..end, better);
                needs = Needs::new(task, plan);
                continue;
            }
            start += (size / 2).max(1);
        }
    }

    /// True if a replanned window and the rest of the plan still reach the goal. Always true for tasks
    /// without numbers: the window's goal does not contain numeric conditions.
    fn fits(&mut self, from: &[u32], window: &[u32], rest: &[u32]) -> bool {
        let task = self.task;
        if !task.some_impossible() {
            return true;
        }
        self.work += (window.len() + rest.len()) as u64 * 4;
        let mut state = from.to_vec();
        let works = window.iter().chain(rest).all(|&operator| {
            let applicable = task.applicable(operator, &state);
            task.advance(operator, &mut state);
            applicable
        });
        works && task.is_goal(&state)
    }

    /// Plan from a state to goal facts that is cheaper than the steps of `window`; `None` if a short
    /// search finds none.
    fn replan(
        &mut self,
        from: &[u32],
        goal: &[u32],
        window: &[u32],
        evaluations: u32,
        all: bool,
    ) -> Option<Vec<u32>> {
        let task = self.task;
        let budget = self.cost(window);
        let mut relaxed = self.restricted(window, goal);
        self.store.clear();
        self.queue.clear();
        self.state.clear();
        self.state.extend_from_slice(from);
        let (first, _) = self.store.insert(from, NO_STATE, 0, 0);
        let mut best: Option<(u64, Vec<u32>)> = None;
        let mut left = evaluations;
        let mut pending = Some(first);
        let mut sequence = 0u32;
        loop {
            let id = match pending.take() {
                Some(id) => id,
                None => {
                    let Some(std::cmp::Reverse((_, _, parent, operator))) = self.queue.pop() else { break };
                    let Some(id) = self.child(parent, operator, best.as_ref().map_or(budget, |b| b.0)) else {
                        continue;
                    };
                    id
                }
            };
            let bound = best.as_ref().map_or(budget, |b| b.0);
            let cost = u64::from(self.store.cost(id));
            if goal.iter().all(|&f| task.holds(f, &self.state)) {
                if cost < bound {
                    best = Some((cost, self.store.plan_to(id)));
                }
                continue;
            }
            if left == 0 {
                break;
            }
            left -= 1;
            self.evaluated += 1;
            self.store.set_expanded(id, true);
            let Some(estimate) = relaxed.evaluate(task, &self.state) else { continue };
            if cost + u64::from(estimate) * TRUST_PERCENT / 100 >= bound {
                continue;
            }
            self.expand(&relaxed, id, cost, u64::from(estimate), all, &mut sequence);
            self.try_lookahead(&relaxed, id, goal, &mut best, bound);
        }
        self.work += relaxed.work;
        best.map(|(_, plan)| plan)
    }

    /// Heuristic restricted to operators that write only variables written in the window.
    fn restricted(&mut self, window: &[u32], goal: &[u32]) -> Relaxed {
        let task = self.task;
        self.touched.fill(false);
        let mut variables: Vec<u32> = window.iter().flat_map(|&op| task.written(op)).collect();
        variables.sort_unstable();
        variables.dedup();
        variables.iter().for_each(|&v| self.touched[v as usize] = true);
        let mut operators = Vec::new();
        for &variable in &variables {
            let writers = self.writers.get(variable as usize);
            self.work += writers.len() as u64;
            // An operator is taken with the first variable that it writes.
            operators.extend(writers.iter().filter(|&&op| {
                task.written(op).min() == Some(variable) && writes_only(task, op, &self.touched)
            }));
        }
        operators.sort_unstable();
        self.work += operators.len() as u64 * 4 + task.facts as u64 / 4;
        Relaxed::with(task, Counting::CostThenSteps, operators, goal.to_vec())
    }

    fn child(&mut self, parent: u32, operator: u32, bound: u64) -> Option<u32> {
        let task = self.task;
        let cost = self.store.cost(parent).saturating_add(self.costs[operator as usize]);
        // What is more than can be counted might be more than what it would take the place of.
        if cost == u32::MAX || u64::from(cost) >= bound {
            return None;
        }
        let mut before = std::mem::take(&mut self.next);
        self.store.load(task, parent, &mut before);
        task.apply(operator, &before, &mut self.state);
        self.next = before;
        self.work += 20 + self.state.len() as u64 / 4;
        let (id, new) = self.store.insert(&self.state, parent, operator, cost);
        if new {
            return Some(id);
        }
        if cost < self.store.cost(id) {
            self.store.improve(id, parent, operator, cost);
            return Some(id);
        }
        None
    }

    fn expand(
        &mut self,
        relaxed: &Relaxed,
        id: u32,
        cost: u64,
        estimate: u64,
        all: bool,
        sequence: &mut u32,
    ) {
        self.applicable.clear();
        if all {
            self.successors.applicable(self.task, &self.state, &mut self.applicable);
            let (task, touched) = (self.task, &self.touched);
            self.applicable.retain(|&op| writes_only(task, op, touched));
        }
        for &operator in relaxed.preferred.iter() {
            *sequence += 1;
            let key = cost + estimate;
            self.queue.push(std::cmp::Reverse((key, *sequence, id, operator)));
        }
        for &operator in &self.applicable {
            *sequence += 1;
            let key = cost + estimate + u64::from(self.costs[operator as usize]);
            self.queue.push(std::cmp::Reverse((key, *sequence, id, operator)));
        }
    }

    /// Applies the relaxed plan as far as possible; a goal state on the way, at a cost below `bound`,
    /// becomes the best plan.
    fn try_lookahead(
        &mut self,
        relaxed: &Relaxed,
        id: u32,
        goal: &[u32],
        best: &mut Option<(u64, Vec<u32>)>,
        bound: u64,
    ) {
        let task = self.task;
        self.lookahead.run(task, &self.state, &relaxed.plan);
        let steps = std::mem::take(&mut self.lookahead.plan);
        let mut cost = u64::from(self.store.cost(id));
        for (count, &operator) in steps.iter().enumerate() {
            cost += u64::from(self.costs[operator as usize]);
            if cost >= bound {
                break;
            }
            task.advance(operator, &mut self.state);
            if goal.iter().all(|&f| task.holds(f, &self.state)) {
                let mut plan = self.store.plan_to(id);
                plan.extend_from_slice(&steps[..=count]);
                *best = Some((cost, plan));
                break;
            }
        }
        self.work += steps.len() as u64 * (4 + goal.len() as u64 / 4);
        self.lookahead.plan = steps;
    }
}

/// Pairs of a variable (or number) and an operator that writes it.
fn writes(task: &Compiled) -> impl Iterator<Item = (u32, u32)> + Clone + '_ {
    (0..task.operators() as u32).flat_map(move |op| {
        let mut variables: Vec<u32> = task.written(op).collect();
        variables.sort_unstable();
        variables.dedup();
        variables.into_iter().map(move |v| (v, op))
    })
}

fn writes_only(task: &Compiled, operator: u32, touched: &[bool]) -> bool {
    task.written(operator).all(|v| touched[v as usize])
}

/// Later steps that must stay behind each step, and number of earlier steps that must stay before it.
fn dependencies(task: &Compiled, plan: &[u32]) -> (Vec<Vec<u32>>, Vec<u32>) {
    let mut after: Vec<Vec<u32>> = vec![Vec::new(); plan.len()];
    let mut waits = vec![0u32; plan.len()];
    let variables = task.domains.len() + task.numbers.len();
    let mut writer: Vec<u32> = vec![u32::MAX; variables];
    let mut readers: Vec<Vec<u32>> = vec![Vec::new(); variables];
    for (step, &operator) in plan.iter().enumerate() {
        let step = step as u32;
        let mut before: Vec<u32> = Vec::new();
        for variable in task.read(operator).into_iter().map(|v| v as usize) {
            before.push(writer[variable]);
            readers[variable].push(step);
        }
        for variable in task.written(operator).map(|v| v as usize) {
            before.push(writer[variable]);
            before.append(&mut readers[variable]);
            writer[variable] = step;
        }
        before.sort_unstable();
        before.dedup();
        for &earlier in before.iter().filter(|&&b| b != u32::MAX && b != step) {
            after[earlier as usize].push(step);
            waits[step as usize] += 1;
        }
    }
    (after, waits)
}

/// Facts that the rest of a plan needs, at each of its steps.
struct Needs {
    /// For each variable, the steps that need a value (step, value) or write the variable (step,
    /// `u32::MAX`), in order; empty for tasks with conditional effects or axioms.
    events: Vec<Vec<(u32, u32)>>,
}

impl Needs {
    fn new(task: &Compiled, plan: &[u32]) -> Needs {
        let mut events: Vec<Vec<(u32, u32)>> = vec![Vec::new(); task.domains.len()];
        let simple = task.axiom_heads.is_empty() && task.conditions.is_empty();
        if !simple {
            return Needs { events: Vec::new() };
        }
        for (step, &operator) in plan.iter().enumerate() {
            let compared = |f: &&crate::ground::GroundFact| (f.variable as usize) < task.numbers.first;
            for fact in task.preconditions.get(operator as usize).iter().filter(compared) {
                events[fact.variable as usize].push((step as u32, fact.value));
            }
            for effect in task.effects.get(operator as usize) {
                let list = &mut events[effect.fact.variable as usize];
                if list.last().is_none_or(|last| last.0 < step as u32) {
                    list.push((step as u32, u32::MAX));
                }
            }
        }
        for fact in &task.goal {
            events[fact.variable as usize].push((plan.len() as u32, fact.value));
        }
        Needs { events }
    }

    /// Facts that must hold before step `end`; for tasks with conditional effects or axioms, all facts
    /// of the state there.
    fn at(&self, task: &Compiled, plan: &[u32], end: usize) -> Vec<u32> {
        if self.events.is_empty() {
            if end == plan.len() {
                return task.goal.iter().map(|&f| task.id(f)).collect();
            }
            let mut state = task.initial.clone();
            plan[..end].iter().for_each(|&op| task.advance(op, &mut state));
            return (0..task.basic).map(|v| task.offsets[v] + state[v]).collect();
        }
        let needed = |list: &Vec<(u32, u32)>| {
            let next = list.partition_point(|&(step, _)| (step as usize) < end);
            list.get(next).map(|&(_, value)| value).filter(|&value| value != u32::MAX)
        };
        (0..self.events.len())
            .filter_map(|v| needed(&self.events[v]).map(|value| task.offsets[v] + value))
            .collect()
    }
}
