//! Successor states of the temporal search: compressed actions, starts and ends of actions, and timed
//! literals.

use std::cell::{OnceCell, RefCell};
use std::sync::Arc;

use crate::attachment::Level;
use crate::calls::Failure;
use crate::ground::{Change, GroundEffect, GroundOutcome, GroundWhen, Values};
use crate::model::between::telling_parts;

use super::order::Access;
use super::touch::{Touched, expression_touches};
use super::world::{Act, DurationRange, EvaluationContext, World};

/// Part of an action that a step or a relaxed operator applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Part {
    /// The whole action: start and end as one step (compressed).
    Whole,
    /// Start of an action that remains in progress.
    Start,
    /// End of an action in progress.
    End,
    /// A timed literal, or an axiom.
    Free,
}

/// An action in progress.
#[derive(Debug, Clone, PartialEq)]
pub struct Open {
    /// Index of the action.
    pub act: u32,
    /// Argument proposed by the grounding module; `None` if there is none.
    pub proposal: Option<Arc<str>>,
    /// Allowed durations, in seconds.
    pub span: DurationRange,
    /// Conditional end effects that can still happen.
    pub gates: Gates,
}

impl Open {
    /// Evaluation context for conditions of the action in progress.
    fn moment<'s>(&'s self, state: &'s Values) -> EvaluationContext<'s> {
        let proposal = self.proposal.as_ref();
        EvaluationContext { state, duration_s: self.span.least_s, proposal, level: Level::Exact }
    }
}

/// End effects with conditions on earlier times, as one bit each: 1 once such a condition has failed,
/// so that the effect cannot happen. Empty for actions without such effects.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct Gates(Vec<u64>);

impl Gates {
    /// Gates at the start of an action: every end effect can still happen.
    fn open(effects: &[GroundEffect]) -> Gates {
        let remembered =
            effects.iter().rposition(|effect| effect.when.as_ref().is_some_and(|when| is_remembered(when)));
        Gates(vec![0; remembered.map_or(0, |last| last / 64 + 1)])
    }

    fn close(&mut self, effect: usize) {
        self.0[effect / 64] |= 1 << (effect % 64);
    }

    fn is_open(&self, effect: usize) -> bool {
        self.0.get(effect / 64).is_none_or(|word| word >> (effect % 64) & 1 == 0)
    }
}

/// True if an end effect has a condition on the start or the over-all interval of its action.
fn is_remembered(when: &GroundWhen) -> bool {
    !when.at_start.is_empty() || !when.over_all.is_empty()
}

/// State of the temporal search: facts and numbers, actions in progress, and number of past timed
/// literals.
#[derive(Debug, Clone)]
pub struct Situation {
    /// Facts and numbers.
    pub state: Values,
    /// Actions in progress, in order of their starts.
    pub open: Vec<Open>,
    /// Number of timed literals that have happened.
    pub timed: usize,
}

/// Step of a temporal plan.
#[derive(Debug, Clone, PartialEq)]
pub struct TemporalStep {
    /// Index of the action; meaningless for timed literals.
    pub act: u32,
    /// Part of the action; [`Part::Free`] stands for the next timed literal.
    pub part: Part,
    /// Argument proposed by the grounding module; `None` if there is none.
    pub proposal: Option<Arc<str>>,
    /// Duration in seconds, if the schedule makes the action longer than its shortest duration; else
    /// `None`.
    pub taken_s: Option<f64>,
    /// Allowed durations in seconds; set by [`World::advance`].
    pub span: DurationRange,
}

impl TemporalStep {
    /// Step that applies a whole action, without a proposed argument.
    pub fn whole(act: u32) -> TemporalStep {
        TemporalStep {
            act,
            part: Part::Whole,
            proposal: None,
            taken_s: None,
            span: DurationRange { least_s: 0.0, most_s: 0.0 },
        }
    }
}

