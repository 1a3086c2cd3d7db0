//! Search over happenings with linear programs (COLIN; Coles, Coles, Fox and Long 2012): times,
//! durations and numbers are chosen together, and a sequence of happenings is kept while its linear
//! program is feasible.
//!
//! The other searches only try some durations of each action, and evaluate continuously changing
//! numbers only at the ends of actions. This search is slower, because its heuristic knows only the
//! range of each number, and its exhaustion proves nothing.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::FxHashSet;

use crate::calls::Failure;
use crate::ground::{
    Change, Conjunction, GroundEffect, GroundOutcome, GroundWhen, NumericId, Relation, Values,
};
use crate::plan::EPSILON_S;
use crate::validate::validate;

use super::advance::TemporalStep;
use super::estimate::{From, Key};
use super::program::{Linear, Program};
use super::relaxed::Relaxed;
use super::space::{Measure, Space};
use super::timed::{Timed, to_plan};
use super::world::{Act, DurationRange, World};

/// Maximum number of evaluated states.
const MOST_EVALUATED: u64 = 1_500;
/// Maximum number of time-dependent numbers whose ranges are computed for the heuristic.
const MOST_RANGES: usize = 8;
/// Cost of a state without a relaxed plan, which may still lead to the goal with other values of its
/// numbers.
const FAR: f64 = 1e9;
/// Maximum sum over all linear programs of the squared number of constraints: some seconds of
/// computation.
const MOST_WORK: u64 = 10_000_000;
/// Maximum memory of all states together, in bytes.
const MOST_BYTES: u64 = 100 << 20;
/// Number of evaluations, besides as many as the first plan took, that are spent on better plans.
const MORE: u64 = 100;
/// Minimum difference of the measure at which a plan counts as better.
const TOLERANCE: f64 = 1e-6;
/// Weight of the makespan, as a tie-breaker, in a metric without it.
const TIME_WEIGHT: f64 = 1e-4;

/// True if the task has no attachments, so that its numbers may fit linear programs.
pub(super) fn is_linear(world: &World) -> bool {
    world.ground.calls.is_empty() && !world.proposes
}

/// Best plan found with a measure below the bound, `None` if none, and the number of evaluated states.
pub(super) fn linear_plan(
    space: &Space,
    relaxed: &mut Relaxed,
    bound: f64,
    evaluations: u64,
    stop: &dyn Fn() -> bool,
) -> Result<(Option<Vec<Timed>>, u64), Failure> {
    let ground = space.world.ground;
    let rules_compare = ground.axioms.iter().any(|axiom| !axiom.body.comparisons.is_empty());
    let mut search = Search {
        space,
        rules_compare,
        relaxed,
        bound,
        nodes: Vec::new(),
        seen: FxHashSet::default(),
        evaluated: 0,
        work: 0,
    };
    let bytes = size_of::<Node>()
        + ground.variables.len() * 2 * size_of::<u32>()
        + ground.numerics.len() * (size_of::<Linear>() + size_of::<[i64; 3]>());
    let plan = search.run(evaluations.min(MOST_EVALUATED).min(MOST_BYTES / bytes as u64), stop)?;
    Ok((plan, search.evaluated))
}

/// An action in progress.
#[derive(Debug, Clone)]
struct Running {
    act: u32,
    end: u32,
    duration: Linear,
    /// Numbers that the action changes continuously, with the change per second.
    rates: Vec<(NumericId, f64)>,
}

/// Sequence of happenings with the state that it leads to.
#[derive(Debug, Clone)]
struct Node {
    /// Facts of the state; its numbers are in `numbers`.
    state: Values,
    numbers: Vec<Linear>,
    open: Vec<Running>,
    timed: usize,
    costs: Option<Linear>,
    /// Time variable of the last happening; `None` before the first.
    last: Option<u32>,
    /// Time variable of the last start or end of an action; `None` before the first.
    last_own: Option<u32>,
    program: Program,
    /// Actions with the time variables of their start and their end; no end for instantaneous ones.
    steps: Vec<(u32, u32, Option<u32>)>,
}

/// Happening that can come next: start of an action, end of an action in progress by its position, or
/// timed literal.
#[derive(Debug, Clone, Copy)]
enum Next {
    Start(u32),
    End(usize),
    Given,
}

