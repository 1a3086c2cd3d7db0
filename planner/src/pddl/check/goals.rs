//! Checks of the goal, preferences, trajectory constraints and metric.

use super::conditions::all_of;
use super::expressions::Place;
use super::{Checker, Scope};
use crate::diagnostic::Diagnostic;
use crate::pddl::ast::{self, Formula, Modal};
use crate::task::{Condition, Metric, PreferenceId, PreferredGoal, Quantified, Scoped, Trajectory};

impl Checker<'_> {
    pub(super) fn goal(&mut self, formula: &Formula) {
        let mut scope = Scope::default();
        let mut hard = Vec::new();
        self.goal_part(formula, &mut scope, &[], None, &mut hard);
        self.task.goal = Scoped { slots: scope.slots, body: all_of(hard) };
    }

    /// Splits part of a goal: conditions go to `hard`, preferences and constraints to the task.
    fn goal_part(
        &mut self,
        formula: &Formula,
        scope: &mut Scope,
        forall: &[Quantified],
        preference: Option<PreferenceId>,
        hard: &mut Vec<Condition>,
    ) {
        match formula {
            Formula::And(parts) if preference.is_none() => {
                for part in parts {
                    self.goal_part(part, scope, forall, None, hard);
                }
            }
            Formula::Forall(variables, inner) if preference.is_none() && is_soft(inner) => {
                let (before, quantified) = self.quantify(variables, scope);
                let around: Vec<Quantified> = forall.iter().cloned().chain(quantified).collect();
                self.goal_part(inner, scope, &around, None, hard);
                scope.variables.truncate(before);
            }
            Formula::Preference(name, inner, span) => {
                let id = self.preference(*name);
                if matches!(**inner, Formula::Modal { .. }) {
                    self.trajectory(inner, scope, forall, Some(id));
                    return;
                }
                if let Some(condition) = self.condition(inner, false, Place::Condition, scope) {
                    let (forall, slots, span) = (forall.to_vec(), scope.slots, *span);
                    let goal = PreferredGoal { forall, condition, slots, span };
                    self.task.preferences[id.index()].goals.push(goal);
                }
            }
            Formula::Modal { .. } => self.trajectory(formula, scope, forall, preference),
            other => hard.extend(self.condition(other, false, Place::Condition, scope)),
        }
    }

    pub(super) fn constraint(&mut self, formula: &Formula) {
        let mut scope = Scope::default();
        self.constraint_part(formula, &mut scope, &[], None);
    }

    fn constraint_part(
        &mut self,
        formula: &Formula,
        scope: &mut Scope,
        forall: &[Quantified],
        preference: Option<PreferenceId>,
    ) {
        match formula {
            Formula::And(parts) => {
                for part in parts {
                    self.constraint_part(part, scope, forall, preference);
                }
            }
            Formula::Forall(variables, inner) => {
                let (before, quantified) = self.quantify(variables, scope);
                let around: Vec<Quantified> = forall.iter().cloned().chain(quantified).collect();
                self.constraint_part(inner, scope, &around, preference);
                scope.variables.truncate(before);
            }
            Formula::Preference(name, inner, span) if preference.is_none() => {
                let id = self.preference(*name);
                if matches!(&**inner, Formula::And(parts) if parts.len() > 1)
                    || matches!(&**inner, Formula::Forall(..))
                {
                    let message = "a preference over several constraints at once is not supported";
                    let help = "give each constraint a preference of its own";
                    self.push(
                        Diagnostic::error("not-supported", message, *span, "not supported").with_help(help),
                    );
                    return;
                }
                self.constraint_part(inner, scope, forall, Some(id));
            }
            Formula::Modal { .. } => self.trajectory(formula, scope, forall, preference),
            other => {
                let span = super::conditions::span_of_formula(other);
                let message = "a constraint says when its condition must hold";
                let help = "for example `(always …)`, `(sometime …)` or `(at end …)`";
                self.push(Diagnostic::error("syntax", message, span, "when must this hold?").with_help(help));
            }
        }
    }

    fn trajectory(
        &mut self,
        formula: &Formula,
        scope: &mut Scope,
        forall: &[Quantified],
        preference: Option<PreferenceId>,
    ) {
        let Formula::Modal { operator, times_s, formulas, span } = formula else { return };
        let conditions: Vec<Option<Condition>> =
            formulas.iter().map(|inner| self.condition(inner, false, Place::Condition, scope)).collect();
        let Some(conditions) = conditions.into_iter().collect::<Option<Vec<_>>>() else { return };
        // The last state is what goals speak of.
        if let (Modal::AtEnd, Some(id)) = (operator, preference) {
            let condition = all_of(conditions);
            let goal = PreferredGoal { forall: forall.to_vec(), condition, slots: scope.slots, span: *span };
            self.task.preferences[id.index()].goals.push(goal);
            return;
        }
        self.task.constraints.push(Trajectory {
            forall: forall.to_vec(),
            operator: *operator,
            times_s: times_s.clone(),
            conditions,
            slots: scope.slots,
            preference,
            span: *span,
        });
    }

    pub(super) fn metric(&mut self, metric: &ast::MetricAst) {
        let scope = Scope::default();
        if let Some(value) = self.expression(&metric.value, Place::Metric, &scope) {
            self.task.metric = Some(Metric { minimise: metric.minimise, value, span: metric.span });
        }
    }
}

/// True if a formula contains a preference or a trajectory constraint.
fn is_soft(formula: &Formula) -> bool {
    match formula {
        Formula::Preference(..) | Formula::Modal { .. } => true,
        Formula::And(parts) => parts.iter().any(is_soft),
        Formula::Forall(_, inner) => is_soft(inner),
        _ => false,
    }
}
