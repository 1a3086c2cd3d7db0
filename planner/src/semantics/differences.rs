//! Differences between the two sides of numeric comparisons.

use super::{Binding, CallFailure, Semantics};
use crate::model::walk::{self, Part};
use crate::state::State;
use crate::task::{Condition, Quantified, Rule, Slot};

impl Semantics<'_> {
    /// Appends left minus right of every comparison in a condition, in the same order for every state;
    /// NaN if a side is undefined. Comparisons in rules: [`Semantics::rule_differences`].
    pub(crate) fn differences(
        &self,
        state: &State,
        condition: &Condition,
        binding: &mut Binding,
        found: &mut Vec<f64>,
    ) -> Result<(), CallFailure> {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                parts.iter().try_for_each(|part| self.differences(state, part, binding, found))?;
            }
            Condition::Not(inner) => self.differences(state, inner, binding, found)?,
            Condition::Forall(variables, inner) | Condition::Exists(variables, inner) => {
                self.some_binding(variables, binding, &mut |binding| {
                    self.differences(state, inner, binding, found)?;
                    Ok(false)
                })?;
            }
            Condition::Compare(_, sides, _) => {
                let [left, right] = sides.each_ref().map(|side| self.number(state, side, binding));
                found.push(left?.zip(right?).map_or(f64::NAN, |(left, right)| left - right));
            }
            Condition::Atom(_) | Condition::Same(..) | Condition::Call(_) => {}
        }
        Ok(())
    }

    /// Appends left minus right of every comparison in the rules of derived predicates, for all
    /// bindings.
    pub(crate) fn rule_differences(&self, state: &State, found: &mut Vec<f64>) -> Result<(), CallFailure> {
        for rule in self.task.rules.iter().filter(|rule| compares(rule)) {
            let slots = (0..).map(Slot).zip(&rule.parameters);
            let variables: Vec<Quantified> =
                slots.map(|(slot, parameter)| Quantified { slot, parameter: parameter.clone() }).collect();
            self.some_binding(&variables, &mut Binding::new(rule.slots), &mut |binding| {
                self.differences(state, &rule.body, binding, found)?;
                Ok(false)
            })?;
        }
        Ok(())
    }
}

fn compares(rule: &Rule) -> bool {
    let mut found = false;
    walk::condition(&rule.body, &mut |part| {
        found |= matches!(part, Part::Condition(Condition::Compare(..)));
    });
    found
}
