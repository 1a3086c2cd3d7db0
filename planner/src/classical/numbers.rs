//! Numeric fluents of a task: their changes, the comparisons that read them, and linear sums of them.
//!
//! A state vector holds the values of variables first, then two words per number. Every numeric
//! condition is a variable of its own (value 0 where the condition holds), updated after each change,
//! so that all searches treat it like a fact.

use crate::ground::{
    Change, Conjunction, GroundComparison, GroundExpression, GroundFact, GroundOutcome, GroundTask, Relation,
};
use crate::model::agreement::contradictions;
use crate::model::relation::quotient;

use super::compiled::Lists;

/// Numeric effect of an operator.
#[derive(Clone, Debug, Default)]
pub struct NumberChange {
    /// Facts (including those of comparisons) that must hold for the change to happen.
    pub conditions: Vec<GroundFact>,
    /// Index of the number that changes.
    pub number: u32,
    /// Kind of change; always present, except in the default value.
    pub change: Option<Change>,
    /// Amount added, subtracted, assigned or scaled by; always present, except in the default value.
    pub amount: Option<GroundExpression>,
}

impl NumberChange {
    /// Amount added by the change; `None` if it is no addition or depends on the state.
    pub(crate) fn constant_gain(&self) -> Option<f64> {
        match (self.change, &self.amount) {
            (Some(Change::Increase), Some(GroundExpression::Constant(by))) => Some(*by),
            (Some(Change::Decrease), Some(GroundExpression::Constant(by))) => Some(-by),
            _ => None,
        }
    }
}

/// Linear expression: a weighted sum of numbers plus a constant.
#[derive(Clone, Debug, Default)]
pub struct Linear {
    /// Index and weight of each number; no number twice.
    pub weights: Vec<(u32, f64)>,
    /// Constant term.
    pub constant: f64,
}

/// Numeric fluents of a task; empty for a task without numbers.
#[derive(Clone, Debug, Default)]
pub struct Numbers {
    /// Index of the variable that stands for the first comparison.
    pub first: usize,
    /// Number of words of a state before its numbers.
    base: usize,
    /// Numeric conditions, each a comparison of two expressions.
    pub comparisons: Vec<GroundComparison>,
    /// Left minus right of each comparison as a linear expression; `None` if it is not linear.
    pub linear: Vec<Option<Linear>>,
    /// Numbers that each comparison reads.
    pub reads: Vec<Vec<u32>>,
    /// Comparisons that read each number.
    pub read_by: Lists<u32>,
    /// Initial values; NaN if undefined.
    pub initial: Vec<f64>,
    /// Numeric effects of each operator.
    pub changes: Vec<Vec<NumberChange>>,
    /// Comparisons whose truth may change when an operator is applied, by operator.
    turned: Lists<u32>,
    /// True, by operator, if some change may make its number undefined or infinite; in states where it
    /// does, the operator is inapplicable.
    risky: Vec<bool>,
    /// True, by operator, if two of its changes of one number may contradict each other; in states where
    /// they do, the operator is inapplicable.
    contradicting: Vec<bool>,
}

impl Numbers {
    /// Numbers of a ground task; `first` is the variable of the first comparison.
    pub(crate) fn new(task: &GroundTask, first: usize) -> Numbers {
        let count = task.numerics.len();
        let comparisons = task.comparisons.clone();
        let reads: Vec<Vec<u32>> = comparisons.iter().map(|c| reads(&[&c.left, &c.right])).collect();
        let pairs = (0..reads.len()).flat_map(|c| reads[c].iter().map(move |&n| (n, c as u32)));
        let read_by = Lists::group(count, pairs);
        let difference = |c: &GroundComparison| {
            let mut linear = Linear::default();
            let is = add_linear(&c.left, 1.0, &mut linear) && add_linear(&c.right, -1.0, &mut linear);
            is.then_some(linear)
        };
        let initial = task.initial.numbers.clone();
        let mut numbers = Numbers {
            first,
            base: first + comparisons.len(),
            linear: comparisons.iter().map(difference).collect(),
            reads,
            read_by,
            comparisons,
            changes: Vec::with_capacity(task.actions.len()),
            turned: Lists::new(),
            risky: Vec::with_capacity(task.actions.len()),
            contradicting: Vec::with_capacity(task.actions.len()),
            initial,
        };
        for action in &task.actions {
            numbers.operator(action);
        }
        numbers
    }

