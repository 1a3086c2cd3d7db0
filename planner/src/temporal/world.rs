//! Evaluation of conditions and effects of durative actions on states of the temporal search.

use std::cell::OnceCell;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::attachment::Level;
use crate::calls::{Calls, Failure};
use crate::ground::{
    Axiom, Change, ComparisonId, Conjunction, GroundDurationBound, GroundEffect, GroundExpression,
    GroundOutcome, GroundTask, Origin, Place, Relation, Values, Variable, VariableId,
};
use crate::model::agreement::{contradictions, reset};
use crate::model::relation::quotient;
use crate::plan::EPSILON_S;
use crate::task::{Task, Term};

/// Ground action of the temporal search; an instantaneous action has only conditions and effects at its
/// start.
#[derive(Debug, Clone)]
pub struct Act<'a> {
    /// Action schema and arguments.
    pub origin: &'a Origin,
    /// True if durative.
    pub durative: bool,
    /// Bounds on the duration, all of which must hold.
    pub bounds: &'a [GroundDurationBound],
    /// Duration to choose, as a position between its bounds: 0 for the shortest, 1 for the longest.
    /// Above 0 only in copies of actions whose effects depend on their duration.
    pub share: f64,
    /// Condition right before the start.
    pub at_start: &'a Conjunction,
    /// Condition that holds strictly between start and end.
    pub over_all: &'a Conjunction,
    /// Condition right before the end.
    pub at_end: &'a Conjunction,
    /// Effects at the start.
    pub start_effects: &'a [GroundEffect],
    /// Continuous effects, with their rates.
    pub flow_effects: &'a [GroundEffect],
    /// Effects at the end.
    pub end_effects: &'a [GroundEffect],
    /// Contribution to an additive metric.
    pub cost: &'a GroundExpression,
    /// Calls of grounding modules: index of the module, and arguments.
    pub grounding: Vec<(usize, Vec<u32>)>,
    /// True if start and end are independent of each other; computed on demand.
    pub(super) ends_freely: OnceCell<bool>,
}

/// Positions between the shortest (0) and the longest (1) duration that are tried, besides the
/// shortest, for actions whose effects depend on their duration.
const SHARES: [f64; 2] = [0.5, 1.0];

pub static NOTHING: Conjunction =
    Conjunction { facts: Vec::new(), comparisons: Vec::new(), calls: Vec::new() };

/// State, together with everything else that the value of an expression depends on.
#[derive(Clone, Copy)]
pub struct EvaluationContext<'s> {
    /// The state.
    pub state: &'s Values,
    /// Value of `?duration`, in seconds.
    pub duration_s: f64,
    /// Argument proposed by a grounding module; `None` if there is none.
    pub proposal: Option<&'s Arc<str>>,
    /// Level of accuracy at which attachments answer.
    pub level: Level,
}

/// Range of durations that an action may take, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DurationRange {
    /// Shortest duration.
    pub least_s: f64,
    /// Longest duration; may be infinite.
    pub most_s: f64,
}

impl DurationRange {
    /// Range reduced to a chosen duration, if there is one; `None` if the range does not contain it.
    pub fn taking(self, taken_s: Option<f64>) -> Option<DurationRange> {
        let Some(taken_s) = taken_s else { return Some(self) };
        (self.least_s <= taken_s && taken_s <= self.most_s)
            .then_some(DurationRange { least_s: taken_s, most_s: taken_s })
    }

    /// Range that stays [`EPSILON_S`] inside strict bounds; the middle of the allowed range if there is
    /// less room.
    fn strictly_inside(self, bounds: DurationRange) -> DurationRange {
        let least_s = self.least_s.max(bounds.least_s + EPSILON_S);
        let most_s = self.most_s.min(bounds.most_s - EPSILON_S);
        let middle_s = (self.least_s.max(bounds.least_s) + self.most_s.min(bounds.most_s)) / 2.0;
        let is_inside = self.least_s <= middle_s
            && middle_s <= self.most_s
            && bounds.least_s < middle_s
            && middle_s < bounds.most_s;
        match least_s > most_s && is_inside {
            true => DurationRange { least_s: middle_s, most_s: middle_s },
            false => DurationRange { least_s, most_s },
        }
    }
}

