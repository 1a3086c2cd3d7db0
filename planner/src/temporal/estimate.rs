//! Relaxed-plan heuristic of the temporal search.
//!
//! Labels spread from the facts of a state through operators to the goal. A label is either a sum of
//! costs (additive heuristic; Bonet and Geffner 2001) or a time: the latest time among the
//! preconditions, counted from when the resources used by the plan so far are free again, so that idle
//! resources are preferred to busy ones. A relaxed plan is extracted along the best supporters (Keyder
//! and Geffner 2008). An operator supports a test (a numeric condition or call) if, applied alone in
//! the evaluated state, it makes the test true or brings the compared numbers closer; it then counts as
//! often as it must be repeated (compare Hoffmann 2003, Scala et al. 2016).

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::sync::Arc;

use crate::attachment::Level;
use crate::calls::Failure;
use crate::ground::{Change, GroundEffect, GroundExpression, GroundOutcome, Values};

use super::advance::Part;
use super::relaxed::{NOBODY, Operator, Relaxed, Seconds, Test, Waiter};
use super::world::{EvaluationContext, World};

/// Estimate of the distance from a state to the goal.
#[derive(Debug, Clone, Default)]
pub(crate) struct Estimate {
    /// Sum of the costs of the operators in the relaxed plan.
    pub cost: f64,
    /// Earliest time at which the goal could hold, in seconds from the beginning of the plan; a sum of
    /// costs if times do not count.
    pub finish_s: f64,
    /// Operators of the relaxed plan whose preconditions hold in the state.
    pub preferred: Vec<(u32, Part)>,
    /// Operators of the relaxed plan, in an order in which the relaxation can apply them.
    pub plan: Vec<(u32, Part)>,
}

/// State to estimate from.
pub(crate) struct From<'f> {
    /// Facts and numbers of the state.
    pub state: &'f Values,
    /// Actions in progress.
    pub open: &'f [u32],
    /// Time from which each resource is free, in seconds; `None` to add costs instead of estimating
    /// times.
    pub ready_s: Option<&'f [f64]>,
}

/// Working memory of the heuristic.
#[derive(Debug, Default)]
pub(super) struct Work {
    labels: Vec<f64>,
    supporters: Vec<(u32, f32)>,
    wanted: Vec<bool>,
    /// Progress of each operator that has more than one precondition.
    waiting: Vec<Waiting>,
    /// Label (cost or time) of the preconditions, and own cost, of each operator that was used.
    fired: Vec<(f64, f64)>,
    queue: BinaryHeap<Reverse<(Key, u32)>>,
    evaluation: u32,
    goal: Vec<u32>,
    /// Greatest label (cost or time) among the goals; recomputed if `nearer` is true.
    latest: f64,
    nearer: bool,
    /// Lower bounds from each proposition to the goal, in costs and in seconds; empty until needed.
    remaining: [Vec<f64>; 2],
    /// Longest duration found for any operator so far, in seconds.
    dearest_s: f64,
    /// Number of propositions and operators visited: a deterministic measure of work.
    pub(super) spent: u64,
}

/// Preconditions of an operator reached so far in an evaluation.
#[derive(Debug, Clone, Copy, Default)]
struct Waiting {
    /// Evaluation to which the other fields belong; in any other evaluation, nothing is reached yet.
    evaluation: u32,
    missing: u32,
    base: f64,
}

impl Work {
    pub(super) fn new(propositions: usize, operators: usize) -> Work {
        Work {
            labels: vec![f64::INFINITY; propositions],
            supporters: vec![(NOBODY, 1.0); propositions],
            wanted: vec![false; propositions],
            waiting: vec![Waiting::default(); operators],
            fired: vec![(0.0, 0.0); operators],
            queue: BinaryHeap::new(),
            evaluation: 0,
            goal: Vec::new(),
            latest: f64::INFINITY,
            nearer: false,
            remaining: [Vec::new(), Vec::new()],
            dearest_s: 0.0,
            spent: 0,
        }
    }

