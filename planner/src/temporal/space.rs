//! Search space that several searches of one task share: applicable steps, accessed resources, and
//! measure of plans.

use std::hash::{Hash, Hasher};
use std::sync::Arc;

use rustc_hash::FxHasher;

use crate::attachment::Level;
use crate::calls::Failure;
use crate::ground::{Change, Earns, GroundExpression, GroundOutcome, Values, added, weights};

use super::advance::{Accesses, Part, Situation, TemporalStep};
use super::order::{Clock, Inconsistent, Order};
use super::timed::is_valid;
use super::world::{Act, DurationRange, EvaluationContext, World};

/// Maximum number of replays of a plan in which longer durations make further actions longer.
const MOST_STRETCHED: usize = 8;
/// Difference of times, in seconds, up to which an action does not count as longer than its shortest
/// duration.
const LEAST_STRETCH_S: f64 = 1e-7;
/// Number of replayed steps between two checks of the stop signal.
const STEPS_A_LOOK: usize = 256;

/// Measure of plans; lower is better.
#[derive(Debug, Clone)]
pub enum Measure {
    /// End of the last action, in seconds.
    Makespan,
    /// Sum of action costs times a sign, plus the makespan times a weight.
    Additive {
        /// 1 to minimise action costs, -1 to maximise them.
        sign: f64,
        /// Weight of the makespan, per second.
        time_weight: f64,
    },
    /// Expression over the final state and the makespan, to be minimised.
    Expression(GroundExpression),
}

impl Measure {
    /// Tells if actions can improve the measure.
    fn earns(&self, world: &World) -> Earns {
        let expression = match self {
            Measure::Makespan => return Earns::Never,
            Measure::Additive { .. } => {
                return world.ground.metric.as_ref().map_or(Earns::Never, |metric| metric.earns);
            }
            Measure::Expression(expression) => expression,
        };
        let Some((weights, time)) = weights(expression, world.ground.numerics.len()) else {
            return Earns::Perhaps;
        };
        if time < 0.0 {
            return Earns::Surely;
        }
        let acts = world.acts.iter();
        let effects = acts.flat_map(|act| [act.start_effects, act.flow_effects, act.end_effects]).flatten();
        let given = world.ground.timed.iter().flat_map(|timed| &timed.outcomes);
        let earns = |outcome: &GroundOutcome| match outcome {
            GroundOutcome::Set(_) => Earns::Never,
            GroundOutcome::Change { fluent, change, amount } => {
                added(*change, amount, weights[*fluent as usize])
            }
            GroundOutcome::Flow { fluent, rate } => added(Change::Increase, rate, weights[*fluent as usize]),
            GroundOutcome::Call(_) => Earns::Perhaps,
        };
        effects.map(|effect| &effect.outcome).chain(given).map(earns).max().unwrap_or(Earns::Never)
    }

    /// Contribution of each action to the plan measure apart from the makespan, in equivalent seconds
    /// of makespan; `None` if the action contributes nothing, the makespan does not count, or the
    /// measure is nonlinear.
    pub fn counted(&self, world: &World) -> Vec<Option<GroundExpression>> {
        let times = |factor: f64, of: &GroundExpression| {
            GroundExpression::Product(vec![GroundExpression::Constant(factor), of.clone()])
        };
        let (weights, time) = match self {
            Measure::Additive { sign, time_weight } if *time_weight > 0.0 => {
                return world.acts.iter().map(|act| Some(times(sign / time_weight, act.cost))).collect();
            }
            Measure::Expression(expression) => {
                let linear = weights(expression, world.ground.numerics.len());
                linear.filter(|(_, time)| *time > 0.0).unwrap_or_default()
            }
            _ => Default::default(),
        };
        let counted = |act: &Act| {
            let changes =
                act.start_effects.iter().chain(act.end_effects).filter(|effect| effect.when.is_none());
            let terms = changes.filter_map(|effect| match &effect.outcome {
                GroundOutcome::Change { fluent, change, amount } => {
                    let weight = weights.get(*fluent as usize).filter(|weight| **weight != 0.0)?;
                    match change {
                        Change::Increase => Some(times(weight / time, amount)),
                        Change::Decrease => Some(times(-weight / time, amount)),
                        _ => None,
                    }
                }
                _ => None,
            });
            let terms: Vec<GroundExpression> = terms.collect();
            (!terms.is_empty()).then_some(GroundExpression::Sum(terms))
        };
        world.acts.iter().map(counted).collect()
    }
}

