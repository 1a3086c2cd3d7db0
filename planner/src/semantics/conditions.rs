//! Evaluation of conditions, terms and expressions in a state.

use serde::{Deserialize, Serialize};

use super::{Binding, CallFailure, Semantics};
use crate::attachment::Answer;
use crate::diagnostic::Span;
use crate::model::relation::{Relation, quotient};
use crate::model::walk;
use crate::plan::number_text;
use crate::state::State;
use crate::task::{Comparison, Condition, Expression, Fluent, ObjectId, Quantified, Term};

/// Unmet part of a condition, with the values that decide it.
#[derive(Debug, Clone, PartialEq)]
pub struct Why {
    /// Text of the part in PDDL, with objects for its variables.
    pub condition: String,
    /// Values of both sides; `None` unless the part is a numeric comparison.
    pub compared: Option<Compared>,
    /// Values that the part depends on: expression and value as text, such as `(fuel r)` and `3`.
    pub values: Vec<(String, String)>,
    /// Span of the part in the task.
    pub span: Span,
}

/// Sides of a numeric comparison and their values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// Expression on the left, in PDDL.
    pub left: String,
    /// Value of the left side; `None` if undefined.
    pub left_value: Option<f64>,
    /// Relation required between the left and the right side.
    pub comparison: Comparison,
    /// Expression on the right, in PDDL.
    pub right: String,
    /// Value of the right side; `None` if undefined.
    pub right_value: Option<f64>,
}