/// Key for recognising equal nodes: facts, actions in progress, number of past timed literals, and
/// ranges of the numbers and of time.
type Seen = (Vec<u32>, Vec<u32>, usize, Vec<[i64; 2]>);

struct Search<'s, 'w, 'a> {
    space: &'s Space<'w, 'a>,
    relaxed: &'s mut Relaxed,
    /// True if derived facts depend on numbers.
    rules_compare: bool,
    bound: f64,
    nodes: Vec<Node>,
    seen: FxHashSet<Seen>,
    evaluated: u64,
    /// Sum over all linear programs so far of the squared number of constraints.
    work: u64,
}

impl<'w, 'a> Search<'_, 'w, 'a> {
    fn run(&mut self, mut evaluations: u64, stop: &dyn Fn() -> bool) -> Result<Option<Vec<Timed>>, Failure> {
        let state = self.space.world.initial()?;
        let numbers = state.numbers.iter().map(|&number| Linear::constant(number)).collect();
        let begin = Node {
            state,
            numbers,
            open: Vec::new(),
            timed: 0,
            costs: Some(Linear::constant(0.0)),
            last: None,
            last_own: None,
            program: Program::default(),
            steps: Vec::new(),
        };
        let (mut queue, mut best) = (BinaryHeap::new(), None);
        self.keep(begin, &mut queue)?;
        while let Some(Reverse((_, index))) = queue.pop() {
            let node = self.nodes[index as usize].clone();
            if let Some((measured, plan)) = self.plan(&node)? {
                if best.is_none() {
                    evaluations = evaluations.min(2 * self.evaluated + MORE);
                }
                self.bound = measured;
                best = Some(plan);
            }
            for next in self.successors(&node) {
                if self.evaluated >= evaluations || self.work >= MOST_WORK || stop() {
                    return Ok(best);
                }
                if let Some(made) = self.after(&node, next)? {
                    self.keep(made, &mut queue)?;
                }
            }
        }
        Ok(best)
    }

    /// Evaluates a node and puts it into the queue, unless it is infeasible, too late or already known.
    fn keep(&mut self, node: Node, queue: &mut BinaryHeap<Reverse<(Key, u32)>>) -> Result<(), Failure> {
        self.evaluated += 1;
        self.work += (node.program.rows() as u64 + 1).pow(2);
        let Some((now_s, states)) = states(&node) else { return Ok(()) };
        if matches!(self.space.measure, Measure::Makespan) && now_s >= self.bound {
            return Ok(());
        }
        let ends = [&states[states.len().saturating_sub(2)], &states[states.len() - 1]];
        let rounded = |number: f64| (number * 1e3).round() as i64;
        let ranges = (0..node.numbers.len()).map(|number| ends.map(|state| rounded(state.numbers[number])));
        let ranges = ranges.chain([[rounded(now_s); 2]]);
        let open: Vec<u32> = node.open.iter().map(|running| running.act).collect();
        let seen = (node.state.values.clone(), open.clone(), node.timed, ranges.collect());
        if !self.seen.insert(seen) {
            return Ok(());
        }
        let mut cost = FAR;
        for state in &states {
            let from = From { state, open: &open, ready_s: None };
            if let Some(estimate) = self.relaxed.estimate(self.space.world, &from)? {
                cost = cost.min(estimate.cost);
            }
        }
        self.nodes.push(node);
        queue.push(Reverse((Key(cost), self.nodes.len() as u32 - 1)));
        Ok(())
    }

    fn successors(&self, node: &Node) -> Vec<Next> {
        let world = self.space.world;
        let given = (node.timed < world.ground.timed.len()).then_some(Next::Given);
        let running = |act: u32| node.open.iter().any(|open| open.act == act);
        let starts = self.space.candidates(&node.state).into_iter();
        let starts = starts.filter(|&act| world.acts[act as usize].share == 0.0 && !running(act));
        (0..node.open.len()).map(Next::End).chain(given).chain(starts.map(Next::Start)).collect()
    }

    /// Node after one more happening; `None` if the happening is inapplicable or cannot be expressed
    /// linearly.
    fn after(&self, node: &Node, next: Next) -> Result<Option<Node>, Failure> {
        let mut made = node.clone();
        let happens = match next {
            Next::Start(act) => made.start(self.space.world, act),
            Next::End(position) => made.end(self.space.world, position),
            Next::Given => made.given(self.space.world),
        };
        if happens.is_none() {
            return Ok(None);
        }
        if self.rules_compare {
            // Rules see the numbers of the earliest time. Where these come out otherwise, the plan is not valid, and is dropped.
            let now = made.last.map_or(Linear::constant(0.0), Linear::variable);
            let Some(values) = made.program.minimised(&now) else { return Ok(None) };
            made.state.numbers = made.numbers.iter().map(|number| number.value(&values)).collect();
        }
        self.space.world.derive(&mut made.state)?;
        Ok(made.goes_on(self.space.world).then_some(made))
    }

    /// Plan of a node with its measure, if the goal holds after the last timed literal and the plan is
    /// valid and better than the bound; else `None`.
    fn plan(&self, node: &Node) -> Result<Option<(f64, Vec<Timed>)>, Failure> {
        if !node.open.is_empty() {
            return Ok(None);
        }
        let mut last = node.clone();
        while last.timed < self.space.world.ground.timed.len() {
            let Some(next) = self.after(&last, Next::Given)? else { return Ok(None) };
            last = next;
        }
        if !last.asks(self.space.world, &self.space.world.ground.goal, None) {
            return Ok(None);
        }
        let makespan = last.last_own.map_or(Linear::constant(0.0), Linear::variable);
        let objective = self.objective(&last, &makespan);
        let solved = objective.and_then(|objective| last.program.minimised(&objective));
        let Some(values) = solved.or_else(|| last.program.minimised(&makespan)) else { return Ok(None) };
        let world = self.space.world;
        let timed = last.steps.iter().map(|&(act, start, end)| {
            let start_s = values[start as usize];
            let duration_s = end.map_or(0.0, |end| values[end as usize] - start_s);
            let span = DurationRange { least_s: duration_s, most_s: duration_s };
            Timed { step: TemporalStep { span, ..TemporalStep::whole(act) }, start_s, duration_s }
        });
        let timed: Vec<Timed> = timed.collect();
        let verdict = validate(world.task, world.calls.attachments(), &to_plan(world, &timed));
        let sign = if world.ground.metric.as_ref().is_none_or(|metric| metric.minimise) { 1.0 } else { -1.0 };
        let measured = match &self.space.measure {
            Measure::Makespan => verdict.makespan,
            _ => verdict.metric.map(|metric| sign * metric),
        };
        let measured = measured.unwrap_or(f64::INFINITY);
        let better = self.bound.is_infinite() || measured < self.bound - TOLERANCE;
        Ok((verdict.valid && better).then_some((measured, timed)))
    }

    /// Objective of the linear program: measure of plans, with a little of the makespan added; `None`
    /// if nonlinear.
    fn objective(&self, node: &Node, makespan: &Linear) -> Option<Linear> {
        match &self.space.measure {
            Measure::Makespan => Some(makespan.clone()),
            Measure::Additive { sign, time_weight } => {
                let costs = node.costs.as_ref()?.times(*sign);
                Some(costs.plus(time_weight.max(TIME_WEIGHT), makespan))
            }
            Measure::Expression(expression) => {
                let metric = Linear::of(expression, &node.numbers, None, Some(makespan))?;
                Some(metric.plus(TIME_WEIGHT, makespan))
            }
        }
    }
}

