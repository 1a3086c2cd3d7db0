//! Delete-relaxed reachability of the goal, counting only effects that are certain. Numeric
//! conditions and attachments are not evaluated: conditions that need them count as unreachable.

use crate::ground::{
    Change, Conjunction, DurativeAction, GroundAction, GroundDurationBound, GroundEffect, GroundExpression,
    GroundFact, GroundOutcome, GroundTask, GroundWhen,
};
use crate::model::agreement::contradictions;
use crate::model::relation::Relation;

/// True if the goal is reachable under delete relaxation; false if unreachable or unknown.
pub(super) fn could_be_had(ground: &GroundTask) -> bool {
    let mut had = Had::new(ground);
    while had.grow() {}
    ground.goal_reachable && had.holds(&ground.goal)
}

/// Facts and actions reached so far.
struct Had<'g> {
    ground: &'g GroundTask,
    /// True for reached facts, by variable and value.
    facts: Vec<Vec<bool>>,
    /// True for actions applied so far: `[0]` instantaneous, `[1]` durative, by index.
    taken: [Vec<bool>; 2],
}

impl<'g> Had<'g> {
    fn new(ground: &'g GroundTask) -> Had<'g> {
        let none = ground.variables.iter().map(|variable| vec![false; variable.values.len()]);
        let taken = [vec![false; ground.actions.len()], vec![false; ground.durative.len()]];
        let mut had = Had { ground, facts: none.collect(), taken };
        for (values, &value) in had.facts.iter_mut().zip(&ground.initial.values) {
            values[value as usize] = true;
        }
        ground.timed.iter().flat_map(|timed| &timed.outcomes).for_each(|outcome| had.make(outcome));
        had
    }

    /// Applies every applicable action and axiom once; true if a fact or action was newly reached.
    fn grow(&mut self) -> bool {
        let ground = self.ground;
        let before = self.count();
        for (index, action) in ground.actions.iter().enumerate() {
            if self.taken[0][index] || self.can_take(action) {
                self.taken[0][index] = true;
                self.happen(&action.effects);
            }
        }
        for (index, action) in ground.durative.iter().enumerate() {
            if self.taken[1][index] || self.can_run(action) {
                self.taken[1][index] = true;
                self.happen(&action.start_effects);
                self.happen(&action.end_effects);
            }
        }
        for axiom in &ground.axioms {
            if self.holds(&axiom.body) {
                self.facts[axiom.head.variable as usize][axiom.head.value as usize] = true;
            }
        }
        self.count() > before
    }

    fn count(&self) -> usize {
        let flags = self.facts.iter().chain(&self.taken);
        flags.map(|flags| flags.iter().filter(|flag| **flag).count()).sum()
    }

    fn holds(&self, condition: &Conjunction) -> bool {
        self.holds_after(&[], condition)
    }

    /// True if a condition holds with the facts reached and those that `effects` set.
    fn holds_after(&self, effects: &[GroundEffect], condition: &Conjunction) -> bool {
        let given = |fact: &GroundFact| {
            let mut outcomes = self.happening(effects);
            outcomes.any(|outcome| *outcome == GroundOutcome::Set(*fact))
        };
        let has = |fact: &GroundFact| self.facts[fact.variable as usize][fact.value as usize] || given(fact);
        condition.comparisons.is_empty() && condition.calls.is_empty() && condition.facts.iter().all(has)
    }

    fn can_take(&self, action: &GroundAction) -> bool {
        self.holds(&action.condition) && self.can_happen(&action.effects)
    }

    /// True if a durative action is applicable, given the effects of its own start.
    fn can_run(&self, action: &DurativeAction) -> bool {
        let lists = [&action.start_effects, &action.flow_effects, &action.end_effects];
        let inside = [&action.over_all, &action.at_end];
        self.holds(&action.at_start)
            && inside.into_iter().all(|condition| self.holds_after(&action.start_effects, condition))
            && lists.into_iter().all(|effects| self.can_happen(effects))
            && lasts(&action.duration)
    }

    /// True if effects certainly have a result: constant amounts are added to defined numbers, and
    /// each object fluent gets one value.
    fn can_happen(&self, effects: &[GroundEffect]) -> bool {
        let kinds = effects.iter().filter_map(|effect| match effect.outcome {
            GroundOutcome::Change { fluent, change, amount: GroundExpression::Constant(amount) } => {
                Some((fluent, change, amount))
            }
            _ => None,
        });
        contradictions(kinds).is_empty()
            && !GroundEffect::some_contest(effects, &self.ground.variables)
            && effects.iter().all(|effect| self.has_result(effect))
    }

    fn has_result(&self, effect: &GroundEffect) -> bool {
        match &effect.outcome {
            GroundOutcome::Set(_) => true,
            GroundOutcome::Change { fluent, change, amount: GroundExpression::Constant(amount) } => {
                match change {
                    Change::Assign => amount.is_finite(),
                    Change::Increase | Change::Decrease => {
                        amount.is_finite() && self.ground.initial.numbers[*fluent as usize].is_finite()
                    }
                    Change::ScaleUp | Change::ScaleDown => false,
                }
            }
            _ => false,
        }
    }

    /// Outcomes of the effects whose conditions are reached.
    fn happening<'e>(&self, effects: &'e [GroundEffect]) -> impl Iterator<Item = &'e GroundOutcome> {
        let holds = |when: &GroundWhen| {
            [&when.here, &when.at_start, &when.over_all].into_iter().all(|part| self.holds(part))
        };
        let happening = effects.iter().filter(move |effect| effect.when.as_deref().is_none_or(holds));
        happening.map(|effect| &effect.outcome)
    }

    fn happen(&mut self, effects: &[GroundEffect]) {
        let outcomes: Vec<&GroundOutcome> = self.happening(effects).collect();
        outcomes.into_iter().for_each(|outcome| self.make(outcome));
    }

    fn make(&mut self, outcome: &GroundOutcome) {
        if let GroundOutcome::Set(fact) = outcome {
            self.facts[fact.variable as usize][fact.value as usize] = true;
        }
    }
}

/// True if all duration bounds are constants and allow some positive duration.
fn lasts(bounds: &[GroundDurationBound]) -> bool {
    let (mut least_s, mut most_s) = (0.0_f64, f64::INFINITY);
    for bound in bounds {
        let GroundExpression::Constant(seconds) = bound.seconds else { return false };
        match bound.relation {
            Relation::AtLeast => least_s = least_s.max(seconds),
            Relation::AtMost => most_s = most_s.min(seconds),
            Relation::Equal => (least_s, most_s) = (least_s.max(seconds), most_s.min(seconds)),
            Relation::Greater | Relation::Less | Relation::Unequal => return false,
        }
    }
    0.0 < most_s && least_s <= most_s && least_s.is_finite()
}