    fn operator(&mut self, action: &crate::ground::GroundAction) {
        let mut changes = Vec::new();
        for effect in &action.effects {
            if let GroundOutcome::Change { fluent, change, amount } = &effect.outcome {
                let conditions = effect.when.as_ref().map_or_else(Vec::new, |w| self.facts(&w.here));
                let (change, amount) = (Some(*change), Some(amount.clone()));
                changes.push(NumberChange { conditions, number: *fluent, change, amount });
            }
        }
        let mut turned: Vec<u32> =
            changes.iter().flat_map(|c| self.read_by.get(c.number as usize).iter().copied()).collect();
        turned.sort_unstable();
        turned.dedup();
        self.turned.push(turned);
        let safe =
            |c: &NumberChange| c.constant_gain().is_some() && self.initial[c.number as usize].is_finite();
        self.risky.push(!changes.iter().all(safe));
        let known = |amount: &GroundExpression| evaluate(amount, &|_| f64::NAN);
        let kinds = changes.iter().filter_map(|c| Some((c.number, c.change?, known(c.amount.as_ref()?))));
        self.contradicting.push(!contradictions(kinds).is_empty());
        self.changes.push(changes);
    }

    /// Facts of a conjunction, including those that represent its comparisons.
    pub(crate) fn facts(&self, conjunction: &Conjunction) -> Vec<GroundFact> {
        let comparisons = conjunction.comparisons.iter().map(|&c| self.fact(c));
        conjunction.facts.iter().copied().chain(comparisons).collect()
    }

    fn fact(&self, comparison: u32) -> GroundFact {
        GroundFact { variable: self.first as u32 + comparison, value: 0 }
    }

    /// True if the task has no numbers.
    pub(crate) fn is_empty(&self) -> bool {
        self.initial.is_empty() && self.comparisons.is_empty()
    }

    /// Number of numeric fluents.
    pub(crate) fn len(&self) -> usize {
        self.initial.len()
    }

    /// Value of a number in a state.
    #[inline]
    pub(crate) fn get(&self, state: &[u32], number: u32) -> f64 {
        let at = self.base + 2 * number as usize;
        f64::from_bits(u64::from(state[at]) | u64::from(state[at + 1]) << 32)
    }

    fn set(&self, state: &mut [u32], number: u32, value: f64) {
        let at = self.base + 2 * number as usize;
        let bits = if value == 0.0 { 0 } else { value.to_bits() };
        state[at] = bits as u32;
        state[at + 1] = (bits >> 32) as u32;
    }

    /// Appends the values of comparisons and numbers to an initial state that has those of all other
    /// variables.
    pub(crate) fn append_initial(&self, state: &mut Vec<u32>) {
        state.resize(self.base + 2 * self.initial.len(), 1);
        for (number, &value) in self.initial.iter().enumerate() {
            self.set(state, number as u32, value);
        }
        self.compare_all(state);
    }

    /// Updates the variables of all comparisons.
    pub(crate) fn compare_all(&self, state: &mut [u32]) {
        for comparison in 0..self.comparisons.len() {
            self.compare(comparison, state);
        }
    }

    fn compare(&self, comparison: usize, state: &mut [u32]) {
        let GroundComparison { left, relation, right } = &self.comparisons[comparison];
        let holds = relation.holds(self.value(left, state), self.value(right, state));
        state[self.first + comparison] = u32::from(!holds);
    }

    /// Left minus right of a comparison in a state.
    pub(crate) fn gap(&self, comparison: usize, state: &[u32]) -> f64 {
        let GroundComparison { left, right, .. } = &self.comparisons[comparison];
        self.value(left, state) - self.value(right, state)
    }

    /// Amount by which numeric changes raise left minus right of a comparison; NaN if it depends on
    /// the state.
    pub(crate) fn gain(&self, comparison: u32, changes: &[NumberChange]) -> f64 {
        let Some(linear) = &self.linear[comparison as usize] else { return f64::NAN };
        let weight = |n: u32| linear.weights.iter().find(|(number, _)| *number == n).map_or(0.0, |w| w.1);
        let gains = changes.iter().map(|c| (weight(c.number), c.constant_gain().unwrap_or(f64::NAN)));
        gains.filter(|(weight, _)| *weight != 0.0).map(|(weight, gain)| weight * gain).sum()
    }

    /// Amount by which numeric changes raise left minus right of a comparison in a state; NaN if
    /// some change that counts is no addition.
    pub(crate) fn gain_in(&self, comparison: u32, changes: &[NumberChange], state: &[u32]) -> f64 {
        let Some(linear) = &self.linear[comparison as usize] else { return f64::NAN };
        let added = |c: &NumberChange| {
            let weight = linear.weights.iter().find(|(number, _)| *number == c.number).map_or(0.0, |w| w.1);
            let amount = || c.amount.as_ref().map_or(f64::NAN, |amount| self.value(amount, state));
            match c.change {
                _ if weight == 0.0 => 0.0,
                Some(Change::Increase) => weight * amount(),
                Some(Change::Decrease) => -weight * amount(),
                _ => f64::NAN,
            }
        };
        changes.iter().map(added).sum()
    }