/// Earliest time of the last happening in seconds, and states of the node: at that time, and with
/// time-dependent numbers at their minimum and at their maximum. `None` if the program is infeasible.
fn states(node: &Node) -> Option<(f64, Vec<Values>)> {
    let now = node.last.map_or(Linear::constant(0.0), Linear::variable);
    let solution = node.program.minimised(&now)?;
    let now_s = now.value(&solution);
    let with = |value: &dyn Fn(usize, &Linear) -> f64| Values {
        values: node.state.values.clone(),
        numbers: node.numbers.iter().enumerate().map(|(index, number)| value(index, number)).collect(),
    };
    let mut states = vec![with(&|_, number| number.value(&solution))];
    let open: Vec<usize> =
        (0..node.numbers.len()).filter(|&index| node.numbers[index].as_constant().is_none()).collect();
    if open.is_empty() || open.len() > MOST_RANGES {
        return Some((now_s, states));
    }
    for sign in [1.0, -1.0] {
        let extreme = |number: &Linear| {
            let values = node.program.minimised(&number.times(sign));
            values.map_or(-sign * FAR, |values| number.value(&values))
        };
        states.push(with(&|_, number| number.as_constant().unwrap_or_else(|| extreme(number))));
    }
    Some((now_s, states))
}

impl Node {
    /// Advances time to a happening: over-all conditions must hold until then, and continuous effects
    /// are applied. `None` if infeasible.
    fn pass(&mut self, world: &World, now: u32) -> Option<()> {
        let now = Linear::variable(now);
        let Some(last) = self.last.map(Linear::variable) else { return Some(()) };
        let apart = last.plus(1.0, &Linear::constant(EPSILON_S));
        let mut holds = self.program.ask(&now, Relation::AtLeast, &apart) && self.holds_over_all(world);
        let elapsed = now.plus(-1.0, &last);
        let rates: Vec<(NumericId, f64)> = self.open.iter().flat_map(|open| open.rates.clone()).collect();
        for &(number, rate) in &rates {
            self.numbers[number as usize] = self.numbers[number as usize].plus(rate, &elapsed);
            self.numbers[number as usize].is_finite().then_some(())?;
        }
        holds &= rates.is_empty() || self.holds_over_all(world);
        holds.then_some(())
    }

