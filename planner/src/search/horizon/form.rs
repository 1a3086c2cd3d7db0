//! SAT encoding of a task for plans of a given number of steps (Kautz and Selman 1992). Several
//! operators share a step if they can be applied in a fixed order (exists-step; Rintanen, Heljanko and
//! Niemelä 2006).

use crate::classical::compiled::{Compiled, Lists};
use crate::clauses::Literal;
use crate::clauses::solver::Solver;
use crate::ground::GroundFact;

use super::goals::in_order;
use super::order::{Use, order, uses};

/// Maximum number of literals in the clauses of one step.
const MOST_LITERALS: usize = 2_000_000;

/// Literal about a step or the state before it, or (`later`) about the state after it; written for step
/// 0 and repeated for every step.
#[derive(Clone, Copy, Default)]
struct Said {
    literal: Literal,
    later: bool,
}

impl Said {
    fn not(self) -> Said {
        Said { literal: self.literal.negated(), ..self }
    }
}

/// Encoding of one step, which is repeated for every step of a plan.
pub(super) struct Form {
    /// Number of variables per step: facts, operators, and auxiliary variables for facts deleted within
    /// the step.
    pub stride: usize,
    facts: usize,
    /// Clauses over the facts of one state.
    always: Lists<Said>,
    /// Clauses over a step, the state before it and the state after it.
    step: Lists<Said>,
    /// Operators that add a fact, by fact.
    pub adders: Lists<u32>,
    /// Operators in their order of application within a step.
    pub order: Vec<u32>,
    /// Goal facts in a reasonable order (Koehler and Hoffmann 2000).
    pub goals: Vec<u32>,
    /// First state in which a fact can hold, by fact; `u32::MAX` for never.
    first_fact: Vec<u32>,
    /// First step in which an operator can be applied, by operator; `u32::MAX` for never.
    first_operator: Vec<u32>,
}

impl Form {
    /// Encoding of a task without conditional effects, axioms and numbers; `None` for other tasks, or
    /// if the encoding would be too large.
    pub(super) fn new(task: &Compiled, mutex_groups: &[Vec<GroundFact>]) -> Option<Form> {
        let conditional = task.effects.all().iter().any(|effect| effect.from != effect.to);
        if conditional || !task.axiom_heads.is_empty() || task.some_impossible() {
            return None;
        }
        let pairs = (0..task.operators() as u32)
            .flat_map(|op| task.effects.get(op as usize).iter().map(move |e| (task.id(e.fact), op)));
        let (first_fact, first_operator) = first_moments(task);
        let mut form = Form {
            stride: task.facts + task.operators(),
            facts: task.facts,
            always: Lists::new(),
            step: Lists::new(),
            adders: Lists::group(task.facts, pairs),
            order: Vec::new(),
            goals: Vec::new(),
            first_fact,
            first_operator,
        };
        let uses = uses(task);
        let size: usize = uses.iter().map(Vec::len).sum::<usize>()
            + task.domains.iter().map(|&d| (d * d) as usize).sum::<usize>()
            + mutex_groups.iter().map(|group| group.len() * group.len()).sum::<usize>();
        if size > MOST_LITERALS {
            return None;
        }
        form.goals = in_order(task, mutex_groups, &form.adders);
        form.exclude(task, mutex_groups);
        form.change(task);
        let order = order(task, &uses);
        form.keep_order(&order, &uses);
        form.order = order.iter().map(|&(operator, _)| operator).collect();
        Some(form)
    }

    /// Variable of a fact in a state; state 0 is the initial one.
    pub(super) fn fact(&self, fact: u32, moment: usize) -> u32 {
        (moment * self.stride) as u32 + fact
    }

    /// Variable of an operator at a step, which leads from the state of the same number to the next
    /// one.
    pub(super) fn operator(&self, operator: u32, step: usize) -> u32 {
        (step * self.stride + self.facts) as u32 + operator
    }

    /// Number of literals in the clauses of one step.
    pub(super) fn size(&self) -> usize {
        self.always.all().len() + self.step.all().len()
    }

    fn does(&self, operator: u32) -> Said {
        Said { literal: Literal::new(self.operator(operator, 0), true), later: false }
    }

    /// Adds clauses for exactly one value per variable and at most one fact per mutex group.
    fn exclude(&mut self, task: &Compiled, mutex_groups: &[Vec<GroundFact>]) {
        for (&offset, &size) in task.offsets.iter().zip(&task.domains) {
            self.always.push((offset..offset + size).map(|fact| is(fact, false)));
            for fact in offset..offset + size {
                for other in offset..fact {
                    self.always.push([fact, other].map(|f| is(f, false).not()));
                }
            }
        }
        for group in mutex_groups {
            for (place, &fact) in group.iter().enumerate() {
                for &other in group[..place].iter().filter(|other| other.variable != fact.variable) {
                    self.always.push([fact, other].map(|f| is(task.id(f), false).not()));
                }
            }
        }
    }

    /// Adds clauses for preconditions, effects and frame axioms.
    fn change(&mut self, task: &Compiled) {
        for operator in 0..task.operators() as u32 {
            let not = self.does(operator).not();
            for &fact in task.preconditions.get(operator as usize) {
                self.step.push([not, is(task.id(fact), false)]);
            }
            for effect in task.effects.get(operator as usize) {
                self.step.push([not, is(task.id(effect.fact), true)]);
            }
        }
        for fact in 0..task.facts as u32 {
            let by = self.adders.get(fact as usize).iter().map(|&operator| self.does(operator));
            let clause: Vec<Said> = [is(fact, true).not(), is(fact, false)].into_iter().chain(by).collect();
            self.step.push(clause);
        }
    }

