//! Earliest times at which facts can hold, under a delete relaxation in which only facts of timed
//! literals ever end.
//!
//! Times spread from the initial facts (Dijkstra 1959): an operator's effects come no earlier than
//! all its preconditions, and never if one of the preconditions has ended by then.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::grouped::Grouped;

use super::task::{
    Conjunction, GroundDurationBound, GroundEffect, GroundExpression, GroundFact, GroundOutcome, GroundTask,
    Place, Relation,
};

/// Times that differ by less than this count as equal, seconds.
const ROUNDING_S: f64 = 1e-6;

/// Operator of the relaxed task; `missing` counts its preconditions that are not reached yet.
struct Operator {
    missing: u32,
    /// Latest earliest time among the preconditions that are known so far, seconds.
    base_s: f64,
    /// Earliest end among the operator's preconditions, seconds; infinite if none ever ends.
    until_s: f64,
    gives: Vec<u32>,
}

/// Earliest times of all facts, seconds from the start of the plan.
pub(crate) struct Earliest<'g> {
    ground: &'g GroundTask,
    /// Index of the proposition for value 0 of each variable; its other values follow. Propositions
    /// "this durative action has started" come after all facts.
    offsets: Vec<u32>,
    /// Time from which each fact is false for good, seconds; infinite if it never ends.
    until_s: Vec<f64>,
    operators: Vec<Operator>,
    /// Each precondition of an operator: its proposition, the operator's index, and the delay from
    /// the precondition to the operator's effects, seconds.
    waits: Vec<(u32, (u32, f64))>,
    labels_s: Vec<f64>,
}