/// Search space of a task, with data that several searches share.
pub struct Space<'w, 'a> {
    /// Task with its actions.
    pub world: &'w World<'a>,
    /// True, by action, if start and end are separate steps.
    pub open_act: Vec<bool>,
    /// Measure of plans.
    pub measure: Measure,
    /// Resources accessed by happenings.
    pub accesses: Accesses<'w, 'a>,
    /// Actions grouped by their rarest fact at start, by that fact's variable and value.
    pivots: Vec<Vec<Vec<u32>>>,
    /// Actions without facts at start.
    everywhere: Vec<u32>,
    /// True if times can make a sequence of steps impossible.
    pub tight: bool,
    /// Tells if actions can improve the measure. Unless they surely can, a plan prefix that is no better
    /// than the bound is pruned.
    pub earns: Earns,
    /// True if effects or costs of some action depend on its chosen duration.
    stretches: bool,
    /// True if `stretches`, or if numbers change continuously: the effects of a plan are then known
    /// only with its times.
    pub is_open: bool,
}

impl<'w, 'a> Space<'w, 'a> {
    /// Steps in order of their times, so that a prefix of them is what happens until some time. The order
    /// may be invalid as a sequence of compressed steps, because an action that starts early may end late.
    pub(super) fn in_time_order(&self, steps: &[TemporalStep]) -> Vec<TemporalStep> {
        let Ok(track) = self.track(steps) else { return steps.to_vec() };
        let mut starts: Vec<usize> = Vec::new();
        let mut timed: Vec<(f64, &TemporalStep)> = Vec::with_capacity(steps.len());
        let mut given = self.world.ground.timed.iter();
        for (index, step) in steps.iter().enumerate() {
            let own = track.actions[index];
            let time_s = match step.part {
                Part::Free => given.next().map_or(0.0, |timed| timed.time_s),
                Part::Whole | Part::Start => {
                    starts.extend((step.part == Part::Start).then_some(index));
                    own.map_or(0.0, |(start, _)| track.order.earliest_s(start))
                }
                Part::End => {
                    let same = |&start: &usize| {
                        steps[start].act == step.act && steps[start].proposal == step.proposal
                    };
                    let start = starts.iter().position(same).map(|position| starts.remove(position));
                    let end = start.and_then(|start| track.actions[start]).and_then(|(_, end)| end);
                    end.map_or(0.0, |end| track.order.earliest_s(end))
                }
            };
            timed.push((time_s, step));
        }
        timed.sort_by(|one, other| one.0.total_cmp(&other.0));
        timed.into_iter().map(|(_, step)| step.clone()).collect()
    }

    /// Search space in which the actions marked in `open_act` have separate starts and ends.
    pub fn new(world: &'w World<'a>, open_act: Vec<bool>, measure: Measure) -> Space<'w, 'a> {
        let ground = world.ground;
        let mut pivots: Vec<Vec<Vec<u32>>> =
            ground.variables.iter().map(|variable| vec![Vec::new(); variable.values.len()]).collect();
        let mut asked: Vec<Vec<u32>> =
            ground.variables.iter().map(|variable| vec![0; variable.values.len()]).collect();
        for fact in world.acts.iter().flat_map(|act| &act.at_start.facts) {
            asked[fact.variable as usize][fact.value as usize] += 1;
        }
        let mut everywhere = Vec::new();
        for (index, act) in world.acts.iter().enumerate() {
            let rarest = act
                .at_start
                .facts
                .iter()
                .min_by_key(|fact| asked[fact.variable as usize][fact.value as usize]);
            match rarest {
                Some(fact) => pivots[fact.variable as usize][fact.value as usize].push(index as u32),
                None => everywhere.push(index as u32),
            }
        }
        let accesses = Accesses::new(world);
        let tight = open_act.contains(&true) || !ground.timed.is_empty();
        let earns = measure.earns(world);
        let stretches = world.acts.iter().any(Act::is_read_off);
        let is_open = stretches || world.acts.iter().any(|act| !act.flow_effects.is_empty());
        Space { world, open_act, measure, accesses, pivots, everywhere, tight, earns, stretches, is_open }
    }