    /// Minimum value of a number that satisfies a comparison over this number alone; `None` if the
    /// comparison reads other numbers or sets no minimum.
    pub(crate) fn least(&self, comparison: usize, number: u32) -> Option<f64> {
        let linear = self.linear[comparison].as_ref()?;
        let [(read, weight)] = linear.weights[..] else { return None };
        let bounds = match self.comparisons[comparison].relation {
            Relation::AtLeast | Relation::Greater => weight > 0.0,
            Relation::AtMost | Relation::Less => weight < 0.0,
            Relation::Equal | Relation::Unequal => false,
        };
        (read == number && bounds).then(|| -linear.constant / weight)
    }

    /// Comparisons whose truth an operator may change.
    pub(crate) fn turned(&self, operator: u32) -> &[u32] {
        self.turned.get(operator as usize)
    }

    /// Value of an expression; NaN if undefined.
    pub(crate) fn value(&self, expression: &GroundExpression, state: &[u32]) -> f64 {
        evaluate(expression, &|number| self.get(state, number))
    }

    /// Applies an operator's numeric effects to `next`, which is `state` after the operator's other
    /// effects.
    pub(crate) fn apply(&self, operator: u32, state: &[u32], next: &mut [u32]) {
        for change in &self.changes[operator as usize] {
            let (Some(how), Some(amount)) = (change.change, &change.amount) else { continue };
            if change.conditions.iter().all(|f| state[f.variable as usize] == f.value) {
                let mut number = self.get(next, change.number);
                how.apply(&mut number, self.value(amount, state));
                self.set(next, change.number, number);
            }
        }
        for &comparison in self.turned.get(operator as usize) {
            self.compare(comparison as usize, next);
        }
    }

    /// True if the numbers that an operator changes stay defined and finite, and no two of its changes
    /// contradict each other.
    pub(crate) fn possible(&self, operator: u32, state: &[u32]) -> bool {
        if !self.risky[operator as usize] {
            return true;
        }
        if self.contradicting[operator as usize] && self.contradict(operator, state) {
            return false;
        }
        let mut next = state.to_vec();
        self.apply(operator, state, &mut next);
        self.changes[operator as usize].iter().all(|c| {
            let happens = c.conditions.iter().all(|f| state[f.variable as usize] == f.value);
            !happens || self.get(&next, c.number).is_finite()
        })
    }

    /// True if changes that the operator makes in this state contradict each other.
    fn contradict(&self, operator: u32, state: &[u32]) -> bool {
        let happens = |c: &&NumberChange| c.conditions.iter().all(|f| state[f.variable as usize] == f.value);
        let happening = self.changes[operator as usize].iter().filter(happens);
        let kinds =
            happening.filter_map(|c| Some((c.number, c.change?, self.value(c.amount.as_ref()?, state))));
        !contradictions(kinds).is_empty()
    }

    /// Numbers that an operator writes.
    pub(crate) fn writes(&self, operator: u32) -> impl Iterator<Item = u32> + '_ {
        self.changes.get(operator as usize).into_iter().flatten().map(|c| c.number)
    }

    /// Variables that the conditions of an operator's numeric effects read, and numbers that their
    /// amounts read.
    pub(crate) fn change_reads(&self, operator: u32) -> (Vec<u32>, Vec<u32>) {
        let changes = self.changes.get(operator as usize).map_or(&[][..], |c| c);
        let variables = changes.iter().flat_map(|c| c.conditions.iter().map(|f| f.variable)).collect();
        let amounts: Vec<&GroundExpression> = changes.iter().filter_map(|c| c.amount.as_ref()).collect();
        (variables, reads(&amounts))
    }
}

/// Maximum number of repetitions; larger counts are cut to it.
const MOST_TIMES: f64 = 1.0e6;
/// Tolerance in the number of repetitions, against rounding.
const SLACK: f64 = 1.0e-9;