impl World<'_> {
    /// Situation after a step, or `None` if the step is inapplicable; sets the step's `span`.
    pub fn advance(&self, from: &Situation, step: &mut TemporalStep) -> Result<Option<Situation>, Failure> {
        match step.part {
            Part::Whole => self.whole(from, step),
            Part::Start => self.start(from, step),
            Part::End => self.end(from, step),
            Part::Free => self.timed(from),
        }
    }

    fn whole(&self, from: &Situation, step: &mut TemporalStep) -> Result<Option<Situation>, Failure> {
        let Some((after, span)) = self.started(from, step)? else { return Ok(None) };
        step.span = span;
        let act = &self.acts[step.act as usize];
        let mut next = Situation { state: after, open: from.open.clone(), timed: from.timed };
        if !self.goes_on(&mut next)? {
            return Ok(None);
        }
        if !act.durative {
            return Ok(Some(next));
        }
        let gates = self.start_gates(act, &from.state, step)?;
        let own = Open { act: step.act, proposal: step.proposal.clone(), span, gates };
        if !self.finish(&own, &mut next)? || !self.goes_on(&mut next)? {
            return Ok(None);
        }
        Ok(Some(next))
    }

    fn start(&self, from: &Situation, step: &mut TemporalStep) -> Result<Option<Situation>, Failure> {
        let Some((after, span)) = self.started(from, step)? else { return Ok(None) };
        step.span = span;
        let act = &self.acts[step.act as usize];
        let gates = self.start_gates(act, &from.state, step)?;
        let mut next = Situation { state: after, open: from.open.clone(), timed: from.timed };
        next.open.push(Open { act: step.act, proposal: step.proposal.clone(), span, gates });
        Ok(self.goes_on(&mut next)?.then_some(next))
    }

    fn end(&self, from: &Situation, step: &mut TemporalStep) -> Result<Option<Situation>, Failure> {
        let same = |open: &Open| open.act == step.act && open.proposal == step.proposal;
        let Some(position) = from.open.iter().position(same) else { return Ok(None) };
        let mut next = from.clone();
        let open = next.open.remove(position);
        step.span = open.span;
        if !self.finish(&open, &mut next)? {
            return Ok(None);
        }
        Ok(self.goes_on(&mut next)?.then_some(next))
    }

    fn timed(&self, from: &Situation) -> Result<Option<Situation>, Failure> {
        let Some(timed) = self.ground.timed.get(from.timed) else { return Ok(None) };
        let effects = always(&timed.outcomes);
        let mut next = from.clone();
        next.timed += 1;
        let moment =
            EvaluationContext { state: &from.state, duration_s: 0.0, proposal: None, level: Level::Exact };
        if !self.apply(&effects, &moment, &|_, _| true, &mut next.state)? {
            return Ok(None);
        }
        Ok(self.goes_on(&mut next)?.then_some(next))
    }

    /// State after the start of an action, and the allowed durations; `None` if the action cannot
    /// start.
    fn started(
        &self,
        from: &Situation,
        step: &TemporalStep,
    ) -> Result<Option<(Values, DurationRange)>, Failure> {
        let act = &self.acts[step.act as usize];
        let mut moment = EvaluationContext {
            state: &from.state,
            duration_s: 0.0,
            proposal: step.proposal.as_ref(),
            level: Level::Exact,
        };
        if !self.holds(act.at_start, &moment)? {
            return Ok(None);
        }
        let span = match act.durative {
            true => self.span(act, &moment)?,
            false => Some(DurationRange { least_s: 0.0, most_s: 0.0 }),
        };
        let Some(span) = span.and_then(|span| span.taking(step.taken_s)) else { return Ok(None) };
        moment.duration_s = span.least_s;
        let mut after = from.state.clone();
        if !self.apply(act.start_effects, &moment, &|_, _| true, &mut after)? {
            return Ok(None);
        }
        let inside = EvaluationContext { state: &after, ..moment };
        // Where numbers flow, what holds over all is told at the end.
        let goes_on = !act.flow_effects.is_empty() || self.holds(act.over_all, &inside)?;
        Ok(goes_on.then_some((after, span)))
    }

    fn start_gates(&self, act: &Act, before: &Values, step: &TemporalStep) -> Result<Gates, Failure> {
        let moment = EvaluationContext {
            state: before,
            duration_s: step.span.least_s,
            proposal: step.proposal.as_ref(),
            level: Level::Exact,
        };
        let mut gates = Gates::open(act.end_effects);
        for (index, effect) in act.end_effects.iter().enumerate() {
            let Some(when) = effect.when.as_ref().filter(|when| is_remembered(when)) else { continue };
            if !self.holds(&when.at_start, &moment)? {
                gates.close(index);
            }
        }
        Ok(gates)
    }

    /// Applies the end of an action that has been taken out of the actions in progress; false if it
    /// cannot end now.
    fn finish(&self, own: &Open, situation: &mut Situation) -> Result<bool, Failure> {
        let act = &self.acts[own.act as usize];
        if !act.flow_effects.is_empty() {
            let Some(flowed) = self.flowed(own, situation)? else { return Ok(false) };
            situation.state = flowed;
        }
        let state = &mut situation.state;
        let before = state.clone();
        let moment = own.moment(&before);
        if !self.holds(act.at_end, &moment)? || !self.end_allows(act, &moment)? {
            return Ok(false);
        }
        let mut inside = Vec::with_capacity(act.end_effects.len());
        for effect in act.end_effects {
            inside.push(effect.when.as_ref().map_or(Ok(true), |when| self.holds(&when.over_all, &moment))?);
        }
        let gate = |index: usize, _: &GroundEffect| inside[index] && own.gates.is_open(index);
        self.apply(act.end_effects, &moment, &gate, state)
    }

    /// State just before the end of an action with continuous effects; `None` if an over-all condition
    /// fails on the way.
    fn flowed(&self, own: &Open, situation: &Situation) -> Result<Option<Values>, Failure> {
        let before = &situation.state;
        let mut last = before.clone();
        let flows = self.acts[own.act as usize].flow_effects;
        if !self.apply(flows, &own.moment(before), &|_, _| true, &mut last)? {
            return Ok(None);
        }
        let on_the_way = |part: f64| -> Result<Values, Failure> {
            let mut state = before.clone();
            for (number, last) in state.numbers.iter_mut().zip(&last.numbers) {
                *number += part * (last - *number);
            }
            self.derive(&mut state)?;
            Ok(state)
        };
        let middle = on_the_way(0.5)?;
        let mut differences = Vec::with_capacity(self.ground.comparisons.len());
        for comparison in &self.ground.comparisons {
            let mut points = [0.0; 3];
            for (point, state) in points.iter_mut().zip([before, &middle, &last]) {
                let moment = own.moment(state);
                *point =
                    self.evaluate(&comparison.left, &moment)? - self.evaluate(&comparison.right, &moment)?;
            }
            differences.push(points);
        }
        for part in telling_parts(differences) {
            let state = on_the_way(part)?;
            for open in situation.open.iter().chain([own]) {
                if !self.holds(self.acts[open.act as usize].over_all, &open.moment(&state))? {
                    return Ok(None);
                }
            }
        }
        Ok(Some(last))
    }

    /// True if the over-all conditions of all actions in progress hold; records conditional end effects
    /// that can no longer happen.
    fn goes_on(&self, situation: &mut Situation) -> Result<bool, Failure> {
        for open in &mut situation.open {
            let moment = EvaluationContext {
                state: &situation.state,
                duration_s: open.span.least_s,
                proposal: open.proposal.as_ref(),
                level: Level::Exact,
            };
            let act = &self.acts[open.act as usize];
            if !self.holds(act.over_all, &moment)? {
                return Ok(false);
            }
            if open.gates.0.is_empty() {
                continue;
            }
            for (index, effect) in act.end_effects.iter().enumerate() {
                let Some(when) = effect.when.as_ref().filter(|when| is_remembered(when)) else { continue };
                if open.gates.is_open(index) && !self.holds(&when.over_all, &moment)? {
                    open.gates.close(index);
                }
            }
        }
        Ok(true)
    }

    /// Situation after the last timed literal if no further step is applied; `None` while an action is
    /// in progress.
    pub fn ended(&self, situation: &Situation) -> Result<Option<Situation>, Failure> {
        let mut ended = situation.clone();
        while ended.open.is_empty() && ended.timed < self.ground.timed.len() {
            let Some(next) = self.timed(&ended)? else { return Ok(None) };
            ended = next;
        }
        Ok(ended.open.is_empty().then_some(ended))
    }

    /// True if a plan may end in a situation: no action is in progress, and the goal holds after the
    /// last timed literal (PDDL 2.2; Edelkamp and Hoffmann 2004).
    pub fn is_goal(&self, situation: &Situation) -> Result<bool, Failure> {
        if !situation.open.is_empty() || !self.keeps_goal(situation) {
            return Ok(false);
        }
        if situation.timed == self.ground.timed.len() {
            return self.holds_at_end(&situation.state);
        }
        self.ended(situation)?.map_or(Ok(false), |ended| self.holds_at_end(&ended.state))
    }

    /// True if the goal holds in a state.
    pub fn holds_at_end(&self, state: &Values) -> Result<bool, Failure> {
        let moment = EvaluationContext { state, duration_s: 0.0, proposal: None, level: Level::Exact };
        self.holds(&self.ground.goal, &moment)
    }

    /// True if the goal's facts, except derived ones, will hold after the last timed literal if no
    /// further step is applied.
    fn keeps_goal(&self, situation: &Situation) -> bool {
        let at_end = |variable: u32| match self.last_given.get(&variable) {
            Some(&(timed, value)) if timed >= situation.timed => value,
            _ => situation.state.values[variable as usize],
        };
        let derived = |variable: u32| self.ground.variables[variable as usize].stratum.is_some();
        let mut plain = self.ground.goal.facts.iter().filter(|fact| !derived(fact.variable));
        plain.all(|fact| at_end(fact.variable) == fact.value)
    }
}