    /// Advances time to the start or end of an action, before the next timed literal; `None` if
    /// infeasible.
    fn act(&mut self, world: &World, now: u32) -> Option<()> {
        if let Some(next) = world.ground.timed.get(self.timed) {
            let latest = Linear::constant(next.time_s - EPSILON_S);
            self.program.ask(&Linear::variable(now), Relation::AtMost, &latest).then_some(())?;
        }
        self.pass(world, now)
    }

    fn holds_over_all(&mut self, world: &World) -> bool {
        let open = self.open.clone();
        open.iter().all(|own| {
            let numbers = Conjunction { facts: Vec::new(), ..world.acts[own.act as usize].over_all.clone() };
            self.asks(world, &numbers, Some(&own.duration))
        })
    }

    fn start(&mut self, world: &World, act: u32) -> Option<()> {
        let own = &world.acts[act as usize];
        let now = self.program.variable(0.0, f64::INFINITY);
        self.act(world, now)?;
        let end = own.durative.then(|| self.program.variable(0.0, f64::INFINITY));
        let duration = end.map(|end| Linear::variable(end).plus(-1.0, &Linear::variable(now)));
        if let Some(duration) = &duration {
            let least = Linear::constant(EPSILON_S);
            let bounded = self.program.ask(duration, Relation::AtLeast, &least);
            (bounded && self.bounds(own, duration, false)).then_some(())?;
        }
        self.asks(world, own.at_start, duration.as_ref()).then_some(())?;
        let cost = Linear::of(own.cost, &self.numbers, duration.as_ref(), None);
        self.costs = self.costs.take().zip(cost).map(|(costs, cost)| costs.plus(1.0, &cost));
        self.apply(world, own.start_effects, duration.as_ref())?;
        self.steps.push((act, now, end));
        if let (Some(end), Some(duration)) = (end, duration) {
            self.open.push(Running { act, end, duration, rates: Vec::new() });
        }
        (self.last, self.last_own) = (Some(now), Some(now));
        Some(())
    }

    fn end(&mut self, world: &World, position: usize) -> Option<()> {
        let now = self.open[position].end;
        self.act(world, now)?;
        let Running { act, duration, .. } = self.open.remove(position);
        let own = &world.acts[act as usize];
        (self.bounds(own, &duration, true) && self.asks(world, own.at_end, Some(&duration))).then_some(())?;
        self.apply(world, own.end_effects, Some(&duration))?;
        (self.last, self.last_own) = (Some(now), Some(now));
        Some(())
    }

