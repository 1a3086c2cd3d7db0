//! Analysis of the metric, and of numeric fluents that do nothing but accumulate costs.

use super::instantiate::{Deed, RawEffect};
use super::raw::{RawAction, RawTask};
use super::relevant::{is_risky, reads};
use super::task::{Change, Earns, GroundComparison, GroundExpression, GroundMetric};

/// Metric, split into costs of actions and numeric fluents that stay in the state.
pub(super) struct Costs {
    /// Weight in the metric of each numeric fluent that only accumulates costs and is therefore
    /// removed from the state; `None` for the others.
    pub weights: Vec<Option<f64>>,
    pub metric: Option<GroundMetric>,
    /// Numeric fluents of a metric that is not additive: these stay in the state.
    pub read: Vec<u32>,
}

/// Weights of the numeric fluents (`count` of them) and of the total time in an expression; `None`
/// if the expression is not linear.
pub(crate) fn weights(expression: &GroundExpression, count: usize) -> Option<(Vec<f64>, f64)> {
    let (mut weights, mut time) = (vec![0.0; count], 0.0);
    linear(expression, 1.0, &mut weights, &mut time).then_some((weights, time))
}

/// Adds the weights of a linear expression, times `factor`, to `weights` and `time`; `false` if the
/// expression is not linear.
fn linear(expression: &GroundExpression, factor: f64, weights: &mut [f64], time: &mut f64) -> bool {
    match expression {
        GroundExpression::Constant(_) => true,
        GroundExpression::Fluent(id) => {
            weights[*id as usize] += factor;
            true
        }
        GroundExpression::TotalTime => {
            *time += factor;
            true
        }
        GroundExpression::Sum(parts) => parts.iter().all(|p| linear(p, factor, weights, time)),
        GroundExpression::Difference(left, right) => {
            linear(left, factor, weights, time) && linear(right, -factor, weights, time)
        }
        GroundExpression::Negative(inner) => linear(inner, -factor, weights, time),
        GroundExpression::Product(parts) => {
            let constant: f64 = parts
                .iter()
                .filter_map(|p| if let GroundExpression::Constant(v) = p { Some(*v) } else { None })
                .product();
            let rest: Vec<_> = parts.iter().filter(|p| !matches!(p, GroundExpression::Constant(_))).collect();
            rest.len() <= 1 && rest.iter().all(|p| linear(p, factor * constant, weights, time))
        }
        GroundExpression::Quotient(left, right) => match **right {
            GroundExpression::Constant(by) => linear(left, factor / by, weights, time),
            _ => false,
        },
        GroundExpression::Call(_) | GroundExpression::Duration | GroundExpression::Violated(_) => false,
    }
}

/// Marks the numeric fluents that are not pure costs: read outside the metric, or changed other
/// than by unconditional increases and decreases by defined amounts.
fn not_just_costs(task: &RawTask, comparisons: &[GroundComparison], undefined: &[bool]) -> Vec<bool> {
    let mut read = vec![false; undefined.len()];
    let mark = |expression: &GroundExpression, read: &mut Vec<bool>| {
        reads(expression, &mut |id| read[id as usize] = true, &mut |_| {});
    };
    for comparison in comparisons {
        mark(&comparison.left, &mut read);
        mark(&comparison.right, &mut read);
    }
    for action in &task.actions {
        let later = action.later.as_ref();
        for effect in action.effects.iter().chain(later.iter().flat_map(|l| &l.end_effects)) {
            if let Deed::Change(id, change, amount) = &effect.deed {
                mark(amount, &mut read);
                let adds = matches!(change, Change::Increase | Change::Decrease);
                read[*id as usize] |=
                    !adds || effect.when.is_some() || is_risky(*change, *id, amount, undefined);
            }
        }
        if let Some(later) = later {
            later.duration.iter().for_each(|bound| mark(&bound.seconds, &mut read));
            for (id, rate) in &later.flows {
                read[*id as usize] = true;
                mark(rate, &mut read);
            }
        }
    }
    for (_, deeds) in &task.timed {
        for deed in deeds {
            if let Deed::Change(id, ..) = deed {
                read[*id as usize] = true;
            }
        }
    }
    read
}