impl Semantics<'_> {
    /// True if a condition holds in a state.
    pub fn holds(
        &self,
        state: &State,
        condition: &Condition,
        binding: &mut Binding,
    ) -> Result<bool, CallFailure> {
        Ok(match condition {
            Condition::And(parts) => {
                for part in parts {
                    if !self.holds(state, part, binding)? {
                        return Ok(false);
                    }
                }
                true
            }
            Condition::Or(parts) => {
                for part in parts {
                    if self.holds(state, part, binding)? {
                        return Ok(true);
                    }
                }
                false
            }
            Condition::Not(leaf) => match &**leaf {
                Condition::Compare(comparison, sides, _) => match self.both(state, sides, binding)? {
                    Some((left, right)) => Relation::of(*comparison, false).holds(left, right),
                    None => false,
                },
                other => !self.holds(state, other, binding)?,
            },
            Condition::Forall(variables, inner) => {
                !self.some_binding(variables, binding, &mut |binding| {
                    Ok(!self.holds(state, inner, binding)?)
                })?
            }
            Condition::Exists(variables, inner) => {
                self.some_binding(variables, binding, &mut |binding| self.holds(state, inner, binding))?
            }
            Condition::Atom(atom) => match self.objects(state, &atom.arguments, binding) {
                Some(arguments) => state.holds(atom.predicate, &arguments),
                None => false,
            },
            Condition::Same(terms, _) => {
                let [left, right] = &**terms;
                let left = self.object(state, left, binding);
                left.is_some() && left == self.object(state, right, binding)
            }
            Condition::Compare(comparison, sides, _) => match self.both(state, sides, binding)? {
                Some((left, right)) => Relation::of(*comparison, true).holds(left, right),
                None => false,
            },
            Condition::Call(call) => matches!(self.ask(state, call, binding)?, Some(Answer::Truth(true))),
        })
    }

    /// True if `test` returns true for some binding of the variables; tries no further binding after
    /// that.
    pub(crate) fn some_binding(
        &self,
        variables: &[Quantified],
        binding: &mut Binding,
        test: &mut dyn FnMut(&mut Binding) -> Result<bool, CallFailure>,
    ) -> Result<bool, CallFailure> {
        let Some((first, rest)) = variables.split_first() else { return test(binding) };
        for &object in first.parameter.objects.iter() {
            if !self.go_on() {
                break;
            }
            binding.set(first.slot, object);
            if self.some_binding(rest, binding, test)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn both(
        &self,
        state: &State,
        sides: &[Expression; 2],
        binding: &Binding,
    ) -> Result<Option<(f64, f64)>, CallFailure> {
        let (left, right) =
            (self.number(state, &sides[0], binding)?, self.number(state, &sides[1], binding)?);
        Ok(left.zip(right))
    }

    /// Object that a term denotes; `None` if the term is undefined.
    pub fn object(&self, state: &State, term: &Term, binding: &Binding) -> Option<ObjectId> {
        match term {
            Term::Variable(slot) => Some(binding.get(*slot)),
            Term::Object(id) => Some(*id),
            Term::Function(fluent) => {
                let arguments = self.objects(state, &fluent.arguments, binding)?;
                state.object(fluent.function, &arguments)
            }
        }
    }

    pub(crate) fn objects(&self, state: &State, terms: &[Term], binding: &Binding) -> Option<Vec<ObjectId>> {
        terms.iter().map(|term| self.object(state, term, binding)).collect()
    }

    fn fluent(&self, state: &State, fluent: &Fluent, binding: &Binding) -> Option<f64> {
        let arguments = self.objects(state, &fluent.arguments, binding)?;
        state.number(fluent.function, &arguments)
    }

    /// Metric value of a plan, from its final state, its end (seconds, or number of steps) and the
    /// number of violations of each preference; `None` if there is no metric or its value is undefined.
    ///
    /// # Errors
    /// [`CallFailure`] if an attachment gives no answer.
    pub fn measured(&self, state: &State, end: f64, violations: &[f64]) -> Result<Option<f64>, CallFailure> {
        let Some(metric) = &self.task.metric else { return Ok(None) };
        let known = walk::replaced(&metric.value, &|part| match part {
            Expression::TotalTime => Some(Expression::Number(end)),
            Expression::Violated(id) => violations.get(id.index()).copied().map(Expression::Number),
            _ => None,
        });
        self.number(state, &known, &Binding::new(0))
    }

    /// Value of an expression; `None` if undefined. `total-time` and `is-violated` are undefined here;
    /// only [`Semantics::measured`] knows them.
    pub fn number(
        &self,
        state: &State,
        expression: &Expression,
        binding: &Binding,
    ) -> Result<Option<f64>, CallFailure> {
        let all = |parts: &[Expression]| -> Result<Option<Vec<f64>>, CallFailure> {
            parts.iter().map(|part| self.number(state, part, binding)).collect()
        };
        Ok(match expression {
            Expression::Number(number) => Some(*number),
            Expression::Fluent(fluent) => self.fluent(state, fluent, binding),
            Expression::Add(parts) => all(parts)?.map(|values| values.iter().sum()),
            Expression::Multiply(parts) => all(parts)?.map(|values| values.iter().product()),
            Expression::Subtract(sides) => {
                self.both(state, sides, binding)?.map(|(left, right)| left - right)
            }
            Expression::Divide(sides) => self
                .both(state, sides, binding)?
                .map(|(left, right)| quotient(left, right))
                .filter(|value| !value.is_nan()),
            Expression::Negative(inner) => self.number(state, inner, binding)?.map(|value| -value),
            Expression::Duration => binding.duration_s,
            Expression::TotalTime | Expression::Violated(_) => None,
            Expression::Call(call) => match self.ask(state, call, binding)? {
                Some(Answer::Number(number)) => Some(number),
                _ => None,
            },
        })
    }

    /// First violated part of a condition, without enclosing `and` and `forall`; `None` if the
    /// condition holds.
    pub fn why_not(
        &self,
        state: &State,
        condition: &Condition,
        binding: &mut Binding,
    ) -> Result<Option<Why>, CallFailure> {
        if self.holds(state, condition, binding)? {
            return Ok(None);
        }
        match condition {
            Condition::And(parts) => {
                for part in parts {
                    if let Some(why) = self.why_not(state, part, binding)? {
                        return Ok(Some(why));
                    }
                }
                Ok(None)
            }
            Condition::Forall(variables, inner) => {
                let mut found = None;
                self.some_binding(variables, binding, &mut |binding| {
                    found = self.why_not(state, inner, binding)?;
                    Ok(found.is_some())
                })?;
                Ok(found)
            }
            Condition::Or(parts) if parts.len() == 1 => self.why_not(state, &parts[0], binding),
            other => Ok(Some(Why {
                condition: self.condition_text(other, binding),
                compared: self.compared(state, other, binding)?,
                values: self.values_in(state, other, binding)?,
                span: self.span_of(other),
            })),
        }
    }

    /// Both sides of a comparison, with their values; `None` if the condition is no comparison.
    fn compared(
        &self,
        state: &State,
        condition: &Condition,
        binding: &Binding,
    ) -> Result<Option<Compared>, CallFailure> {
        let Condition::Compare(comparison, sides, _) = condition else { return Ok(None) };
        let side =
            |side: &Expression| Ok((self.expression_text(side, binding), self.number(state, side, binding)?));
        let ((left, left_value), (right, right_value)) = (side(&sides[0])?, side(&sides[1])?);
        Ok(Some(Compared { left, left_value, comparison: *comparison, right, right_value }))
    }

    /// Expressions that decide a comparison or equation, each with its value as text; empty for other
    /// conditions.
    fn values_in(
        &self,
        state: &State,
        condition: &Condition,
        binding: &Binding,
    ) -> Result<Vec<(String, String)>, CallFailure> {
        let mut values = Vec::new();
        match condition {
            Condition::Not(leaf) => return self.values_in(state, leaf, binding),
            Condition::Compare(_, sides, _) => {
                for side in sides.iter().filter(|side| !matches!(side, Expression::Number(_))) {
                    let value = self.number(state, side, binding)?;
                    values.push((self.expression_text(side, binding), value_text(value)));
                }
            }
            Condition::Same(terms, _) => {
                for term in terms.iter().filter(|term| matches!(term, Term::Function(_))) {
                    let value = self.object(state, term, binding);
                    let value = value.map_or("undefined", |id| self.task.object(id).name.as_str());
                    values.push((self.term_text(term, binding), value.to_string()));
                }
            }
            _ => {}
        }
        Ok(values)
    }
}

/// Text of a number for people; `undefined` for `None`.
pub(crate) fn value_text(value: Option<f64>) -> String {
    value.map_or("undefined".to_string(), number_text)
}