impl<'g> Earliest<'g> {
    /// Computes the earliest times of a grounded task.
    pub(crate) fn new(ground: &'g GroundTask) -> Earliest<'g> {
        let mut offsets = Vec::with_capacity(ground.variables.len());
        let mut facts = 0;
        for variable in &ground.variables {
            offsets.push(facts);
            facts += variable.domain_size();
        }
        let mut earliest = Earliest {
            ground,
            offsets,
            until_s: vec![f64::INFINITY; facts as usize],
            operators: Vec::new(),
            waits: Vec::new(),
            labels_s: vec![f64::INFINITY; facts as usize + ground.durative.len()],
        };
        earliest.operators(facts);
        earliest.endings();
        earliest.spread();
        earliest
    }

    /// Lower bound on the time at which a condition can hold, seconds: the latest of its facts'
    /// earliest times. Infinite if one of them never holds.
    pub(crate) fn of(&self, condition: &Conjunction) -> f64 {
        let labels = condition.facts.iter().map(|&fact| self.labels_s[self.place(fact) as usize]);
        labels.fold(0.0, f64::max)
    }

    /// True if no fact of the condition is ended for good by a timed literal.
    pub(crate) fn lasts(&self, condition: &Conjunction) -> bool {
        condition.facts.iter().all(|&fact| self.until_s[self.place(fact) as usize].is_infinite())
    }

    fn place(&self, fact: GroundFact) -> u32 {
        self.offsets[fact.variable as usize] + fact.value
    }

    fn operators(&mut self, facts: u32) {
        let ground = self.ground;
        for (action, started) in ground.durative.iter().zip(facts..) {
            // What its start may change need not hold before it.
            let kept = |fact: &&GroundFact| {
                let derived = ground.variables[fact.variable as usize].stratum.is_some();
                !derived && action.start_effects.iter().all(|effect| !writes(ground, effect, fact.variable))
            };
            let inside: Vec<GroundFact> = action.over_all.facts.iter().filter(kept).copied().collect();
            let at_start: Vec<&[GroundFact]> = vec![&action.at_start.facts, &inside];
            self.operator(&at_start, None, vec![started]);
            let takes_s = |bound: &&GroundDurationBound| {
                !bound.at_end
                    && matches!(bound.relation, Relation::Equal | Relation::AtLeast | Relation::Greater)
            };
            let bounds = action.duration.iter().filter(takes_s).filter_map(|bound| match bound.seconds {
                GroundExpression::Constant(seconds) => Some(seconds),
                _ => None,
            });
            let least_s = bounds.fold(0.0, f64::max);
            let at_end: [&[GroundFact]; 2] = [&action.over_all.facts, &action.at_end.facts];
            self.effects(&at_start, None, &action.start_effects);
            self.effects(&at_end, Some((started, least_s)), &action.end_effects);
        }
        for action in &ground.actions {
            self.effects(&[&action.condition.facts], None, &action.effects);
        }
        for axiom in &ground.axioms {
            self.operator(&[&axiom.body.facts], None, vec![self.place(axiom.head)]);
        }
        // Anything derived may be absent, and what is given from outside comes by itself.
        for (&first, variable) in self.offsets.iter().zip(&ground.variables) {
            if variable.stratum.is_some() {
                self.labels_s[first as usize + 1] = 0.0;
            }
        }
        for (variable, &value) in (0..).zip(&ground.initial.values) {
            let place = self.place(GroundFact { variable, value });
            self.labels_s[place as usize] = 0.0;
        }
        for timed in &ground.timed {
            let given: Vec<u32> = timed.outcomes.iter().flat_map(|outcome| self.given(outcome)).collect();
            for place in given {
                let label_s = &mut self.labels_s[place as usize];
                *label_s = label_s.min(timed.time_s.max(0.0));
            }
        }
    }

    /// Adds operators for the effects of an action. `started`: the proposition that a durative
    /// action has started and the least time from there to the effects, seconds.
    fn effects(&mut self, needs: &[&[GroundFact]], started: Option<(u32, f64)>, effects: &[GroundEffect]) {
        let plain = effects.iter().filter(|effect| effect.when.is_none());
        let gives: Vec<u32> = plain.flat_map(|effect| self.given(&effect.outcome)).collect();
        self.operator(needs, started, gives);
        for effect in effects {
            let Some(when) = &effect.when else { continue };
            // What held at the start may be over by the end.
            let more: [&[GroundFact]; 2] = [&when.here.facts, &when.over_all.facts];
            let needs: Vec<&[GroundFact]> = needs.iter().copied().chain(more).collect();
            self.operator(&needs, started, self.given(&effect.outcome));
        }
    }

    fn operator(&mut self, needs: &[&[GroundFact]], started: Option<(u32, f64)>, gives: Vec<u32>) {
        if gives.is_empty() {
            return;
        }
        let own = self.operators.len() as u32;
        let mut places: Vec<u32> =
            needs.iter().flat_map(|facts| facts.iter()).map(|&fact| self.place(fact)).collect();
        places.sort_unstable();
        places.dedup();
        let missing = (places.len() + usize::from(started.is_some())) as u32;
        self.waits.extend(places.into_iter().map(|place| (place, (own, 0.0))));
        self.waits.extend(started.map(|(started, after_s)| (started, (own, after_s))));
        self.operators.push(Operator { missing, base_s: 0.0, until_s: f64::INFINITY, gives });
    }

    fn given(&self, outcome: &GroundOutcome) -> Vec<u32> {
        match outcome {
            GroundOutcome::Set(fact) => vec![self.place(*fact)],
            GroundOutcome::Call(call) => {
                let written = self.ground.calls[*call as usize].writes.iter().filter_map(set_by_a_call);
                let values = |variable: u32| self.ground.variables[variable as usize].domain_size();
                let all =
                    |variable: u32| (0..values(variable)).map(move |value| GroundFact { variable, value });
                written.flat_map(all).map(|fact| self.place(fact)).collect()
            }
            GroundOutcome::Change { .. } | GroundOutcome::Flow { .. } => Vec::new(),
        }
    }

    /// Determines the times at which facts end that no operator achieves, only the initial state
    /// and timed literals, and from these the end of each operator.
    fn endings(&mut self) {
        let mut made = vec![false; self.until_s.len()];
        let facts = made.len();
        let gives = self.operators.iter().flat_map(|operator| &operator.gives);
        gives.filter(|&&place| (place as usize) < facts).for_each(|&place| made[place as usize] = true);
        let mut now = self.ground.initial.values.clone();
        for timed in &self.ground.timed {
            for outcome in &timed.outcomes {
                let GroundOutcome::Set(fact) = *outcome else { continue };
                let before = std::mem::replace(&mut now[fact.variable as usize], fact.value);
                let before = self.place(GroundFact { variable: fact.variable, value: before }) as usize;
                self.until_s[before] = timed.time_s;
                let after = self.place(fact) as usize;
                self.until_s[after] = f64::INFINITY;
            }
        }
        let derived = |variable: usize| self.ground.variables[variable].stratum.is_some();
        for (variable, &first) in self.offsets.iter().enumerate().filter(|&(variable, _)| derived(variable)) {
            let values = self.ground.variables[variable].domain_size() as usize;
            made[first as usize..first as usize + values].fill(true);
        }
        for (until_s, _) in self.until_s.iter_mut().zip(made).filter(|&(_, made)| made) {
            *until_s = f64::INFINITY;
        }
        for &(place, (operator, _)) in &self.waits {
            let Some(&until_s) = self.until_s.get(place as usize) else { continue };
            let own = &mut self.operators[operator as usize].until_s;
            *own = own.min(until_s);
        }
    }

    fn spread(&mut self) {
        let waits = Grouped::new(self.labels_s.len(), self.waits.iter().copied());
        // Times are never negative: their bits are in the same order as they are.
        let key = |label_s: f64, place: u32| Reverse((label_s.to_bits(), place));
        let known = (0..).zip(&self.labels_s).filter(|(_, label_s)| label_s.is_finite());
        let mut queue: BinaryHeap<_> = known.map(|(place, &label_s)| key(label_s, place)).collect();
        let free = self.operators.iter().filter(|operator| operator.missing == 0);
        for place in free.flat_map(|operator| &operator.gives) {
            queue.push(key(0.0, *place));
            self.labels_s[*place as usize] = 0.0;
        }
        let mut done = vec![false; self.labels_s.len()];
        while let Some(Reverse((_, place))) = queue.pop() {
            if std::mem::replace(&mut done[place as usize], true) {
                continue;
            }
            let label_s = self.labels_s[place as usize];
            for &(own, after_s) in waits.of(place) {
                let operator = &mut self.operators[own as usize];
                operator.base_s = operator.base_s.max(label_s + after_s);
                operator.missing -= 1;
                if operator.missing > 0 || operator.base_s > operator.until_s + ROUNDING_S {
                    continue;
                }
                for &given in &operator.gives {
                    if operator.base_s < self.labels_s[given as usize] {
                        self.labels_s[given as usize] = operator.base_s;
                        queue.push(key(operator.base_s, given));
                    }
                }
            }
        }
    }
}

fn set_by_a_call(place: &Place) -> Option<u32> {
    match place {
        Place::Truth(variable) | Place::Object(variable) => Some(*variable),
        Place::Number(_) | Place::Nowhere => None,
    }
}

/// True if an effect may change a variable.
fn writes(ground: &GroundTask, effect: &GroundEffect, variable: u32) -> bool {
    match &effect.outcome {
        GroundOutcome::Set(fact) => fact.variable == variable,
        GroundOutcome::Call(call) => {
            ground.calls[*call as usize].writes.iter().filter_map(set_by_a_call).any(|own| own == variable)
        }
        GroundOutcome::Change { .. } | GroundOutcome::Flow { .. } => false,
    }
}
