//! Plan cost: a sum of operator costs if the metric is such a sum, else a function of the states.

use crate::ground::{GroundExpression, GroundTask};

use super::compiled::Compiled;
use super::numbers::{Linear, Numbers, add_linear};

/// Measure of a plan's cost; maximised metrics are negated.
#[derive(Clone, Debug)]
pub struct ClassicalMeasure {
    kind: Kind,
    /// Estimated cost of each operator; exact if plan cost is a sum of constant operator costs.
    pub estimates: Vec<f64>,
}

#[derive(Clone, Debug)]
enum Kind {
    /// Plan cost is the sum of fixed operator costs, those in `estimates`.
    Sum,
    /// Plan cost is a sum of operator costs that depend on the state before the operator; each is
    /// multiplied by the sign (-1 to maximise).
    Adding(Vec<GroundExpression>, f64),
    /// Plan cost is an expression over the final state, multiplied by the sign (-1 to maximise).
    Last(GroundExpression, f64),
}

impl ClassicalMeasure {
    /// Measure of a task's plans.
    pub(crate) fn new(task: &GroundTask, numbers: &Numbers) -> ClassicalMeasure {
        let sign = if task.metric.as_ref().is_none_or(|m| m.minimise) { 1.0 } else { -1.0 };
        if let Some(metric) = task.metric.as_ref().filter(|m| !m.additive) {
            return of_last(&metric.expression, sign, numbers);
        }
        let constant =
            |e: &GroundExpression| if let GroundExpression::Constant(v) = e { Some(sign * v) } else { None };
        let costs: Option<Vec<f64>> = task.actions.iter().map(|a| constant(&a.cost)).collect();
        if let Some(estimates) = costs {
            return ClassicalMeasure { kind: Kind::Sum, estimates };
        }
        let first = |e: &GroundExpression| {
            let value = sign * super::numbers::evaluate(e, &|n| numbers.initial[n as usize]);
            if value.is_finite() { value.max(0.0) } else { 1.0 }
        };
        let estimates = task.actions.iter().map(|a| first(&a.cost)).collect();
        let kind = Kind::Adding(task.actions.iter().map(|a| a.cost.clone()).collect(), sign);
        ClassicalMeasure { kind, estimates }
    }

    /// True if plan cost is the sum of constant operator costs.
    pub(crate) fn is_sum(&self) -> bool {
        matches!(self.kind, Kind::Sum)
    }

    /// Plan cost as a function of the final state; `None` if it depends on more than that state.
    pub(crate) fn of_last(&self, numbers: &Numbers, state: &[u32]) -> Option<f64> {
        match &self.kind {
            Kind::Last(expression, sign) => Some(sign * numbers.value(expression, state)),
            Kind::Sum | Kind::Adding(..) => None,
        }
    }

    /// Cost of a plan that starts in the initial state.
    pub(crate) fn of(&self, task: &Compiled, plan: &[u32]) -> f64 {
        let (mut state, mut sum) = (task.initial.clone(), 0.0);
        match &self.kind {
            Kind::Sum => plan.iter().map(|&op| self.estimates[op as usize]).sum(),
            Kind::Adding(costs, sign) => {
                for &op in plan {
                    sum += sign * task.numbers.value(&costs[op as usize], &state);
                    task.advance(op, &mut state);
                }
                sum
            }
            Kind::Last(expression, sign) => {
                plan.iter().for_each(|&op| task.advance(op, &mut state));
                sign * task.numbers.value(expression, &state)
            }
        }
    }
}

/// Measure that depends on the final state only. Operator costs are estimated from constant changes if
/// the metric is linear; otherwise each operator costs one.
fn of_last(expression: &GroundExpression, sign: f64, numbers: &Numbers) -> ClassicalMeasure {
    let kind = Kind::Last(expression.clone(), sign);
    let mut linear = Linear::default();
    if !add_linear(expression, sign, &mut linear) {
        return ClassicalMeasure { kind, estimates: vec![1.0; numbers.changes.len()] };
    }
    let weight = |number: u32| linear.weights.iter().find(|(n, _)| *n == number).map_or(0.0, |(_, w)| *w);
    let adds = |change: &super::numbers::NumberChange| {
        change.constant_gain().map_or(0.0, |gain| gain * weight(change.number))
    };
    let cost = |changes: &Vec<_>| changes.iter().map(adds).sum::<f64>().max(0.0);
    ClassicalMeasure { kind, estimates: numbers.changes.iter().map(cost).collect() }
}