/// Resources that the start of an action accesses and, if the action is durative, those that its end
/// accesses.
pub(crate) type Touches = (Access, Option<Access>);

/// Resources that the happenings of every action access; derived variables are replaced by the basic
/// ones behind them.
pub struct Accesses<'w, 'a> {
    /// Resources accessed by each action; computed on demand, as most actions of a large task never
    /// happen.
    acts: Vec<OnceCell<Touches>>,
    watch: RefCell<Watch<'w, 'a>>,
    /// Resources accessed by each timed literal.
    pub timed: Vec<Access>,
    /// Number of resources: variables and numbers.
    pub resources: usize,
}

impl<'w, 'a> Accesses<'w, 'a> {
    /// Accesses of all timed literals; those of actions follow on demand.
    pub fn new(world: &'w World<'a>) -> Accesses<'w, 'a> {
        let resources = world.ground.variables.len() + world.ground.numerics.len();
        let mut watch = Watch::new(world);
        let timed = world.ground.timed.iter().map(|timed| {
            let effects = always(&timed.outcomes);
            watch.access(effects.iter())
        });
        let timed = timed.collect();
        let acts = vec![OnceCell::new(); world.acts.len()];
        Accesses { acts, watch: RefCell::new(watch), timed, resources }
    }

    /// Resources accessed by an action.
    pub fn of(&self, act: u32) -> &Touches {
        self.acts[act as usize].get_or_init(|| self.watch.borrow_mut().both(act))
    }
}