/// Possibility that actions improve an additive metric. `sign`: 1 for minimisation, -1 for
/// maximisation.
fn earning(task: &RawTask, weights: &[f64], sign: f64) -> Earns {
    let earns = |effect: &RawEffect| match &effect.deed {
        Deed::Change(id, change, amount) => added(*change, amount, sign * weights[*id as usize]),
        _ => Earns::Never,
    };
    let effects = task.actions.iter().flat_map(|action| {
        let later = action.later.iter().flat_map(|later| &later.end_effects);
        action.effects.iter().chain(later)
    });
    effects.map(earns).max().unwrap_or(Earns::Never)
}

/// Possibility that one change of a number with this weight improves a metric that is minimised.
pub(crate) fn added(change: Change, amount: &GroundExpression, weight: f64) -> Earns {
    let weight = match change {
        _ if weight == 0.0 => return Earns::Never,
        Change::Increase => weight,
        Change::Decrease => -weight,
        _ => return Earns::Perhaps,
    };
    match (amount.is_never_negative(weight), amount.is_never_negative(-weight)) {
        (true, _) => Earns::Never,
        (false, true) => Earns::Surely,
        (false, false) => Earns::Perhaps,
    }
}

/// Splits the metric into costs and numbers. `keep` keeps all numeric fluents in the state,
/// `keep_metric` those of the metric.
pub(super) fn costs(
    task: &RawTask,
    comparisons: &[GroundComparison],
    undefined: &[bool],
    metric: Option<(bool, GroundExpression)>,
    keep: bool,
    keep_metric: bool,
) -> Costs {
    let count = undefined.len();
    let read = not_just_costs(task, comparisons, undefined);
    let mut weights = vec![0.0; count];
    let mut time_weight = 0.0;
    let Some((minimise, expression)) = metric else {
        let weights = (0..count).map(|id| (!read[id] && !keep).then_some(0.0)).collect();
        return Costs { weights, metric: None, read: Vec::new() };
    };
    let additive = !keep_metric
        && linear(&expression, 1.0, &mut weights, &mut time_weight)
        && (0..count).all(|id| weights[id] == 0.0 || !read[id]);
    let sign = if minimise { 1.0 } else { -1.0 };
    let earns = match additive {
        true if sign * time_weight < 0.0 => Earns::Surely,
        true => earning(task, &weights, sign),
        false => Earns::Perhaps,
    };
    let mut used = Vec::new();
    reads(&expression, &mut |id| used.push(id), &mut |_| {});
    let weights = (0..count).map(|id| {
        let in_metric = used.contains(&(id as u32));
        (!read[id] && if in_metric { additive } else { !keep }).then_some(weights[id])
    });
    let weights: Vec<_> = weights.collect();
    let read = if additive { Vec::new() } else { used };
    Costs { weights, metric: Some(GroundMetric { minimise, expression, additive, earns, time_weight }), read }
}

impl Costs {
    /// Contribution of an action to the metric through fluents that only accumulate costs; removes
    /// the effects on these fluents. Constant 1 for an instantaneous action without a metric.
    pub(super) fn of(&self, action: &mut RawAction) -> GroundExpression {
        if self.metric.is_none() && action.later.is_none() {
            strip(&self.weights, &mut action.effects, &mut Vec::new());
            return GroundExpression::Constant(1.0);
        }
        let mut terms = Vec::new();
        strip(&self.weights, &mut action.effects, &mut terms);
        if let Some(later) = &mut action.later {
            strip(&self.weights, &mut later.end_effects, &mut terms);
        }
        let constant =
            |e: &GroundExpression| if let GroundExpression::Constant(v) = e { Some(*v) } else { None };
        if let Some(sum) = terms.iter().map(constant).try_fold(0.0, |sum, v| Some(sum + v?)) {
            return GroundExpression::Constant(sum);
        }
        GroundExpression::Sum(terms)
    }
}

fn strip(weights: &[Option<f64>], effects: &mut Vec<RawEffect>, terms: &mut Vec<GroundExpression>) {
    effects.retain(|effect| {
        let Deed::Change(id, change, amount) = &effect.deed else { return true };
        let Some(weight) = weights[*id as usize] else { return true };
        let weight = if *change == Change::Decrease { -weight } else { weight };
        if weight != 0.0 {
            terms.push(match **amount {
                GroundExpression::Constant(value) => GroundExpression::Constant(weight * value),
                ref other => {
                    GroundExpression::Product(vec![GroundExpression::Constant(weight), other.clone()])
                }
            });
        }
        false
    });
}