    /// Actions whose facts at start hold in a state, in ascending order.
    pub fn candidates(&self, state: &Values) -> Vec<u32> {
        let pivots = &self.pivots;
        let by_fact =
            state.values.iter().enumerate().flat_map(|(variable, &value)| &pivots[variable][value as usize]);
        let fits = |act: &&u32| {
            let facts = &self.world.acts[**act as usize].at_start.facts;
            facts.iter().all(|fact| state.values[fact.variable as usize] == fact.value)
        };
        let mut found: Vec<u32> = by_fact.chain(&self.everywhere).filter(fits).copied().collect();
        found.sort_unstable();
        found
    }

    /// True if a shorter makespan improves a plan, other things being equal.
    pub fn counts_time(&self) -> bool {
        self.time_weight() > 0.0
    }

    /// Weight of a second of makespan in the measure; 0 if it is not known.
    pub fn time_weight(&self) -> f64 {
        match self.measure {
            Measure::Makespan => 1.0,
            Measure::Additive { time_weight, .. } => time_weight,
            Measure::Expression(_) => 0.0,
        }
    }

    /// Schedule of the compressed actions among some steps.
    pub fn clock(&self, steps: &[TemporalStep]) -> Clock {
        let mut clock = Clock::new(self.accesses.resources);
        steps.iter().filter(|step| step.part == Part::Whole).for_each(|step| self.tick(&mut clock, step));
        clock
    }

    /// Appends a compressed action to a schedule.
    pub fn tick(&self, clock: &mut Clock, step: &TemporalStep) {
        let (start, end) = self.accesses.of(step.act);
        clock.push(start, end.as_ref().map(|end| (end, step.span)));
    }

    /// Temporal network without steps.
    pub fn begin(&self) -> Track {
        Track::new(self.accesses.resources)
    }

    /// True if the measure of a partial plan depends on its times.
    pub fn timed_measure(&self) -> bool {
        match &self.measure {
            Measure::Makespan => true,
            Measure::Additive { time_weight, .. } => *time_weight != 0.0,
            Measure::Expression(_) => true,
        }
    }

    /// Temporal network of a sequence of steps.
    pub fn track(&self, steps: &[TemporalStep]) -> Result<Track, Inconsistent> {
        let mut track = self.begin();
        steps.iter().try_for_each(|step| track.push(self, step))?;
        Ok(track)
    }

    /// Contribution of a step to an additive measure; 0 for other measures.
    pub fn step_cost(&self, before: &Values, step: &TemporalStep) -> Result<f64, Failure> {
        let Measure::Additive { sign, .. } = self.measure else { return Ok(0.0) };
        if matches!(step.part, Part::End | Part::Free) {
            return Ok(0.0);
        }
        let moment = EvaluationContext {
            state: before,
            duration_s: step.span.least_s,
            proposal: step.proposal.as_ref(),
            level: Level::Exact,
        };
        Ok(sign * self.world.evaluate(self.world.acts[step.act as usize].cost, &moment)?)
    }

    /// Measure of a plan or prefix, from its sum of costs, its final state and its makespan in seconds.
    pub fn measured(&self, costs: f64, state: &Values, makespan_s: f64) -> Result<f64, Failure> {
        match &self.measure {
            Measure::Makespan => Ok(makespan_s),
            Measure::Additive { time_weight, .. } => Ok(costs + time_weight * makespan_s),
            Measure::Expression(expression) => {
                let moment =
                    EvaluationContext { state, duration_s: 0.0, proposal: None, level: Level::Exact };
                let timed = with_total_time(expression, makespan_s);
                self.world.evaluate(&timed, &moment)
            }
        }
    }