/// Collector of the resources that a happening accesses, used for one happening after the other.
struct Watch<'w, 'a> {
    world: &'w World<'a>,
    /// Basic resources behind each derived variable; empty for other variables.
    roots: Vec<Vec<u32>>,
    read: Touched,
    held: Touched,
    written: Touched,
    added: Touched,
}

impl<'w, 'a> Watch<'w, 'a> {
    fn new(world: &'w World<'a>) -> Watch<'w, 'a> {
        let [read, held, written, added] = [(); 4].map(|()| Touched::default());
        Watch { world, roots: derived_roots(world), read, held, written, added }
    }

    fn both(&mut self, act: u32) -> Touches {
        let act = &self.world.acts[act as usize];
        (self.start(act), act.durative.then(|| self.end(act)))
    }

    fn start(&mut self, act: &Act) -> Access {
        let (world, read) = (self.world, &mut self.read);
        read.condition(world, act.at_start);
        self.held.condition(world, act.over_all);
        let bounds = act.bounds.iter().filter(|bound| !bound.at_end);
        bounds.for_each(|bound| expression_touches(world, &bound.seconds, read));
        for when in act.end_effects.iter().filter_map(|effect| effect.when.as_ref()) {
            read.condition(world, &when.at_start);
            read.condition(world, &when.over_all);
        }
        // What changes while the action runs changes from its start on.
        self.access(act.start_effects.iter().chain(act.flow_effects))
    }