    /// Records that a precondition of an operator is reached, with its label. Returns the combined
    /// label of all preconditions once the last one is reached, else `None`.
    fn meet(&mut self, operator: u32, needs: u32, label: f64, timed: bool) -> Option<f64> {
        if needs == 1 {
            return Some(label);
        }
        let waiting = &mut self.waiting[operator as usize];
        if waiting.evaluation != self.evaluation {
            *waiting = Waiting { evaluation: self.evaluation, missing: needs, base: 0.0 };
        }
        waiting.base = if timed { waiting.base.max(label) } else { waiting.base + label };
        waiting.missing -= 1;
        (waiting.missing == 0).then_some(waiting.base)
    }

    /// Greatest label (cost or time) among the goals; propositions with greater labels are useless.
    fn latest(&mut self) -> f64 {
        if std::mem::take(&mut self.nearer) {
            let labels = self.goal.iter().map(|&need| self.labels[need as usize]);
            self.latest = labels.fold(0.0, f64::max);
        }
        self.latest
    }

    fn begin(&mut self) {
        self.labels.fill(f64::INFINITY);
        self.queue.clear();
        self.nearer = true;
        self.evaluation = self.evaluation.wrapping_add(1);
        if self.evaluation == 0 {
            self.waiting.fill(Waiting::default());
            self.evaluation = 1;
        }
    }

    fn reach(&mut self, proposition: u32, label: f64, supporter: u32, times: f64) {
        if label < self.labels[proposition as usize] {
            self.labels[proposition as usize] = label;
            self.supporters[proposition as usize] = (supporter, times as f32);
            self.nearer |= self.wanted[proposition as usize];
            self.queue.push(Reverse((Key(label), proposition)));
        }
    }
}

/// Label (cost or time) with a total order, for priority queues.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Key(pub(super) f64);