/// Ground task in the form that the temporal search uses.
pub struct World<'a> {
    /// The lifted task.
    pub task: &'a Task,
    /// The ground task.
    pub ground: &'a GroundTask,
    /// Calls of attachments.
    pub calls: Calls<'a>,
    /// Actions: durative ones, then instantaneous ones, then copies of durative ones with a longer
    /// duration.
    pub acts: Vec<Act<'a>>,
    /// True if the steps of the search can produce every plan; computed on demand.
    pub(super) complete: OnceCell<bool>,
    /// True if some action has a grounding module.
    pub proposes: bool,
    /// Axioms of each stratum.
    strata: Vec<Vec<&'a Axiom>>,
    /// Derived variables.
    derived: Vec<usize>,
    /// True, by variable, if the variable stands for an object fluent; empty if none does.
    objects: Vec<bool>,
    /// Last timed literal that sets each variable: its index and the value; only for variables set by
    /// timed literals.
    pub(super) last_given: FxHashMap<u32, (usize, u32)>,
}

impl<'a> World<'a> {
    /// World of a ground task, with its calls of attachments.
    pub fn new(task: &'a Task, ground: &'a GroundTask, calls: Calls<'a>) -> World<'a> {
        let durative = ground.durative.iter().map(|action| Act {
            origin: &action.origin,
            durative: true,
            bounds: &action.duration,
            share: 0.0,
            at_start: &action.at_start,
            over_all: &action.over_all,
            at_end: &action.at_end,
            start_effects: &action.start_effects,
            flow_effects: &action.flow_effects,
            end_effects: &action.end_effects,
            cost: &action.cost,
            grounding: grounding(task, &action.origin),
            ends_freely: OnceCell::new(),
        });
        let instantaneous = ground.actions.iter().map(|action| Act {
            origin: &action.origin,
            durative: false,
            bounds: &[],
            share: 0.0,
            at_start: &action.condition,
            over_all: &NOTHING,
            at_end: &NOTHING,
            start_effects: &action.effects,
            flow_effects: &[],
            end_effects: &[],
            cost: &action.cost,
            grounding: grounding(task, &action.origin),
            ends_freely: OnceCell::new(),
        });
        let mut acts: Vec<Act> = durative.chain(instantaneous).collect();
        let longer = |act: &&Act| chooses_effects(act);
        let longer: Vec<Act> = acts
            .iter()
            .filter(longer)
            .flat_map(|act| SHARES.map(|share| Act { share, ..act.clone() }))
            .collect();
        acts.extend(longer);
        let proposes = acts.iter().any(|act| !act.grounding.is_empty());
        let stratum_of =
            |axiom: &Axiom| ground.variables[axiom.head.variable as usize].stratum.unwrap_or(0) as usize;
        let mut strata: Vec<Vec<&Axiom>> = Vec::new();
        for axiom in &ground.axioms {
            let stratum = stratum_of(axiom);
            strata.resize(strata.len().max(stratum + 1), Vec::new());
            strata[stratum].push(axiom);
        }
        let derived = (0..ground.variables.len())
            .filter(|&variable| ground.variables[variable].stratum.is_some())
            .collect();
        let mut objects: Vec<bool> = ground.variables.iter().map(Variable::is_object).collect();
        if !objects.contains(&true) {
            objects = Vec::new();
        }
        let given = ground.timed.iter().enumerate();
        let last_given = given
            .flat_map(|(index, timed)| timed.outcomes.iter().map(move |outcome| (index, outcome)))
            .filter_map(|(index, outcome)| match outcome {
                GroundOutcome::Set(fact) => Some((fact.variable, (index, fact.value))),
                _ => None,
            })
            .collect();
        let complete = OnceCell::new();
        World { task, ground, calls, acts, complete, proposes, strata, derived, objects, last_given }
    }

    /// True if numbers depend on the times of a plan: on a chosen duration, or on continuous change.
    pub fn chooses_numbers(&self) -> bool {
        self.acts.iter().any(|act| !act.flow_effects.is_empty() || chooses_effects(act))
    }

    /// True if effects depend on a duration without an upper bound, so that no position within its
    /// bounds can be tried.
    pub fn chooses_without_end(&self) -> bool {
        let ends = |act: &Act| {
            let mut relations = act.bounds.iter().map(|bound| bound.relation);
            relations.any(|relation| matches!(relation, Relation::AtMost | Relation::Less | Relation::Equal))
        };
        self.acts.iter().any(|act| chooses_effects(act) && !ends(act))
    }

    /// True if the contribution of an action to the metric depends on its chosen duration.
    pub fn chooses_costs(&self) -> bool {
        self.acts.iter().any(chooses_cost)
    }

    /// Initial state, derived variables included.
    pub fn initial(&self) -> Result<Values, Failure> {
        let mut state = self.ground.initial.clone();
        self.derive(&mut state)?;
        Ok(state)
    }

    /// Value of an expression; NaN if undefined. `total-time` and violations of preferences count as
    /// zero.
    pub fn evaluate(
        &self,
        expression: &GroundExpression,
        moment: &EvaluationContext,
    ) -> Result<f64, Failure> {
        Ok(match expression {
            GroundExpression::Constant(number) => *number,
            GroundExpression::Fluent(fluent) => moment.state.numbers[*fluent as usize],
            GroundExpression::Call(call) => {
                self.calls.cost(*call, moment.proposal, moment.state, moment.level)?
            }
            GroundExpression::Duration => moment.duration_s,
            GroundExpression::TotalTime | GroundExpression::Violated(_) => 0.0,
            GroundExpression::Sum(parts) => {
                let mut sum = 0.0;
                for part in parts {
                    sum += self.evaluate(part, moment)?;
                }
                sum
            }
            GroundExpression::Product(parts) => {
                let mut product = 1.0;
                for part in parts {
                    product *= self.evaluate(part, moment)?;
                }
                product
            }
            GroundExpression::Difference(left, right) => {
                self.evaluate(left, moment)? - self.evaluate(right, moment)?
            }
            GroundExpression::Quotient(left, right) => {
                quotient(self.evaluate(left, moment)?, self.evaluate(right, moment)?)
            }
            GroundExpression::Negative(inner) => -self.evaluate(inner, moment)?,
        })
    }

    /// True if a numeric condition holds.
    pub fn compare(&self, comparison: ComparisonId, moment: &EvaluationContext) -> Result<bool, Failure> {
        let comparison = &self.ground.comparisons[comparison as usize];
        let left = self.evaluate(&comparison.left, moment)?;
        let right = self.evaluate(&comparison.right, moment)?;
        Ok(comparison.relation.holds(left, right))
    }

    /// True if a conjunction holds; calls are evaluated last.
    pub fn holds(&self, condition: &Conjunction, moment: &EvaluationContext) -> Result<bool, Failure> {
        let facts =
            condition.facts.iter().all(|fact| moment.state.values[fact.variable as usize] == fact.value);
        if !facts {
            return Ok(false);
        }
        for &comparison in &condition.comparisons {
            if !self.compare(comparison, moment)? {
                return Ok(false);
            }
        }
        for &call in &condition.calls {
            if !self.calls.agrees(call, moment.proposal, moment.state, moment.level)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Durations that the bounds at the start allow in a state; `None` if there are none.
    ///
    /// A durative action takes at least [`EPSILON_S`], unless it must be shorter and its end is
    /// independent of its start.
    pub fn span(&self, act: &Act, moment: &EvaluationContext) -> Result<Option<DurationRange>, Failure> {
        let mut span = DurationRange { least_s: 0.0, most_s: f64::INFINITY };
        let mut strict = DurationRange { least_s: f64::NEG_INFINITY, most_s: f64::INFINITY };
        for bound in act.bounds.iter().filter(|bound| !bound.at_end) {
            let seconds = self.evaluate(&bound.seconds, moment)?;
            if seconds.is_nan() {
                return Ok(None);
            }
            match bound.relation {
                Relation::Less => strict.most_s = strict.most_s.min(seconds),
                Relation::AtMost => span.most_s = span.most_s.min(seconds),
                Relation::Equal => {
                    span.least_s = span.least_s.max(seconds);
                    span.most_s = span.most_s.min(seconds);
                }
                Relation::AtLeast => span.least_s = span.least_s.max(seconds),
                Relation::Greater => strict.least_s = strict.least_s.max(seconds),
                Relation::Unequal => {}
            }
        }
        span = span.strictly_inside(strict);
        if span.most_s < EPSILON_S && !*act.ends_freely.get_or_init(|| self.ends_freely(act)) {
            return Ok(None);
        }
        span.least_s = span.least_s.max(EPSILON_S.min(span.most_s));
        // What the end asks for is most likely what it would ask for now.
        for bound in act.bounds.iter().filter(|bound| bound.at_end && bound.relation == Relation::Equal) {
            let seconds = self.evaluate(&bound.seconds, moment)?;
            if span.least_s < seconds && seconds <= span.most_s {
                span.least_s = seconds;
            }
        }
        if act.share > 0.0 {
            let seconds = span.least_s + act.share * (span.most_s - span.least_s);
            let is_longer = seconds.is_finite() && seconds > span.least_s;
            return Ok(is_longer.then_some(DurationRange { least_s: seconds, most_s: seconds }));
        }
        Ok((span.least_s <= span.most_s && span.least_s.is_finite()).then_some(span))
    }

    /// True if the bounds that are evaluated at the end of an action allow the duration in `moment`.
    pub fn end_allows(&self, act: &Act, moment: &EvaluationContext) -> Result<bool, Failure> {
        for bound in act.bounds.iter().filter(|bound| bound.at_end) {
            let seconds = self.evaluate(&bound.seconds, moment)?;
            if !bound.relation.holds(moment.duration_s, seconds) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Applies effects. `moment` holds the state before; `into` is a copy of that state and becomes the
    /// state after, derived variables included. `gate` is true for effects whose conditions on earlier
    /// times were met.
    ///
    /// Returns false if the effects cannot happen: a number becomes undefined or infinite, or changes
    /// of a number or object fluent contradict each other.
    pub fn apply(
        &self,
        effects: &[GroundEffect],
        moment: &EvaluationContext,
        gate: &dyn Fn(usize, &GroundEffect) -> bool,
        into: &mut Values,
    ) -> Result<bool, Failure> {
        let may_contradict = |effect: &&GroundEffect| match &effect.outcome {
            GroundOutcome::Set(fact) => self.is_object(fact.variable),
            GroundOutcome::Change { .. } | GroundOutcome::Call(_) => true,
            GroundOutcome::Flow { .. } => false,
        };
        let several = effects.iter().filter(may_contradict).nth(1).is_some();
        let mut changes: Vec<(u32, Change, f64)> = Vec::new();
        let mut objects: Vec<(VariableId, u32)> = Vec::new();
        for (index, effect) in effects.iter().enumerate() {
            let here = effect.when.as_ref().map(|when| &when.here);
            if !gate(index, effect) || !here.map_or(Ok(true), |here| self.holds(here, moment))? {
                continue;
            }
            match &effect.outcome {
                GroundOutcome::Set(fact) => {
                    into.values[fact.variable as usize] = fact.value;
                    let is_object = several && self.is_object(fact.variable);
                    objects.extend(is_object.then_some((fact.variable, fact.value)));
                }
                GroundOutcome::Change { fluent, change, amount } => {
                    let amount = self.evaluate(amount, moment)?;
                    changes.extend(several.then_some((*fluent, *change, amount)));
                    change.apply(&mut into.numbers[*fluent as usize], amount);
                    if !into.numbers[*fluent as usize].is_finite() {
                        return Ok(false);
                    }
                }
                GroundOutcome::Flow { fluent, rate } => {
                    let change = self.evaluate(rate, moment)? * moment.duration_s;
                    into.numbers[*fluent as usize] += change;
                    if !into.numbers[*fluent as usize].is_finite() {
                        return Ok(false);
                    }
                }
                GroundOutcome::Call(call) => {
                    self.calls.write(*call, moment.proposal, moment.state, moment.level, into)?;
                    for place in &self.ground.calls[*call as usize].writes {
                        match *place {
                            Place::Number(at) => {
                                let value = into.numbers[at as usize];
                                changes.extend((!value.is_nan()).then_some((at, Change::Assign, value)));
                            }
                            Place::Object(at) => objects.push((at, into.values[at as usize])),
                            Place::Truth(_) | Place::Nowhere => {}
                        }
                    }
                }
            }
        }
        if changes.len() > 1 && !contradictions(changes.into_iter()).is_empty()
            || objects.len() > 1 && reset(objects.into_iter()).is_some()
        {
            return Ok(false);
        }
        self.derive(into)?;
        Ok(true)
    }

    fn is_object(&self, variable: VariableId) -> bool {
        !self.objects.is_empty() && self.objects[variable as usize]
    }

    /// Recomputes the derived variables of a state.
    pub(super) fn derive(&self, state: &mut Values) -> Result<(), Failure> {
        if self.derived.is_empty() {
            return Ok(());
        }
        for &variable in &self.derived {
            state.values[variable] = 1;
        }
        for stratum in &self.strata {
            loop {
                let mut changed = false;
                for axiom in stratum {
                    let head = axiom.head.variable as usize;
                    if state.values[head] == axiom.head.value {
                        continue;
                    }
                    let moment =
                        EvaluationContext { state, duration_s: 0.0, proposal: None, level: Level::Exact };
                    if self.holds(&axiom.body, &moment)? {
                        state.values[head] = axiom.head.value;
                        changed = true;
                    }
                }
                if !changed {
                    break;
                }
            }
        }
        Ok(())
    }
}

impl Act<'_> {
    /// True if effects, bounds at the end or the cost depend on a duration that is left to the
    /// schedule.
    pub fn is_read_off(&self) -> bool {
        self.share == 0.0 && (chooses_effects(self) || chooses_cost(self))
    }
}

/// True if the cost of an action depends on a duration that can be chosen.
fn chooses_cost(act: &Act) -> bool {
    !is_fixed(act) && mentions_duration(act.cost)
}

fn is_fixed(act: &Act) -> bool {
    act.bounds.iter().any(|bound| bound.relation == Relation::Equal && !bound.at_end)
}

/// True if effects or bounds at the end depend on a duration that can be chosen.
fn chooses_effects(act: &Act) -> bool {
    let timed = |effect: &GroundEffect| match &effect.outcome {
        GroundOutcome::Change { amount, .. } => mentions_duration(amount),
        GroundOutcome::Flow { .. } => true,
        GroundOutcome::Set(_) | GroundOutcome::Call(_) => false,
    };
    let ends = act.bounds.iter().any(|bound| bound.at_end);
    let mut effects = act.start_effects.iter().chain(act.flow_effects).chain(act.end_effects);
    !is_fixed(act) && (ends || effects.any(timed))
}

fn mentions_duration(expression: &GroundExpression) -> bool {
    match expression {
        GroundExpression::Duration => true,
        GroundExpression::Sum(parts) | GroundExpression::Product(parts) => {
            parts.iter().any(mentions_duration)
        }
        GroundExpression::Difference(left, right) | GroundExpression::Quotient(left, right) => {
            mentions_duration(left) || mentions_duration(right)
        }
        GroundExpression::Negative(inner) => mentions_duration(inner),
        _ => false,
    }
}

fn grounding(task: &Task, origin: &Origin) -> Vec<(usize, Vec<u32>)> {
    let object = |term: &Term| match term {
        Term::Variable(slot) => origin.arguments.get(slot.index()).copied(),
        Term::Object(object) => Some(object.0),
        Term::Function(_) => None,
    };
    let calls = &task.actions[origin.schema as usize].grounding;
    calls
        .iter()
        .map(|call| (call.module.index(), call.arguments.iter().filter_map(object).collect()))
        .collect()
}
