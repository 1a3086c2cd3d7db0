//! What to try next: an operator that supports the earliest open subgoal (Rintanen 2012, "Planning as satisfiability:
//! heuristics"). Once all are supported, what holds stays, and nothing else is done.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::classical::compiled::Compiled;
use crate::clauses::Literal;
use crate::clauses::solver::{Decide, Solver};

use super::form::Form;

/// For plans of so many steps.
pub(super) struct Support<'a> {
    pub task: &'a Compiled,
    pub form: &'a Form,
    pub horizon: usize,
}

impl Support<'_> {
    fn is(&self, solver: &Solver, fact: u32, moment: usize) -> Option<bool> {
        solver.value(Literal::new(self.form.fact(fact, moment), true))
    }

    fn does(&self, solver: &Solver, operator: u32, step: usize) -> Option<bool> {
        solver.value(Literal::new(self.form.operator(operator, step), true))
    }

    /// The operator to be tried for the earliest subgoal that nothing supports yet, with its step; adds to the work.
    fn open(&self, solver: &Solver, work: &mut u64) -> Option<(u32, usize)> {
        let mut seen = vec![false; (self.horizon + 1) * self.task.facts];
        let mut subgoals = BinaryHeap::new();
        let mut want = |moment: usize, fact: u32, rank: u32, subgoals: &mut BinaryHeap<_>| {
            if moment > 0 && !std::mem::replace(&mut seen[moment * self.task.facts + fact as usize], true) {
                subgoals.push(Reverse((moment, rank, fact)));
            }
        };
        for (place, &fact) in self.form.goals.iter().enumerate() {
            want(self.horizon, fact, place as u32, &mut subgoals);
        }
        while let Some(Reverse((moment, _, fact))) = subgoals.pop() {
            let adders = self.form.adders.get(fact as usize);
            for step in (0..moment).rev() {
                *work += 1;
                let held = self.is(solver, fact, step);
                if held == Some(true) {
                    continue;
                }
                *work += adders.len() as u64;
                let applied = |&&operator: &&u32| self.does(solver, operator, step) == Some(true);
                if let Some(&operator) = adders.iter().find(applied) {
                    let needs = self.task.preconditions.get(operator as usize);
                    for fact in needs.iter().map(|&need| self.task.id(need)) {
                        want(step, fact, fact, &mut subgoals);
                    }
                    break;
                }
                if held == Some(false) {
                    let open = adders.iter().filter(|&&op| self.does(solver, op, step).is_none());
                    let activity = |op: u32| solver.activity(self.form.operator(op, step));
                    let best = open.copied().max_by(|&one, &other| {
                        activity(one).total_cmp(&activity(other)).then(other.cmp(&one))
                    });
                    if let Some(operator) = best {
                        return Some((operator, step));
                    }
                    break;
                }
            }
        }
        None
    }

    /// All that is still open: each variable keeps its value as long as it can, and no more operators are applied.
    fn rest(&self, solver: &Solver, out: &mut Vec<Literal>) {
        let mut held = self.task.initial.clone();
        for moment in 1..=self.horizon {
            for (variable, held) in held.iter_mut().enumerate() {
                let offset = self.task.offsets[variable];
                let value = |value: u32| self.is(solver, offset + value, moment);
                let values = || 0..self.task.domains[variable];
                let set = values().find(|&v| value(v) == Some(true));
                let kept = Some(*held).filter(|&v| value(v).is_none());
                if let Some(next) = set.or(kept).or_else(|| values().find(|&v| value(v).is_none())) {
                    *held = next;
                    out.push(Literal::new(self.form.fact(offset + next, moment), true));
                }
            }
        }
    }
}

impl Decide for Support<'_> {
    fn next(&mut self, solver: &Solver, out: &mut Vec<Literal>) -> u64 {
        let mut work = (self.horizon * self.task.facts / 16) as u64;
        match self.open(solver, &mut work) {
            Some((operator, step)) => out.push(Literal::new(self.form.operator(operator, step), true)),
            None => self.rest(solver, out),
        }
        work
    }
}