impl Eq for Key {}
impl PartialOrd for Key {
    fn partial_cmp(&self, other: &Key) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Key {
    fn cmp(&self, other: &Key) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Factor on the cost of an operator that may help a test only together with other changes.
const UNSURE: f64 = 3.0;

impl Relaxed {
    /// Estimate of the distance from a state to the goal; `None` if the goal is unreachable even in the
    /// relaxation.
    pub fn estimate(&mut self, world: &World, from: &From) -> Result<Option<Estimate>, Failure> {
        for &call in &self.goal_gates {
            if !world.calls.agrees(call, None, from.state, Level::Relaxed)? {
                return Ok(None);
            }
        }
        let timed = from.ready_s.is_some();
        if self.work.remaining[usize::from(timed)].is_empty() {
            self.work.remaining[usize::from(timed)] = self.remaining(timed);
        }
        let closed = from.open.iter().map(|act| self.tokens[act].1);
        self.work.goal = self.goal.iter().copied().chain(closed).collect();
        let mark = |work: &mut Work, wanted: bool| {
            work.goal.iter().for_each(|&need| work.wanted[need as usize] = wanted);
        };
        mark(&mut self.work, true);
        let spread = self.seed(world, from).and_then(|()| self.spread(world, from));
        mark(&mut self.work, false);
        spread?;
        Ok(self.work.latest().is_finite().then(|| self.extract()))
    }

    fn spread(&mut self, world: &World, from: &From) -> Result<(), Failure> {
        let timed = from.ready_s.is_some();
        let mut missing = self.work.goal.len();
        for position in 0..self.free.len() {
            self.fire(world, from, self.free[position], 0.0)?;
        }
        while let Some(Reverse((Key(label), proposition))) = self.work.queue.pop() {
            if label > self.work.labels[proposition as usize] {
                continue;
            }
            if self.work.wanted[proposition as usize] {
                missing -= 1;
                if missing == 0 {
                    break;
                }
            }
            if label + self.work.remaining[usize::from(timed)][proposition as usize] >= self.work.latest() {
                continue;
            }
            let waiters = self.needed_by.range(proposition);
            self.work.spent += 4 + waiters.len() as u64;
            for position in waiters {
                let Waiter { operator, target, seconds, step } = self.needed_by.values[position];
                let least = if timed { seconds } else { seconds + step };
                // Whatever else it needs, it comes too late.
                if target != NOBODY && self.work.labels[target as usize] <= label + least {
                    continue;
                }
                let needs = self.hot[operator as usize].needs;
                if let Some(base) = self.work.meet(operator, needs, label, timed) {
                    self.fire(world, from, operator, base)?;
                    self.needed_by.values[position].seconds = self.hot[operator as usize].seconds.max(0.0);
                }
            }
        }
        Ok(())
    }

    fn seed(&mut self, world: &World, from: &From) -> Result<(), Failure> {
        let work = &mut self.work;
        work.begin();
        work.spent += (work.labels.len() / 4 + 16 * self.tests.len()) as u64;
        let ready_s = |resource: usize| from.ready_s.map_or(0.0, |ready_s| ready_s[resource]);
        for (variable, &value) in from.state.values.iter().enumerate() {
            work.reach(self.offsets[variable] + value, ready_s(variable), NOBODY, 1.0);
        }
        let moment =
            EvaluationContext { state: from.state, duration_s: 0.0, proposal: None, level: Level::Relaxed };
        for (index, test) in self.tests.iter().enumerate().filter(|&(index, _)| self.asked[index]) {
            let holds = match *test {
                Test::Comparison(comparison) => world.compare(comparison, &moment)?,
                Test::Call(call, wanted) => {
                    world.calls.agrees((call, wanted), None, from.state, Level::Relaxed)?
                }
            };
            if holds {
                let label = self.test_reads[index].iter().fold(0.0, |l: f64, &r| l.max(ready_s(r as usize)));
                work.reach(self.test_base + index as u32, label, NOBODY, 1.0);
            }
        }
        for &act in from.open {
            work.reach(self.tokens[&act].0, 0.0, NOBODY, 1.0);
        }
        Ok(())
    }

    /// Applies an operator whose preconditions are all reached, with `base` as their combined label.
    fn fire(&mut self, world: &World, from: &From, index: u32, base: f64) -> Result<(), Failure> {
        let hot = self.hot[index as usize];
        let timed = from.ready_s.is_some();
        let label = base + hot.least(timed);
        let latest = self.work.latest();
        let (labels, remaining) = (&self.work.labels, &self.work.remaining[usize::from(timed)]);
        // Nobody is asked about what would come too late for the goal anyway.
        let in_time = |given: u32| hot.is_known() || label + remaining[given as usize] < latest;
        let helps = |&given: &u32| labels[given as usize] > label && in_time(given);
        if !self.given[hot.gives as usize..hot.end as usize].iter().any(helps) {
            return Ok(());
        }
        let (mut least_s, mut likely_s) = (hot.seconds, hot.seconds);
        if !hot.is_known() {
            let proposal = suiting(world, from.state, &self.operators[index as usize])?;
            let Some(proposal) = proposal else { return Ok(()) };
            let asked = self.seconds(world, from.state, index, proposal.as_ref())?;
            (least_s, likely_s) = asked.unwrap_or((f64::INFINITY, f64::INFINITY));
        }
        if least_s.is_infinite() {
            return Ok(());
        }
        let cost = likely_s + hot.step + self.counted_s(world, from.state, index)?;
        self.work.fired[index as usize] = (base, cost);
        let label = base + if timed { least_s } else { cost };
        for &proposition in &self.given[hot.gives as usize..hot.moves as usize] {
            self.work.reach(proposition, label, index, 1.0);
        }
        let mut after: Option<Option<Values>> = None;
        for position in hot.moves..hot.end {
            let test = self.given[position as usize];
            if self.work.labels[test as usize] <= label {
                continue;
            }
            if after.is_none() {
                after = Some(self.effects_alone(world, from.state, &self.operators[index as usize])?);
            }
            let times = match &after {
                Some(Some(after)) => self.repetitions(world, (from.state, after), index, test)?,
                _ => Some(UNSURE),
            };
            if let Some(times) = times {
                let label = if timed { label } else { base + cost * times };
                self.work.reach(test, label, index, times);
            }
        }
        Ok(())
    }

    /// Lower bound and likely value of an operator's duration, in seconds; `None` if the duration never
    /// changes and makes the operator inapplicable.
    fn seconds(
        &mut self,
        world: &World,
        state: &Values,
        index: u32,
        proposal: Option<&Arc<str>>,
    ) -> Result<Option<(f64, f64)>, Failure> {
        let operator = &self.operators[index as usize];
        let known = self.hot[index as usize].seconds;
        if !known.is_nan() {
            return Ok(Some((known, known)));
        }
        let is_settled = operator.seconds == Seconds::Settled;
        let act = &world.acts[operator.act as usize];
        let moment = EvaluationContext { state, duration_s: 0.0, proposal, level: Level::Relaxed };
        let share = match operator.part {
            Part::Start => 0.0,
            _ => 1.0,
        };
        let seconds = world.span(act, &moment)?.map(|span| span.least_s * share);
        if is_settled {
            self.hot[index as usize].seconds = seconds.unwrap_or(f64::INFINITY);
            return Ok(seconds.map(|seconds| (seconds, seconds)));
        }
        // No duration now does not mean that there will be none once other things have changed; until then other ways are likelier.
        self.work.dearest_s = self.work.dearest_s.max(seconds.unwrap_or(0.0));
        let later_s = share * UNSURE * self.work.dearest_s.max(self.unit);
        Ok(Some(seconds.map_or((0.0, later_s), |seconds| (seconds, seconds))))
    }

    /// Contribution of an operator to the plan measure apart from the makespan, in equivalent seconds
    /// of makespan.
    fn counted_s(&self, world: &World, state: &Values, index: u32) -> Result<f64, Failure> {
        let operator = &self.operators[index as usize];
        match self.counted.get(operator.act as usize) {
            Some(Some(counted)) if matches!(operator.part, Part::Whole | Part::End) => {
                let moment =
                    EvaluationContext { state, duration_s: 0.0, proposal: None, level: Level::Relaxed };
                Ok(world.evaluate(counted, &moment)?.max(0.0))
            }
            _ => Ok(0.0),
        }
    }

    /// Number of applications of an operator until a test holds, by its own effects alone; `None` if it
    /// cannot help.
    fn repetitions(
        &self,
        world: &World,
        (state, after): (&Values, &Values),
        index: u32,
        test: u32,
    ) -> Result<Option<f64>, Failure> {
        let operator = &self.operators[index as usize];
        let moment =
            EvaluationContext { state: after, duration_s: 0.0, proposal: None, level: Level::Relaxed };
        let comparison = match self.tests[(test - self.test_base) as usize] {
            Test::Call(call, wanted) => {
                let holds = world.calls.truth(call, None, after, Level::Relaxed)? == wanted;
                return Ok(Some(if holds { 1.0 } else { UNSURE }));
            }
            Test::Comparison(comparison) => comparison,
        };
        if world.compare(comparison, &moment)? {
            return Ok(Some(1.0));
        }
        let comparison = &world.ground.comparisons[comparison as usize];
        let gap = |moment: &EvaluationContext| -> Result<f64, Failure> {
            Ok((world.evaluate(&comparison.left, moment)? - world.evaluate(&comparison.right, moment)?).abs())
        };
        let (before, after) = (gap(&EvaluationContext { state, ..moment })?, gap(&moment)?);
        if before.is_nan() || after.is_nan() {
            return Ok(Some(UNSURE));
        }
        if after < before {
            return Ok(Some((before / (before - after)).ceil().clamp(1.0, 1e6)));
        }
        // Steps of a fixed length away from a bound of a sum never help; around a point, or in a product, they may.
        let hopeless = comparison.relation.is_bound()
            && comparison.left.is_linear()
            && comparison.right.is_linear()
            && changes_by_constants(world, operator);
        Ok((!hopeless).then_some(UNSURE))
    }

    /// State after the effects of an operator alone, whatever its conditions, with the numbers that
    /// tests read; `None` if the effects are not known in this state.
    fn effects_alone(
        &self,
        world: &World,
        state: &Values,
        operator: &Operator,
    ) -> Result<Option<Values>, Failure> {
        let Some(act) = world.acts.get(operator.act as usize) else { return Ok(Some(state.clone())) };
        let Some(proposal) = suiting(world, state, operator)? else { return Ok(None) };
        let before =
            EvaluationContext { state, duration_s: 0.0, proposal: proposal.as_ref(), level: Level::Relaxed };
        let duration_s = world.span(act, &before)?.map_or(0.0, |span| span.least_s);
        let mut after = state.clone();
        let lists = match operator.part {
            Part::Whole => [act.start_effects, act.flow_effects, act.end_effects],
            Part::Start => [act.start_effects, &[], &[]],
            Part::End | Part::Free => [act.flow_effects, act.end_effects, &[]],
        };
        let mut lists = lists.into_iter().filter(|effects| !effects.is_empty()).peekable();
        while let Some(effects) = lists.next() {
            let is_last = lists.peek().is_none();
            let matters = |_: usize, effect: &GroundEffect| match effect.outcome {
                GroundOutcome::Change { fluent, .. } => !is_last || self.is_tested(fluent),
                _ => true,
            };
            let from = after.clone();
            let moment = EvaluationContext {
                state: &from,
                duration_s,
                proposal: proposal.as_ref(),
                level: Level::Relaxed,
            };
            if !world.apply(effects, &moment, &matters, &mut after)? {
                return Ok(None);
            }
        }
        Ok(Some(after))
    }

    fn extract(&mut self) -> Estimate {
        let work = &mut self.work;
        let mut estimate = Estimate { finish_s: work.latest(), ..Estimate::default() };
        let mut chosen: Vec<(u32, f32)> = Vec::new();
        let mut agenda = work.goal.clone();
        let mut seen: Vec<u32> = Vec::new();
        while let Some(proposition) = agenda.pop() {
            if std::mem::replace(&mut work.wanted[proposition as usize], true) {
                continue;
            }
            seen.push(proposition);
            let (supporter, times) = work.supporters[proposition as usize];
            if supporter != NOBODY {
                chosen.push((supporter, times));
                agenda.extend(&self.operators[supporter as usize].needs);
            }
        }
        seen.iter().for_each(|&proposition| work.wanted[proposition as usize] = false);
        let own = |index: u32| (self.operators[index as usize].act, self.operators[index as usize].part);
        // One entry an action and part, with the most repetitions: conditional effects are operators of their own.
        chosen.sort_by(|a, b| own(a.0).cmp(&own(b.0)).then(b.1.total_cmp(&a.1)));
        chosen.dedup_by_key(|(index, _)| own(*index));
        let mut plan: Vec<(f64, (u32, Part))> = Vec::with_capacity(chosen.len());
        for &(index, times) in &chosen {
            let operator = &self.operators[index as usize];
            if operator.part == Part::Free {
                continue;
            }
            let (base, cost) = work.fired[index as usize];
            estimate.cost += cost * f64::from(times);
            plan.push((base, own(index)));
            if operator.needs.iter().all(|&need| work.supporters[need as usize].0 == NOBODY) {
                estimate.preferred.push((operator.act, operator.part));
            }
        }
        plan.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        estimate.plan = plan.into_iter().map(|(_, own)| own).collect();
        estimate
    }
}

/// True if the numeric effects of an operator's action only add constants, without conditions.
fn changes_by_constants(world: &World, operator: &Operator) -> bool {
    let Some(act) = world.acts.get(operator.act as usize) else { return false };
    let mut effects = act.start_effects.iter().chain(act.end_effects);
    act.flow_effects.is_empty()
        && effects.all(|effect| match &effect.outcome {
            GroundOutcome::Set(_) => true,
            GroundOutcome::Change { amount: GroundExpression::Constant(_), change, .. } => {
                effect.when.is_none() && matches!(change, Change::Increase | Change::Decrease)
            }
            GroundOutcome::Change { .. } | GroundOutcome::Flow { .. } | GroundOutcome::Call(_) => false,
        })
}

/// First proposed argument that the operator's own calls accept, or `Some(None)` if the action takes no
/// proposal; `None` if nothing is accepted.
fn suiting(world: &World, state: &Values, operator: &Operator) -> Result<Option<Option<Arc<str>>>, Failure> {
    let agree = |proposal: Option<&Arc<str>>| -> Result<bool, Failure> {
        for &call in &operator.gates {
            if !world.calls.agrees(call, proposal, state, Level::Relaxed)? {
                return Ok(false);
            }
        }
        Ok(true)
    };
    let grounding = world.acts.get(operator.act as usize).and_then(|act| act.grounding.first());
    let Some((module, arguments)) = grounding else { return Ok(agree(None)?.then_some(None)) };
    for proposal in world.calls.proposals(*module, arguments, state)? {
        if agree(Some(&proposal))? {
            return Ok(Some(Some(proposal)));
        }
    }
    Ok(None)
}
