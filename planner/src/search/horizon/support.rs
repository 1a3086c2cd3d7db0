//! Decision heuristic of the SAT search: decides for an operator that supports the earliest open
//! subgoal (Rintanen 2012, "Planning as satisfiability: heuristics"). Once all subgoals are supported,
//! facts persist and no more operators are applied.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::classical::compiled::Compiled;
use crate::clauses::Literal;
use crate::clauses::solver::{Decide, Solver};

use super::form::Form;

/// Subgoals handled since the last conflict. Until the next one, decisions only add values, so a
/// supported subgoal need not be checked again.
#[derive(Default)]
pub(super) struct Agenda {
    /// True, by state and fact, if the fact is or was a subgoal there.
    seen: Vec<bool>,
    /// Open subgoals as (state, rank, fact), earliest state first.
    subgoals: BinaryHeap<Reverse<(usize, u32, u32)>>,
    /// Number of conflicts of the solver when the agenda was built.
    conflicts: u64,
}

impl Agenda {
    fn want(&mut self, facts: usize, moment: usize, fact: u32, rank: u32) {
        if moment > 0 && !std::mem::replace(&mut self.seen[moment * facts + fact as usize], true) {
            self.subgoals.push(Reverse((moment, rank, fact)));
        }
    }
}

/// Decision heuristic for plans with a given number of steps.
pub(super) struct Support<'a> {
    pub task: &'a Compiled,
    pub form: &'a Form,
    pub horizon: usize,
    pub agenda: &'a mut Agenda,
}

impl Support<'_> {
    fn is(&self, solver: &Solver, fact: u32, moment: usize) -> Option<bool> {
        solver.value(Literal::new(self.form.fact(fact, moment), true))
    }

    fn does(&self, solver: &Solver, operator: u32, step: usize) -> Option<bool> {
        solver.value(Literal::new(self.form.operator(operator, step), true))
    }

    /// Restarts the agenda from the goals; returns the work done.
    fn begin(&mut self, solver: &Solver) -> u64 {
        let (facts, agenda) = (self.task.facts, &mut *self.agenda);
        agenda.conflicts = solver.conflicts();
        agenda.seen.clear();
        agenda.seen.resize((self.horizon + 1) * facts, false);
        agenda.subgoals.clear();
        for (place, &fact) in self.form.goals.iter().enumerate() {
            agenda.want(facts, self.horizon, fact, place as u32);
        }
        (self.horizon * facts / 16) as u64
    }

    /// Operator that can support the earliest unsupported subgoal, with its step; `None` if all
    /// subgoals are supported. Adds the work done to `work`.
    fn open(&mut self, solver: &Solver, work: &mut u64) -> Option<(u32, usize)> {
        while let Some(Reverse((moment, rank, fact))) = self.agenda.subgoals.pop() {
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
                    for &need in self.task.preconditions.get(operator as usize) {
                        let fact = self.task.id(need);
                        self.agenda.want(self.task.facts, step, fact, fact);
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
                        self.agenda.subgoals.push(Reverse((moment, rank, fact)));
                        return Some((operator, step));
                    }
                    break;
                }
            }
        }
        None
    }

    /// Appends literals that complete the assignment: variables keep their values, and no more
    /// operators are applied.
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
        let mut work = 1;
        let mut open = None;
        if !self.agenda.seen.is_empty() && self.agenda.conflicts == solver.conflicts() {
            open = self.open(solver, &mut work);
        }
        // What had support may have lost it to what was set later: only all of it, looked at once more, tells.
        if open.is_none() {
            work += self.begin(solver);
            open = self.open(solver, &mut work);
        }
        match open {
            Some((operator, step)) => out.push(Literal::new(self.form.operator(operator, step), true)),
            None => self.rest(solver, out),
        }
        work
    }
}