    fn end(&mut self, act: &Act) -> Access {
        let (world, read) = (self.world, &mut self.read);
        self.held.condition(world, act.over_all);
        read.condition(world, act.at_end);
        let bounds = act.bounds.iter().filter(|bound| bound.at_end);
        bounds.for_each(|bound| expression_touches(world, &bound.seconds, read));
        self.access(act.flow_effects.iter().chain(act.end_effects))
    }

    /// Access of a happening with these effects and the reads collected before; empties the collector.
    fn access<'e>(&mut self, effects: impl Iterator<Item = &'e GroundEffect>) -> Access {
        let (world, read) = (self.world, &mut self.read);
        for effect in effects {
            if let Some(when) = &effect.when {
                read.condition(world, &when.here);
                read.condition(world, &when.over_all);
            }
            match &effect.outcome {
                GroundOutcome::Change { fluent, change: Change::Increase | Change::Decrease, amount } => {
                    expression_touches(world, amount, read);
                    self.added.numbers.push(*fluent);
                }
                GroundOutcome::Change { amount, .. } => {
                    expression_touches(world, amount, read);
                    self.written.outcome(world, &effect.outcome);
                }
                GroundOutcome::Flow { fluent, rate } => {
                    expression_touches(world, rate, read);
                    self.added.numbers.push(*fluent);
                }
                GroundOutcome::Call(call) => {
                    read.call(world, *call);
                    self.written.outcome(world, &effect.outcome);
                }
                GroundOutcome::Set(_) => self.written.outcome(world, &effect.outcome),
            }
        }
        let variables = world.ground.variables.len();
        let reads = self.traced(self.read.resources(variables));
        let mut holds = self.traced(self.held.resources(variables));
        holds.retain(|resource| reads.binary_search(resource).is_err());
        let (writes, adds) = (self.written.resources(variables), self.added.resources(variables));
        [&mut self.read, &mut self.held, &mut self.written, &mut self.added]
            .into_iter()
            .for_each(Touched::clear);
        Access { reads, holds, writes, adds }
    }

    /// Resources with derived variables replaced by the basic resources behind them.
    fn traced(&self, resources: Vec<u32>) -> Vec<u32> {
        if resources.iter().all(|&resource| self.roots_of(resource).is_none()) {
            return resources;
        }
        let traced = |&resource: &u32| match self.roots_of(resource) {
            Some(roots) => roots.to_vec(),
            None => vec![resource],
        };
        let mut traced: Vec<u32> = resources.iter().flat_map(traced).collect();
        traced.sort_unstable();
        traced.dedup();
        traced
    }

    fn roots_of(&self, resource: u32) -> Option<&[u32]> {
        self.roots.get(resource as usize).filter(|roots| !roots.is_empty()).map(Vec::as_slice)
    }
}

/// Basic resources behind each derived variable; empty for other variables.
pub(super) fn derived_roots(world: &World) -> Vec<Vec<u32>> {
    let variables = world.ground.variables.len();
    let mut direct: Vec<Vec<u32>> = vec![Vec::new(); variables];
    for axiom in &world.ground.axioms {
        let mut touched = Touched::default();
        touched.condition(world, &axiom.body);
        direct[axiom.head.variable as usize].extend(touched.resources(variables));
    }
    let derived =
        |resource: u32| world.ground.variables.get(resource as usize).is_some_and(|v| v.stratum.is_some());
    let close = |start: usize| {
        let mut seen = vec![false; variables];
        let (mut agenda, mut roots) = (direct[start].clone(), Vec::new());
        while let Some(resource) = agenda.pop() {
            if !derived(resource) {
                roots.push(resource);
            } else if !std::mem::replace(&mut seen[resource as usize], true) {
                agenda.extend(&direct[resource as usize]);
            }
        }
        roots.sort_unstable();
        roots.dedup();
        roots
    };
    (0..variables)
        .map(|variable| if derived(variable as u32) { close(variable) } else { Vec::new() })
        .collect()
}

fn always(outcomes: &[GroundOutcome]) -> Vec<GroundEffect> {
    outcomes.iter().map(|outcome| GroundEffect { when: None, outcome: outcome.clone() }).collect()
}
