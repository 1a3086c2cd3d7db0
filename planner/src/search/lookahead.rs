//! Lookahead: applies as much of a relaxed plan as possible, and repairs the plan where an operator is
//! not applicable (Vidal 2004, "A lookahead strategy for heuristic search planning").

use crate::classical::compiled::{Compiled, Lists};
use crate::heuristics::relaxed::{REFILL, Relevant};

use super::steer::movers;

/// Working memory of the lookahead.
pub struct Lookahead {
    /// Operators that achieve each fact.
    achievers: Lists<u32>,
    /// Number of goals and of operators still to apply that need a fact, by fact.
    pub(super) needed: Vec<i32>,
    pub(super) rest: Vec<Relevant>,
    /// Operators of the relaxed plan that are there to satisfy a numeric condition.
    pub(super) moves: Vec<Relevant>,
    /// Operators of the relaxed plan that refill numbers consumed by others.
    pub(super) refills: Vec<Relevant>,
    pub(super) state: Vec<u32>,
    next: Vec<u32>,
    /// Operators that can move each comparison towards truth, with the change of left minus right (NaN
    /// if it depends on the state).
    pub(super) movers: Lists<(u32, f64)>,
    /// Operators applied by the last run, in order.
    pub plan: Vec<u32>,
    /// True to change numbers towards conditions.
    pub steers: bool,
}

/// Maximum number of steps of a lookahead.
pub(super) const MOST_STEPS: usize = 20_000;

impl Lookahead {
    /// Lookahead for a task.
    pub fn new(task: &Compiled) -> Lookahead {
        let pairs = (0..task.operators())
            .flat_map(|op| task.effects.get(op).iter().map(move |e| (task.id(e.fact), op as u32)));
        let mut needed = vec![0; task.facts];
        task.goal.iter().for_each(|&f| needed[task.id(f) as usize] += 1);
        Lookahead {
            achievers: Lists::group(task.facts, pairs),
            needed,
            rest: Vec::new(),
            moves: Vec::new(),
            refills: Vec::new(),
            state: Vec::new(),
            next: Vec::new(),
            movers: movers(task),
            plan: Vec::new(),
            steers: true,
        }
    }

    /// This lookahead, with or without changing numbers towards conditions.
    pub(super) fn steering(self, steers: bool) -> Lookahead {
        Lookahead { steers, ..self }
    }

    /// Applies as much of a relaxed plan as possible from a state; leaves the applied operators in
    /// `plan`.
    pub fn run(&mut self, task: &Compiled, from: &[u32], relaxed: &[Relevant]) {
        self.plan.clear();
        self.rest.clear();
        self.moves.clear();
        self.refills.clear();
        for entry in relaxed {
            let list = match entry.until {
                REFILL => &mut self.refills,
                u32::MAX => &mut self.rest,
                _ => &mut self.moves,
            };
            list.push(*entry);
        }
        self.state.clear();
        self.state.extend_from_slice(from);
        relaxed.iter().for_each(|r| count(&mut self.needed, task, r.operator, 1));
        loop {
            while self.pass(task) {}
            if self.rest.is_empty() || !(self.mend(task) || self.steers && self.steer(task)) {
                break;
            }
        }
        for list in [&self.rest, &self.moves, &self.refills] {
            list.iter().for_each(|left| count(&mut self.needed, task, left.operator, -1));
        }
        if self.steers {
            self.steer_to_goal(task);
        }
    }

    /// Applies every applicable operator of the relaxed plan in order; true if any was applied.
    /// Operators that only change numbers wait until another operator would disable them.
    fn pass(&mut self, task: &Compiled) -> bool {
        let before = self.plan.len();
        let mut rest = std::mem::take(&mut self.rest);
        rest.retain(|entry| {
            if !task.applicable(entry.operator, &self.state) {
                return true;
            }
            let more = self.fill(task) | self.hurry(task, entry.operator);
            if more && !task.applicable(entry.operator, &self.state) {
                return true;
            }
            count(&mut self.needed, task, entry.operator, -1);
            self.step(task, entry.operator);
            false
        });
        self.rest = rest;
        self.plan.len() > before
    }

    /// Applies the operators that refill numbers as often as possible; true if any was applied.
    pub(super) fn fill(&mut self, task: &Compiled) -> bool {
        let before = self.plan.len();
        for place in 0..self.refills.len() {
            while self.refills[place].times > 0 && task.applicable(self.refills[place].operator, &self.state)
            {
                self.refills[place].times -= 1;
                self.step(task, self.refills[place].operator);
            }
        }
        self.plan.len() > before
    }

    /// Applies the operators for numeric conditions that `operator` would disable; true if any was
    /// applied.
    fn hurry(&mut self, task: &Compiled, operator: u32) -> bool {
        let before = self.plan.len();
        for place in 0..self.moves.len() {
            let entry = self.moves[place];
            if takes_from(task, operator, entry.operator) {
                self.moves[place].times -= self.repeat(task, entry);
            }
        }
        self.plan.len() > before
    }

    /// Applies an operator while it is applicable and its numeric condition is false, at most as often
    /// as the relaxed plan says; returns the number of applications.
    pub(super) fn repeat(&mut self, task: &Compiled, entry: Relevant) -> u32 {
        let mut times = 0;
        while times < entry.times
            && !task.holds(entry.until, &self.state)
            && task.applicable(entry.operator, &self.state)
        {
            self.step(task, entry.operator);
            times += 1;
        }
        times
    }

    pub(super) fn step(&mut self, task: &Compiled, operator: u32) {
        task.apply(operator, &self.state, &mut self.next);
        std::mem::swap(&mut self.state, &mut self.next);
        self.plan.push(operator);
    }

    /// Repairs the relaxed plan: an inapplicable operator is replaced by an applicable one that adds
    /// the same needed fact, which is then applied. False if there is none.
    fn mend(&mut self, task: &Compiled) -> bool {
        for i in 0..self.rest.len() {
            for effect in task.effects.get(self.rest[i].operator as usize) {
                let fact = task.id(effect.fact);
                if task.holds(fact, &self.state) || self.needed[fact as usize] == 0 {
                    continue;
                }
                let fits = |&&op: &&u32| op != self.rest[i].operator && task.applicable(op, &self.state);
                let achievers = self.achievers.get(fact as usize).iter();
                if let Some(&operator) = achievers.filter(fits).min_by_key(|&&op| task.costs[op as usize]) {
                    if self.hurry(task, operator) {
                        return true;
                    }
                    let gone = self.rest.remove(i);
                    count(&mut self.needed, task, gone.operator, -1);
                    self.step(task, operator);
                    return true;
                }
            }
        }
        false
    }
}

/// Adds `by` to the number of needs of each precondition of an operator.
pub(super) fn count(needed: &mut [i32], task: &Compiled, operator: u32, by: i32) {
    for &fact in task.preconditions.get(operator as usize) {
        needed[task.id(fact) as usize] += by;
    }
}

/// True if an operator makes a precondition of another one false.
fn takes_from(task: &Compiled, operator: u32, other: u32) -> bool {
    let effects = task.effects.get(operator as usize).iter().filter(|e| e.from == e.to);
    let mut effects = effects.map(|effect| effect.fact);
    let needs = task.preconditions.get(other as usize);
    effects.any(|fact| needs.iter().any(|n| n.variable == fact.variable && n.value != fact.value))
}
