//! Lookahead over numbers: changes numbers towards the conditions of the relaxed plan's operators, so
//! that these become applicable.

use crate::classical::compiled::{Compiled, Lists};
use crate::classical::numbers::{NumberChange, repetitions};
use crate::ground::Change;
use crate::heuristics::relaxed::Relevant;

use super::lookahead::{Lookahead, MOST_STEPS, count};

/// Maximum depth of recursion when an operator is made applicable by others.
const DEPTH: u32 = 4;
/// Maximum number of passes over all conditions of an operator or the goal.
const ROUNDS: usize = 4;

/// Operators that can change left minus right of each comparison by addition, with the change (NaN if
/// it depends on the state).
pub(super) fn movers(task: &Compiled) -> Lists<(u32, f64)> {
    let numbers = &task.numbers;
    let mut pairs = Vec::new();
    for (operator, changes) in numbers.changes.iter().enumerate() {
        if changes.iter().all(|c| c.conditions.is_empty()) {
            for &comparison in numbers.turned(operator as u32) {
                let gain = numbers.gain(comparison, changes);
                let adds = |c: &NumberChange| matches!(c.change, Some(Change::Increase | Change::Decrease));
                let linear = numbers.linear[comparison as usize].is_some();
                if gain != 0.0 && (!gain.is_nan() || linear && changes.iter().all(adds)) {
                    pairs.push((comparison, (operator as u32, gain)));
                }
            }
        }
    }
    Lists::group(numbers.comparisons.len(), pairs.iter().copied())
}

impl Lookahead {
    /// Makes one operator of the relaxed plan applicable by changing numbers, and applies it; false if this
    /// succeeds for none.
    pub(super) fn steer(&mut self, task: &Compiled) -> bool {
        if task.numbers.is_empty() || self.plan.len() >= MOST_STEPS {
            return false;
        }
        for place in 0..self.rest.len() {
            let entry = self.rest[place];
            if self.enable(task, entry.operator, DEPTH) {
                self.rest.remove(place);
                count(&mut self.needed, task, entry.operator, -1);
                self.step(task, entry.operator);
                return true;
            }
        }
        false
    }

    /// Changes numbers towards the numeric conditions of the goal.
    pub(super) fn steer_to_goal(&mut self, task: &Compiled) {
        if !task.numbers.is_empty() {
            let mut goal: Vec<u32> = task.goal.iter().map(|&f| task.id(f)).collect();
            for _ in 0..ROUNDS {
                if !self.approach_all(task, &goal, DEPTH) {
                    break;
                }
                goal.reverse();
            }
        }
    }

    /// Changes numbers towards facts one after another, preferring changes that keep the earlier facts
    /// true; true if any operator was applied.
    fn approach_all(&mut self, task: &Compiled, wanted: &[u32], depth: u32) -> bool {
        let mut moved = false;
        for place in 0..wanted.len() {
            moved |= self.approach(task, wanted[place], &wanted[..place], depth);
        }
        moved
    }

    /// Makes an operator applicable that lacks only numeric conditions; false if this fails.
    fn enable(&mut self, task: &Compiled, operator: u32, depth: u32) -> bool {
        let mut wanted: Vec<u32> =
            task.preconditions.get(operator as usize).iter().map(|&f| task.id(f)).collect();
        let compared = |f: u32| task.variables[f as usize] as usize >= task.numbers.first;
        if depth == 0 || wanted.iter().any(|&f| !compared(f) && !task.holds(f, &self.state)) {
            return false;
        }
        for _ in 0..ROUNDS {
            if task.applicable(operator, &self.state) {
                return true;
            }
            if !self.approach_all(task, &wanted, depth) {
                return false;
            }
            wanted.reverse();
        }
        task.applicable(operator, &self.state)
    }