    /// Replays a sequence of steps from the initial state; returns its measure, and the situation at
    /// its end. `None` if a step is inapplicable, the times are inconsistent, or a long sequence is
    /// stopped.
    pub fn replay(
        &self,
        steps: &mut [TemporalStep],
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<(f64, Base)>, Failure> {
        let mut situation = Situation { state: self.world.initial()?, open: Vec::new(), timed: 0 };
        let mut costs = 0.0;
        let stops = |index: usize| index % STEPS_A_LOOK == STEPS_A_LOOK - 1 && stop();
        for (index, step) in steps.iter_mut().enumerate() {
            let next = if stops(index) { None } else { self.world.advance(&situation, step)? };
            let Some(next) = next else { return Ok(None) };
            costs += self.step_cost(&situation.state, step)?;
            situation = next;
        }
        // Most sequences do not work out: times are looked at in those that do.
        let mut track = self.begin();
        for (index, step) in steps.iter().enumerate() {
            if stops(index) || track.push(self, step).is_err() {
                return Ok(None);
            }
        }
        let measured = self.measured(costs, &situation.state, track.order.makespan_s())?;
        let clock = self.clock(steps);
        Ok(Some((measured, Base { situation, costs, track, clock })))
    }

    /// Replays a whole plan; `None` also if the goal does not hold at its end. If the schedule makes an
    /// action longer whose effects depend on its duration, the effects of the longer duration are used.
    pub fn replay_to_goal(
        &self,
        steps: &mut [TemporalStep],
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<(f64, Base)>, Failure> {
        steps.iter_mut().for_each(|step| step.taken_s = None);
        let Some((mut measured, mut base)) = self.replay(steps, stop)? else { return Ok(None) };
        for _ in 0..MOST_STRETCHED {
            if !self.stretches || !self.stretch(steps, &base.track) {
                break;
            }
            let Some(replayed) = self.replay(steps, stop)? else { return Ok(None) };
            (measured, base) = replayed;
        }
        if self.stretches && self.stretch(steps, &base.track) {
            return Ok(None);
        }
        if !self.world.is_goal(&base.situation)? || base.track.clone().pass_timed(self).is_err() {
            return Ok(None);
        }
        if base.situation.timed < self.world.ground.timed.len()
            && let Some(ended) = self.world.ended(&base.situation)?
        {
            measured = self.measured(base.costs, &ended.state, base.track.order.makespan_s())?;
        }
        Ok((!self.is_open || is_valid(self, steps, stop)).then_some((measured, base)))
    }

    /// Sets the duration of actions that the schedule makes longer, if their effects or costs depend on
    /// it; true if any was set.
    fn stretch(&self, steps: &mut [TemporalStep], track: &Track) -> bool {
        let mut any = false;
        for (step, action) in steps.iter_mut().zip(&track.actions) {
            let Some((start, Some(end))) = *action else { continue };
            let taken_s = track.order.earliest_s(end) - track.order.earliest_s(start);
            let is_longer = taken_s > step.span.least_s + LEAST_STRETCH_S;
            if is_longer && step.taken_s.is_none() && self.world.acts[step.act as usize].is_read_off() {
                step.taken_s = Some((taken_s * 1e6).round() / 1e6);
                any = true;
            }
        }
        any
    }
}

/// Starting point of a search: the situation after some steps.
#[derive(Debug, Clone)]
pub struct Base {
    /// State, actions in progress, and number of past timed literals.
    pub situation: Situation,
    /// Sum of costs so far, for an additive measure.
    pub costs: f64,
    /// Temporal network of the steps so far.
    pub track: Track,
    /// Earliest schedule of the steps so far; used if times cannot make a sequence impossible.
    pub clock: Clock,
}

/// Temporal network of a sequence of steps, with the starts and ends of its actions.
#[derive(Debug, Clone)]
pub struct Track {
    /// Network of the happenings.
    pub order: Order,
    /// Happenings of each step: the start and, once known, the end of its action; `None` for steps that
    /// end an action, and for timed literals.
    pub actions: Vec<Option<(u32, Option<u32>)>>,
    /// First happening since which some action has been in progress without interruption.
    epoch: usize,
    open: Vec<Started>,
    timed: usize,
}

/// An action in progress.
#[derive(Debug, Clone)]
struct Started {
    step: usize,
    act: u32,
    proposal: Option<Arc<str>>,
    start: u32,
    span: DurationRange,
}

impl Track {
    fn new(resources: usize) -> Track {
        Track { order: Order::new(resources), actions: Vec::new(), epoch: 0, open: Vec::new(), timed: 0 }
    }

    /// Appends a step; fails if the times become inconsistent.
    pub fn push(&mut self, space: &Space, step: &TemporalStep) -> Result<(), Inconsistent> {
        let mut action = None;
        match step.part {
            Part::Free => {
                self.order.push_fixed(
                    &space.accesses.timed[self.timed],
                    space.world.ground.timed[self.timed].time_s,
                )?;
                self.timed += 1;
            }
            Part::Whole => {
                let (start, end) = space.accesses.of(step.act);
                let node = self.order.push(start);
                let end = end.as_ref().map(|end| self.order.push_end(node, end, step.span)).transpose()?;
                action = Some((node, end));
            }
            Part::Start => {
                let start = self.order.push(&space.accesses.of(step.act).0);
                let (act, proposal, span) = (step.act, step.proposal.clone(), step.span);
                self.open.push(Started { step: self.actions.len(), act, proposal, start, span });
                action = Some((start, None));
            }
            Part::End => {
                let same = |open: &Started| open.act == step.act && open.proposal == step.proposal;
                if let Some(position) = self.open.iter().position(same) {
                    let open = self.open.remove(position);
                    self.end(space, &open)?;
                }
            }
        }
        self.actions.push(action);
        if self.open.is_empty() {
            self.epoch = self.order.len();
        }
        Ok(())
    }

    /// Hash of all past times on which the future can depend; 0 if there are none.
    ///
    /// Without actions in progress and timed literals to come, everything that follows can be shifted
    /// in time. An action in progress must end after everything that its end has to follow, yet within
    /// its duration: this depends on the minimum delay of the last accesses to each resource after its
    /// start, as far as its longest duration reaches. With timed literals to come, absolute times
    /// matter up to the last of them.
    pub fn mark(&self, space: &Space) -> u64 {
        let last_s =
            space.world.ground.timed.get(self.timed..).and_then(<[_]>::last).map(|timed| timed.time_s);
        if self.open.is_empty() && last_s.is_none() {
            return 0;
        }
        let mut hasher = FxHasher::default();
        for open in &self.open {
            let after_s = self.order.after_s(open.start, self.epoch);
            let within =
                |time_s: f64| if open.span.most_s.is_finite() { time_s.min(open.span.most_s) } else { 0.0 };
            let since = |node: u32| {
                let inner = (node as usize).checked_sub(self.epoch);
                inner.map_or(f64::NEG_INFINITY, |inner| within(after_s[inner]))
            };
            self.order.touched(since).for_each(|times_s| times_s.map(f64::to_bits).hash(&mut hasher));
            self.open.iter().for_each(|other| since(other.start).to_bits().hash(&mut hasher));
            let latest_s = self.order.latest_s(&after_s, self.epoch);
            latest_s.to_bits().hash(&mut hasher);
        }
        if let Some(last_s) = last_s {
            let clamped = |node: u32| self.order.earliest_s(node).min(last_s);
            self.order.touched(clamped).for_each(|times_s| times_s.map(f64::to_bits).hash(&mut hasher));
            self.open.iter().for_each(|open| clamped(open.start).to_bits().hash(&mut hasher));
        }
        hasher.finish() | 1
    }

    /// Ends all actions in progress as early as possible; fails if the times become inconsistent.
    pub fn close(&mut self, space: &Space) -> Result<(), Inconsistent> {
        let open = std::mem::take(&mut self.open);
        open.iter().try_for_each(|open| self.end(space, open))
    }

    fn end(&mut self, space: &Space, open: &Started) -> Result<(), Inconsistent> {
        let Some(access) = &space.accesses.of(open.act).1 else { return Ok(()) };
        let end = self.order.push_end(open.start, access, open.span)?;
        self.actions[open.step] = Some((open.start, Some(end)));
        Ok(())
    }

    /// Appends all timed literals still to come; fails if the times become inconsistent.
    pub fn pass_timed(&mut self, space: &Space) -> Result<(), Inconsistent> {
        for (access, timed) in space.accesses.timed.iter().zip(&space.world.ground.timed).skip(self.timed) {
            self.order.push_fixed(access, timed.time_s)?;
        }
        Ok(())
    }

    /// Start of the action in progress that started last, in seconds; `None` if no action is in
    /// progress.
    pub fn latest_open_s(&self) -> Option<f64> {
        self.open.iter().map(|open| self.order.earliest_s(open.start)).max_by(f64::total_cmp)
    }
}

fn with_total_time(expression: &GroundExpression, makespan_s: f64) -> GroundExpression {
    let inner = |inner: &GroundExpression| with_total_time(inner, makespan_s);
    match expression {
        GroundExpression::TotalTime => GroundExpression::Constant(makespan_s),
        GroundExpression::Sum(parts) => GroundExpression::Sum(parts.iter().map(inner).collect()),
        GroundExpression::Product(parts) => GroundExpression::Product(parts.iter().map(inner).collect()),
        GroundExpression::Difference(left, right) => {
            GroundExpression::Difference(Box::new(inner(left)), Box::new(inner(right)))
        }
        GroundExpression::Quotient(left, right) => {
            GroundExpression::Quotient(Box::new(inner(left)), Box::new(inner(right)))
        }
        GroundExpression::Negative(operand) => GroundExpression::Negative(Box::new(inner(operand))),
        other => other.clone(),
    }
}