    fn given(&mut self, world: &World) -> Option<()> {
        let timed = world.ground.timed.get(self.timed)?;
        let now = self.program.variable(timed.time_s, timed.time_s);
        self.pass(world, now)?;
        let effects: Vec<GroundEffect> = timed
            .outcomes
            .iter()
            .map(|outcome| GroundEffect { when: None, outcome: outcome.clone() })
            .collect();
        self.apply(world, &effects, None)?;
        self.timed += 1;
        self.last = Some(now);
        Some(())
    }

    fn bounds(&mut self, act: &Act, duration: &Linear, at_end: bool) -> bool {
        act.bounds.iter().filter(|bound| bound.at_end == at_end).all(|bound| {
            let seconds = Linear::of(&bound.seconds, &self.numbers, None, None);
            seconds.is_some_and(|seconds| self.program.ask(duration, bound.relation, &seconds))
        })
    }

    /// Requires a condition of the present state; false if it cannot hold or is not linear.
    fn asks(&mut self, world: &World, condition: &Conjunction, duration: Option<&Linear>) -> bool {
        condition.calls.is_empty()
            && condition.facts.iter().all(|fact| self.state.values[fact.variable as usize] == fact.value)
            && condition.comparisons.iter().all(|&comparison| {
                let comparison = &world.ground.comparisons[comparison as usize];
                let side = |side| Linear::of(side, &self.numbers, duration, None);
                match (side(&comparison.left), side(&comparison.right)) {
                    (Some(left), Some(right)) => self.program.ask(&left, comparison.relation, &right),
                    _ => false,
                }
            })
    }

    fn apply(&mut self, world: &World, effects: &[GroundEffect], duration: Option<&Linear>) -> Option<()> {
        let before = self.clone();
        for effect in effects {
            if let Some(when) = &effect.when
                && !before.decides(world, when, duration)?
            {
                continue;
            }
            match &effect.outcome {
                GroundOutcome::Set(fact) => self.state.values[fact.variable as usize] = fact.value,
                GroundOutcome::Change { fluent, change, amount } => {
                    let amount = Linear::of(amount, &before.numbers, duration, None)?;
                    let number = &mut self.numbers[*fluent as usize];
                    *number = match change {
                        Change::Assign => amount,
                        Change::Increase => number.plus(1.0, &amount),
                        Change::Decrease => number.plus(-1.0, &amount),
                        Change::ScaleUp => number.times(amount.as_constant()?),
                        Change::ScaleDown => number.times(1.0 / amount.as_constant()?),
                    };
                    number.is_finite().then_some(())?;
                }
                GroundOutcome::Flow { .. } | GroundOutcome::Call(_) => return None,
            }
        }
        Some(())
    }

    /// Truth of an effect's condition; `None` if it depends on times or on earlier states.
    fn decides(&self, world: &World, when: &GroundWhen, duration: Option<&Linear>) -> Option<bool> {
        if !when.at_start.is_empty() || !when.over_all.is_empty() {
            return None;
        }
        let mut trial = self.clone();
        let holds = trial.asks(world, &when.here, duration);
        (!holds || trial.program.rows() == self.program.rows()).then_some(holds)
    }

    /// True if the over-all facts of all actions in progress hold, and their continuous effects have
    /// constant rates.
    fn goes_on(&mut self, world: &World) -> bool {
        let facts = |open: &Running| {
            let mut facts = world.acts[open.act as usize].over_all.facts.iter();
            facts.all(|fact| self.state.values[fact.variable as usize] == fact.value)
        };
        if !self.open.iter().all(facts) {
            return false;
        }
        let rate = |effect: &GroundEffect| match &effect.outcome {
            GroundOutcome::Flow { fluent, rate } if effect.when.is_none() => {
                let rate = Linear::of(rate, &self.numbers, None, None)?.as_constant()?;
                Some((*fluent, rate))
            }
            _ => None,
        };
        let rates = |open: &Running| world.acts[open.act as usize].flow_effects.iter().map(rate).collect();
        let rates: Option<Vec<_>> = self.open.iter().map(rates).collect();
        let Some(rates) = rates else { return false };
        self.open.iter_mut().zip(rates).for_each(|(open, rates)| open.rates = rates);
        true
    }
}