    /// Applies operators until a numeric condition holds, preferring those that keep the facts `keep`
    /// true; true if any was applied.
    fn approach(&mut self, task: &Compiled, fact: u32, keep: &[u32], depth: u32) -> bool {
        let variable = task.variables[fact as usize] as usize;
        if variable < task.numbers.first || task.holds(fact, &self.state) {
            return false;
        }
        let before = self.plan.len();
        let comparison = (variable - task.numbers.first) as u32;
        let mut last = f64::INFINITY;
        while !task.holds(fact, &self.state) && self.plan.len() < MOST_STEPS {
            let gap = task.numbers.gap(comparison as usize, &self.state).abs();
            // What an operator adds may depend on what it moves.
            if gap >= last {
                break;
            }
            last = gap;
            let Some((operator, times)) = self.best_mover(task, comparison, keep) else { break };
            for _ in 0..times {
                if !task.applicable(operator, &self.state) {
                    break;
                }
                self.step(task, operator);
            }
        }
        if !task.holds(fact, &self.state) {
            self.support(task, fact, depth);
        }
        self.plan.len() > before
    }

    /// Cheapest applicable operator whose repetition makes a comparison true, with the number of
    /// applications; operators that keep the facts `keep` true come first. `None` if there is none.
    fn best_mover(&self, task: &Compiled, comparison: u32, keep: &[u32]) -> Option<(u32, u32)> {
        let gap = task.numbers.gap(comparison as usize, &self.state);
        let relation = task.numbers.comparisons[comparison as usize].relation;
        let mut best: Option<((bool, u64), (u32, u32))> = None;
        for &(operator, gain) in self.movers.get(comparison as usize) {
            let gain = if gain.is_nan() { self.gain(task, operator, comparison) } else { gain };
            let Some(times) = repetitions(gap, relation, gain) else { continue };
            let after = gap + f64::from(times) * gain;
            if !relation.holds(after, 0.0) || !task.applicable(operator, &self.state) {
                continue;
            }
            let cost = u64::from(times) * (u64::from(task.costs[operator as usize]) + 1);
            let breaks = || keep.iter().any(|&other| self.breaks(task, operator, times, other));
            if best.is_none_or(|(known, _)| known > (false, cost)) {
                let key = (breaks(), cost);
                if best.is_none_or(|(known, _)| known > key) {
                    best = Some((key, (operator, times)));
                }
            }
        }
        best.map(|(_, mover)| mover)
    }

    /// Change of left minus right of a comparison by one application of an operator in the present
    /// state.
    fn gain(&self, task: &Compiled, operator: u32, comparison: u32) -> f64 {
        task.numbers.gain_in(comparison, &task.numbers.changes[operator as usize], &self.state)
    }

    /// True if a numeric condition holds now and no longer after `times` applications of an operator.
    fn breaks(&self, task: &Compiled, operator: u32, times: u32, fact: u32) -> bool {
        let variable = task.variables[fact as usize] as usize;
        if variable < task.numbers.first || !task.holds(fact, &self.state) {
            return false;
        }
        let comparison = variable - task.numbers.first;
        let gain = self.gain(task, operator, comparison as u32);
        let gap = task.numbers.gap(comparison, &self.state) + f64::from(times) * gain;
        !task.numbers.comparisons[comparison].relation.holds(gap, 0.0)
    }

    /// Makes the relaxed plan's operator for a numeric condition, or one of its refilling operators,
    /// applicable and applies it as often as the relaxed plan says.
    fn support(&mut self, task: &Compiled, fact: u32, depth: u32) {
        if let Some(entry) = self.moves.iter().find(|r| r.until == fact).copied() {
            if self.enable(task, entry.operator, depth - 1) {
                self.repeat(task, entry);
            }
            return;
        }
        let comparison = (task.variables[fact as usize] as usize - task.numbers.first) as u32;
        let gap = task.numbers.gap(comparison as usize, &self.state);
        let relation = task.numbers.comparisons[comparison as usize].relation;
        let helps = |refill: &&Relevant| {
            refill.times > 0
                && repetitions(gap, relation, self.gain(task, refill.operator, comparison)).is_some()
        };
        if let Some(refill) = self.refills.iter().find(helps).copied()
            && self.enable(task, refill.operator, depth - 1)
        {
            self.fill(task);
        }
    }
}
