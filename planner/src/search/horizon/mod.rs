//! Planning as satisfiability, with several numbers of steps tried in turn (Rintanen, Heljanko and
//! Niemelä 2006). Strong where many operators share a step and heuristics mislead; only for small
//! tasks.

mod form;
#[doc(hidden)]
pub mod goals;
#[doc(hidden)]
pub mod order;
mod support;

use crate::clauses::Literal;
use crate::clauses::solver::{Satisfiability, Solver};

use self::form::Form;
use self::support::{Agenda, Support};

use super::lazy::{Allowed, Counts, End, Shared};

/// Number of horizons (plan lengths in steps) that are tried alternately.
const ABREAST: usize = 6;
/// Work of one turn of a horizon, in the unit of [`Solver::work`].
const TURN_WORK: u64 = 400_000;
/// Maximum number of steps of a plan.
const MOST_STEPS: usize = 1_000;
/// Maximum number of literals of a horizon.
const MOST_LITERALS: usize = 4_000_000;
/// Work of adding one literal to a solver, in the unit of [`Solver::work`].
const LITERAL_WORK: u64 = 4;
/// Approximate memory of one literal in a solver, in bytes.
const LITERAL_BYTES: usize = 16;

/// SAT solver for plans with a fixed number of steps.
struct Horizon {
    steps: usize,
    solver: Solver,
    agenda: Agenda,
}

/// Search by satisfiability that can be continued after [`End::Limit`].
pub struct SatSearch<'a, 's> {
    shared: &'s Shared<'a>,
    /// Only plans with search costs below this bound are accepted.
    bound: u32,
    started: bool,
    /// Encoding of one step; `None` for tasks that the encoding does not cover.
    form: Option<Form>,
    open: Vec<Horizon>,
    /// Number of steps of the next horizon.
    next: usize,
    counts: Counts,
}

impl<'a, 's> SatSearch<'a, 's> {
    /// Search that has not begun.
    pub fn new(shared: &'s Shared<'a>, bound: u32) -> SatSearch<'a, 's> {
        let counts = Counts::default();
        SatSearch { shared, bound, started: false, form: None, open: Vec::new(), next: 0, counts }
    }

    /// Counts since the beginning of the search.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Approximate memory of the solvers, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.open.iter().map(|horizon| horizon.solver.bytes()).sum()
    }

    /// Continues the search within limits. [`End::Exhausted`] only means that nothing more can be
    /// tried; it is no proof.
    pub fn run(&mut self, allowed: Allowed) -> End {
        if !std::mem::replace(&mut self.started, true) {
            self.form = Form::new(self.shared.task, self.shared.mutex_groups);
            let earliest = self.form.as_ref().and_then(|form| form.earliest(self.shared.task));
            self.next = earliest.unwrap_or(usize::MAX).max(1);
        }
        loop {
            if allowed.has_ended(self.shared) {
                return End::Stopped;
            }
            while self.open.len() < ABREAST && self.lengthen(&allowed) {}
            if self.open.is_empty() {
                return if self.next_literals().is_some() { End::Limit } else { End::Exhausted };
            }
            if let Some(end) = self.turn(&allowed) {
                return end;
            }
        }
    }

    /// Number of literals of the next horizon; `None` if it would be too long or too large.
    fn next_literals(&self) -> Option<usize> {
        let literals = self.next.saturating_mul(self.form.as_ref()?.size());
        (self.next <= MOST_STEPS && literals <= MOST_LITERALS).then_some(literals)
    }

    /// Adds the next horizon; false if the limits forbid it.
    fn lengthen(&mut self, allowed: &Allowed) -> bool {
        let (Some(form), Some(literals)) = (&self.form, self.next_literals()) else { return false };
        let steps = self.next;
        let work = self.counts.work + literals as u64 * LITERAL_WORK;
        if work > allowed.work || !allowed.memory.has_room(|| self.bytes(), literals * LITERAL_BYTES) {
            return false;
        }
        let solver = form.solver(self.shared.task, steps);
        self.open.push(Horizon { steps, solver, agenda: Agenda::default() });
        self.counts.work = work;
        self.next = steps + (steps / 4).max(2);
        true
    }

    /// Runs the solver of each horizon for one turn; returns a result that ends the search, or `None`.
    /// After a proof that a horizon has no plan, shorter ones are dropped with it.
    fn turn(&mut self, allowed: &Allowed) -> Option<End> {
        for place in 0..self.open.len() {
            if self.counts.work > allowed.work {
                return Some(End::Limit);
            }
            let form = self.form.as_ref()?;
            let Horizon { steps, solver, agenda } = &mut self.open[place];
            let mut support = Support { task: self.shared.task, form, horizon: *steps, agenda };
            let before = solver.work;
            let answer = solver.run(&mut support, before + TURN_WORK, &|| allowed.has_ended(self.shared));
            self.counts.work += solver.work - before;
            match answer {
                Satisfiability::Satisfied => return Some(self.found(place)),
                // Nor is there a shorter plan.
                Satisfiability::Unsatisfiable => {
                    self.open.drain(..=place);
                    return None;
                }
                Satisfiability::Interrupted => {}
            }
        }
        None
    }

    /// Plan of a satisfied horizon; `Exhausted` if the plan is not below the cost bound.
    fn found(&self, place: usize) -> End {
        let (Some(form), Horizon { steps, solver, .. }) = (&self.form, &self.open[place]) else {
            return End::Exhausted;
        };
        let applied = |step: usize, operator: u32| {
            solver.value(Literal::new(form.operator(operator, step), true)) == Some(true)
        };
        let plan: Vec<u32> = (0..*steps)
            .flat_map(|step| form.order.iter().copied().filter(move |&operator| applied(step, operator)))
            .collect();
        match self.shared.task.search_cost(&plan) < self.bound {
            true => End::Plan(plan),
            false => End::Exhausted,
        }
    }
}