    /// Adds clauses against operators that follow, within a step, an operator that deletes one of their
    /// preconditions.
    fn keep_order(&mut self, order: &[(u32, u32)], uses: &[Vec<Use>]) {
        // By fact: operators of its chain in order, each with its circle.
        let pairs = order.iter().flat_map(|&(operator, circle)| {
            uses[operator as usize]
                .iter()
                .map(move |used| (used.fact, (operator, circle, used.needs, used.takes)))
        });
        let chains = Lists::group(self.facts, pairs);
        for fact in 0..self.facts {
            for chain in chains.get(fact).chunk_by(|one, other| one.1 == other.1) {
                self.chain(chain);
            }
        }
    }

    /// Adds clauses for one fact and the operators of a strong component that use it: once one of them
    /// deletes the fact, no later one that needs it can be applied. A chain of auxiliary variables
    /// keeps their number linear.
    fn chain(&mut self, chain: &[(u32, u32, bool, bool)]) {
        let Some(last) = chain.iter().rposition(|user| user.2) else { return };
        let mut gone: Option<Said> = None;
        let mut takers: Vec<Said> = Vec::new();
        for &(operator, _, needs, takes) in &chain[..=last] {
            if needs && !takers.is_empty() {
                let now = Said { literal: Literal::new(self.stride as u32, true), later: false };
                self.stride += 1;
                for by in takers.drain(..).chain(gone) {
                    self.step.push([by.not(), now]);
                }
                gone = Some(now);
            }
            let does = self.does(operator);
            if let Some(gone) = gone.filter(|_| needs) {
                self.step.push([gone.not(), does.not()]);
            }
            if takes {
                takers.push(does);
            }
        }
    }

    /// Solver with the clauses for plans of `horizon` steps.
    pub(super) fn solver(&self, task: &Compiled, horizon: usize) -> Solver {
        let mut solver = Solver::new(horizon * self.stride + self.facts);
        let mut unit = |variable: u32, positive: bool| solver.add(&[Literal::new(variable, positive)]);
        for (&offset, &value) in task.offsets.iter().zip(&task.initial) {
            unit(self.fact(offset + value, 0), true);
        }
        task.goal.iter().for_each(|&goal| unit(self.fact(task.id(goal), horizon), true));
        for moment in 0..=horizon {
            let too_early = |first: &[u32], place: u32| first[place as usize] as usize > moment;
            for fact in (0..self.facts as u32).filter(|&fact| too_early(&self.first_fact, fact)) {
                unit(self.fact(fact, moment), false);
            }
            let operators = if moment < horizon { self.first_operator.len() as u32 } else { 0 };
            for operator in (0..operators).filter(|&operator| too_early(&self.first_operator, operator)) {
                unit(self.operator(operator, moment), false);
            }
        }
        for moment in 0..=horizon {
            self.repeat(&self.always, moment, &mut solver);
            if moment < horizon {
                self.repeat(&self.step, moment, &mut solver);
            }
        }
        solver
    }

    fn repeat(&self, clauses: &Lists<Said>, moment: usize, solver: &mut Solver) {
        let mut clause = Vec::new();
        for place in 0..clauses.len() {
            clause.clear();
            clause.extend(
                clauses.get(place).iter().map(|said| {
                    said.literal.shifted(((moment + usize::from(said.later)) * self.stride) as u32)
                }),
            );
            solver.add(&clause);
        }
    }

    /// First state in which every goal fact can hold under delete relaxation; `None` if some goal fact
    /// never can.
    pub(super) fn earliest(&self, task: &Compiled) -> Option<usize> {
        let latest = task.goal.iter().map(|&f| self.first_fact[task.id(f) as usize]).max().unwrap_or(0);
        (latest != u32::MAX).then_some(latest as usize)
    }
}

/// Literal of a fact in a state, or (`later`) in the state after the next step.
fn is(fact: u32, later: bool) -> Said {
    Said { literal: Literal::new(fact, true), later }
}

/// First state of each fact and first step of each operator under delete relaxation; `u32::MAX` for
/// never.
fn first_moments(task: &Compiled) -> (Vec<u32>, Vec<u32>) {
    let mut facts = vec![u32::MAX; task.facts];
    let mut operators = vec![u32::MAX; task.operators()];
    task.offsets.iter().zip(&task.initial).for_each(|(&offset, &value)| facts[(offset + value) as usize] = 0);
    let mut moment = 0;
    loop {
        let mut new = Vec::new();
        for operator in 0..task.operators() {
            let needs = task.preconditions.get(operator);
            if operators[operator] == u32::MAX && needs.iter().all(|&f| facts[task.id(f) as usize] <= moment)
            {
                operators[operator] = moment;
                new.extend(task.effects.get(operator).iter().map(|effect| task.id(effect.fact)));
            }
        }
        new.retain(|&fact| facts[fact as usize] == u32::MAX);
        if new.is_empty() {
            return (facts, operators);
        }
        moment += 1;
        new.into_iter().for_each(|fact| facts[fact as usize] = moment);
    }
}