/// Number of times `gain` must be added to `gap` (left minus right) until the relation holds, at least
/// 1; `None` if adding does not help.
pub(crate) fn repetitions(gap: f64, relation: Relation, gain: f64) -> Option<u32> {
    let (missing, gain) = match relation {
        Relation::AtLeast | Relation::Greater => (-gap, gain),
        Relation::AtMost | Relation::Less => (gap, -gain),
        Relation::Equal => (gap.abs(), if gap > 0.0 { -gain } else { gain }),
        Relation::Unequal => return (gain != 0.0 && !gap.is_nan()).then_some(1),
    };
    if gain.is_nan() || missing.is_nan() || gain <= 0.0 {
        return None;
    }
    let times = match relation {
        Relation::Greater | Relation::Less => (missing / gain).floor() + 1.0,
        _ => (missing / gain - SLACK).ceil(),
    };
    Some(times.clamp(1.0, MOST_TIMES) as u32)
}

/// Value of an expression over numbers; NaN if undefined.
pub(crate) fn evaluate(expression: &GroundExpression, number: &impl Fn(u32) -> f64) -> f64 {
    match expression {
        GroundExpression::Constant(value) => *value,
        GroundExpression::Fluent(id) => number(*id),
        GroundExpression::Sum(parts) => parts.iter().map(|p| evaluate(p, number)).sum(),
        GroundExpression::Product(parts) => parts.iter().map(|p| evaluate(p, number)).product(),
        GroundExpression::Difference(left, right) => evaluate(left, number) - evaluate(right, number),
        GroundExpression::Quotient(left, right) => quotient(evaluate(left, number), evaluate(right, number)),
        GroundExpression::Negative(inner) => -evaluate(inner, number),
        GroundExpression::Call(_)
        | GroundExpression::Duration
        | GroundExpression::TotalTime
        | GroundExpression::Violated(_) => f64::NAN,
    }
}

/// True if an expression consists of constants, numeric fluents and arithmetic only.
pub(crate) fn is_plain(expression: &GroundExpression) -> bool {
    match expression {
        GroundExpression::Constant(_) | GroundExpression::Fluent(_) => true,
        GroundExpression::Sum(parts) | GroundExpression::Product(parts) => parts.iter().all(is_plain),
        GroundExpression::Difference(left, right) | GroundExpression::Quotient(left, right) => {
            is_plain(left) && is_plain(right)
        }
        GroundExpression::Negative(inner) => is_plain(inner),
        GroundExpression::Call(_)
        | GroundExpression::Duration
        | GroundExpression::TotalTime
        | GroundExpression::Violated(_) => false,
    }
}

/// Numbers that expressions read, ascending, each once.
pub(crate) fn reads(expressions: &[&GroundExpression]) -> Vec<u32> {
    fn collect(expression: &GroundExpression, out: &mut Vec<u32>) {
        match expression {
            GroundExpression::Fluent(id) => out.push(*id),
            GroundExpression::Sum(parts) | GroundExpression::Product(parts) => {
                parts.iter().for_each(|p| collect(p, out));
            }
            GroundExpression::Difference(left, right) | GroundExpression::Quotient(left, right) => {
                collect(left, out);
                collect(right, out);
            }
            GroundExpression::Negative(inner) => collect(inner, out),
            _ => {}
        }
    }
    let mut out = Vec::new();
    expressions.iter().for_each(|e| collect(e, &mut out));
    out.sort_unstable();
    out.dedup();
    out
}

/// Adds `factor` times an expression to a linear sum; `false` if the expression is not linear.
pub(crate) fn add_linear(expression: &GroundExpression, factor: f64, sum: &mut Linear) -> bool {
    match expression {
        GroundExpression::Constant(value) => {
            sum.constant += factor * value;
            true
        }
        GroundExpression::Fluent(id) => {
            match sum.weights.iter_mut().find(|(number, _)| number == id) {
                Some((_, weight)) => *weight += factor,
                None => sum.weights.push((*id, factor)),
            }
            true
        }
        GroundExpression::Sum(parts) => parts.iter().all(|p| add_linear(p, factor, sum)),
        GroundExpression::Difference(left, right) => {
            add_linear(left, factor, sum) && add_linear(right, -factor, sum)
        }
        GroundExpression::Negative(inner) => add_linear(inner, -factor, sum),
        GroundExpression::Product(parts) => {
            let constant =
                |p: &GroundExpression| if let GroundExpression::Constant(v) = p { Some(*v) } else { None };
            let by: f64 = parts.iter().filter_map(constant).product();
            let mut rest = parts.iter().filter(|p| constant(p).is_none());
            match (rest.next(), rest.next()) {
                (None, _) => {
                    sum.constant += factor * by;
                    true
                }
                (Some(only), None) => add_linear(only, factor * by, sum),
                _ => false,
            }
        }
        GroundExpression::Quotient(left, right) => match **right {
            GroundExpression::Constant(by) if by != 0.0 => add_linear(left, factor / by, sum),
            _ => false,
        },
        _ => false,
    }
}
