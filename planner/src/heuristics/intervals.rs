//! Relaxation of numeric fluents: the interval of values that a number can reach only grows.
//!
//! Two relaxations work together. If an operator changes a linear condition by the same amount at every
//! application, the number of applications needed is known (subgoaling with repetitions; Scala, Haslum,
//! Thiébaux and Ramirez 2020, sections 4 and 5). Every other numeric effect (assignments,
//! state-dependent amounts, products) widens the interval of its number, up to infinity if the operator
//! can be repeated (additive interval relaxation; Scala, Haslum, Thiébaux and Ramirez 2016).

use std::sync::Arc;

use crate::classical::compiled::{Compiled, Lists};
use crate::classical::numbers::{NumberChange, Numbers, reads, repetitions};
use crate::ground::{Change, GroundExpression, Relation};

use super::relaxed::Relevant;

/// Number of times that an interval bound may widen before it counts as infinite.
const MOST_WIDENINGS: u8 = 6;
/// Number of applications assumed for an operator whose progress towards a condition has no known
/// bound.
const UNLIKELY: u32 = 1000;
/// Value that stands for no node.
const NONE: u32 = u32::MAX;

/// Interval of the values that a number can reach; empty if `low` is above `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    low: f64,
    high: f64,
}

const EMPTY: Range = Range { low: f64::INFINITY, high: f64::NEG_INFINITY };

impl Range {
    fn point(value: f64) -> Range {
        if value.is_nan() { EMPTY } else { Range { low: value, high: value } }
    }

    fn is_empty(self) -> bool {
        self.low > self.high
    }

    /// Smallest interval that contains all values; NaN (zero times infinity) counts as zero.
    fn of(corners: &[f64]) -> Range {
        let zeroed = corners.iter().map(|&c| if c.is_nan() { 0.0 } else { c });
        zeroed.fold(EMPTY, |r, c| Range { low: r.low.min(c), high: r.high.max(c) })
    }

    fn plus(self, other: Range) -> Range {
        if self.is_empty() || other.is_empty() {
            return EMPTY;
        }
        Range { low: self.low + other.low, high: self.high + other.high }
    }

    fn minus(self, other: Range) -> Range {
        self.plus(Range { low: -other.high, high: -other.low })
    }

    fn times(self, other: Range) -> Range {
        if self.is_empty() || other.is_empty() {
            return EMPTY;
        }
        let Range { low: a, high: b } = self;
        let Range { low: c, high: d } = other;
        Range::of(&[a * c, a * d, b * c, b * d])
    }

    fn over(self, other: Range) -> Range {
        if self.is_empty() || other.is_empty() || (other.low == 0.0 && other.high == 0.0) {
            return EMPTY;
        }
        if other.low <= 0.0 && other.high >= 0.0 {
            return Range { low: f64::NEG_INFINITY, high: f64::INFINITY };
        }
        self.times(Range { low: 1.0 / other.high, high: 1.0 / other.low })
    }

    /// Upper bound of the interval, or its lower bound if `upper` is false.
    fn end(self, upper: bool) -> f64 {
        if upper { self.high } else { self.low }
    }

    /// True if some pair of values from the two intervals satisfies the relation.
    fn may(self, relation: Relation, other: Range) -> bool {
        !self.is_empty()
            && !other.is_empty()
            && relation.may_hold((self.low, self.high), (other.low, other.high))
    }
}

fn range(expression: &GroundExpression, ranges: &impl Fn(u32) -> Range) -> Range {
    match expression {
        GroundExpression::Constant(value) => Range::point(*value),
        GroundExpression::Fluent(id) => ranges(*id),
        GroundExpression::Sum(parts) => {
            parts.iter().fold(Range::point(0.0), |sum, part| sum.plus(range(part, ranges)))
        }
        GroundExpression::Product(parts) => {
            parts.iter().fold(Range::point(1.0), |product, part| product.times(range(part, ranges)))
        }
        GroundExpression::Difference(left, right) => range(left, ranges).minus(range(right, ranges)),
        GroundExpression::Quotient(left, right) => range(left, ranges).over(range(right, ranges)),
        GroundExpression::Negative(inner) => Range::point(0.0).minus(range(inner, ranges)),
        GroundExpression::Call(_)
        | GroundExpression::Duration
        | GroundExpression::TotalTime
        | GroundExpression::Violated(_) => EMPTY,
    }
}

/// Values that a number can reach by one change of its value in the evaluated state.
#[derive(Clone, Copy, Debug)]
struct Near {
    first: Range,
    range: Range,
    /// Nodes that last widened the lower and the upper bound; `NONE` for neither.
    by: [u32; 2],
    /// Number of times that a bound has widened.
    moves: u8,
}

impl Near {
    fn new(value: f64) -> Near {
        let range = Range::point(value);
        Near { first: range, range, by: [NONE; 2], moves: 0 }
    }

    /// Widens the interval to values that a node reaches; true if the interval grew.
    fn reach(&mut self, node: u32, reached: Range) -> bool {
        let Range { low, high } = self.range;
        let after = Range { low: low.min(reached.low), high: high.max(reached.high) };
        if reached.is_empty() || after == self.range || self.moves > MOST_WIDENINGS {
            return false;
        }
        if after.low < low {
            self.by[0] = node;
        }
        if after.high > high {
            self.by[1] = node;
        }
        self.moves += 1;
        self.range = after;
        true
    }
}

/// True if left minus right (the gap) must grow for the relation to hold.
fn upwards(relation: Relation, gap: f64) -> bool {
    match relation {
        Relation::AtLeast | Relation::Greater => true,
        Relation::AtMost | Relation::Less => false,
        Relation::Equal | Relation::Unequal => gap < 0.0,
    }
}

/// Constant change of a comparison by a node.
#[derive(Clone, Copy, Debug, Default)]
struct Move {
    comparison: u32,
    /// Change of left minus right by one application of the node; NaN if the change depends on the
    /// state.
    gain: f64,
}

/// Reachable intervals of numbers, with the working memory of one evaluation.
#[derive(Clone, Debug, Default)]
pub(super) struct Intervals {
    /// Fact of the first comparison: fact `first + 2 * c` says that comparison `c` holds.
    first: u32,
    numbers: Arc<Numbers>,
    /// Comparisons that each node changes, with the change.
    moves: Lists<Move>,
    changes: Lists<NumberChange>,
    /// Nodes whose effects depend on a number, by number.
    amounts_on: Vec<Vec<u32>>,
    /// True, by comparison, if some precondition, condition or goal contains the comparison.
    needed: Vec<bool>,
    /// Nodes that raise a number by a constant or assign a positive constant to it, each with that
    /// constant; by number.
    givers: Vec<Vec<(u32, f64)>>,
    /// True if intervals are needed: some effect or comparison is beyond subgoaling with repetitions.
    dynamic: bool,
    gaps: Vec<f64>,
    ranges: Vec<Range>,
    widened: Vec<[u8; 2]>,
    /// Node that last widened the interval of a number, by number; `NONE` for none.
    mover: Vec<u32>,
    /// Values that each number can reach by one change of its value in the state; state-dependent amounts
    /// are estimated from them (in the spirit of Li, Scala, Haslum and Bogomolov 2018).
    near: Vec<Near>,
    times: Vec<u32>,
    /// Facts that the last applied node achieves, each with the number of applications needed.
    pub(super) found: Vec<(u32, u32)>,
    /// Working memory of the relaxed heuristic: nodes that it adds to the relaxed plan.
    pub(super) movers: Vec<u32>,
}

impl Intervals {
    /// Intervals for the numeric changes of each node; only comparisons whose facts are needed are
    /// tracked.
    pub(super) fn new(task: &Compiled, needed: &[bool], changes: Lists<NumberChange>) -> Intervals {
        let numbers = Arc::clone(&task.numbers);
        if numbers.is_empty() {
            return Intervals::default();
        }
        let first = task.offsets.get(numbers.first).copied().unwrap_or(task.facts as u32);
        let count = numbers.comparisons.len();
        let needed: Vec<bool> = (0..count).map(|c| needed[first as usize + 2 * c]).collect();
        let mut intervals = Intervals {
            first,
            moves: Lists::new(),
            amounts_on: vec![Vec::new(); numbers.len()],
            givers: vec![Vec::new(); numbers.len()],
            dynamic: numbers.initial.iter().any(|n| n.is_nan())
                || (0..count).any(|c| needed[c] && numbers.linear[c].is_none()),
            gaps: vec![0.0; count],
            ranges: vec![EMPTY; numbers.len()],
            widened: vec![[0; 2]; numbers.len()],
            mover: vec![NONE; numbers.len()],
            near: vec![Near::new(f64::NAN); numbers.len()],
            times: vec![1; count],
            needed,
            numbers,
            ..Intervals::default()
        };
        for node in 0..changes.len() {
            intervals.node(node as u32, changes.get(node));
        }
        intervals.changes = changes;
        intervals
    }

    fn node(&mut self, node: u32, changes: &[NumberChange]) {
        let mut touched: Vec<u32> = changes
            .iter()
            .flat_map(|c| self.numbers.read_by.get(c.number as usize).iter().copied())
            .collect();
        touched.sort_unstable();
        touched.dedup();
        let moves: Vec<Move> = touched
            .into_iter()
            .filter(|&c| self.needed[c as usize])
            .map(|comparison| Move { comparison, gain: self.numbers.gain(comparison, changes) })
            .filter(|m| m.gain != 0.0)
            .collect();
        for change in changes {
            self.dynamic |= change.constant_gain().is_none();
            let given = match (change.change, &change.amount) {
                (Some(Change::Assign), Some(GroundExpression::Constant(level))) => Some(*level),
                _ => change.constant_gain(),
            };
            if let Some(gain) = given.filter(|&gain| gain > 0.0) {
                self.givers[change.number as usize].push((node, gain));
            }
            for number in change.amount.as_ref().map_or_else(Vec::new, |a| reads(&[a])) {
                self.amounts_on[number as usize].push(node);
            }
            // What a factor makes of a number depends on the number too; nothing can be added to an undefined one.
            let scales = matches!(change.change, Some(Change::ScaleUp | Change::ScaleDown));
            let undefined = self.numbers.initial[change.number as usize].is_nan();
            if scales || undefined && change.change != Some(Change::Assign) {
                self.amounts_on[change.number as usize].push(node);
            }
        }
        self.moves.push(moves);
    }

    /// True if the task has no numbers.
    pub(super) fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Begins the evaluation of a state.
    pub(super) fn start(&mut self, task: &Compiled, state: &[u32]) {
        for comparison in 0..self.gaps.len() {
            if self.needed[comparison] {
                self.gaps[comparison] = task.numbers.gap(comparison, state);
            }
        }
        if self.dynamic {
            for number in 0..self.ranges.len() {
                self.near[number] = Near::new(task.numbers.get(state, number as u32));
                self.ranges[number] = self.near[number].first;
            }
            self.widened.fill([0; 2]);
            self.mover.fill(NONE);
        }
    }

    /// Applies a node: writes the facts that it achieves to `found`, and appends to `again` the
    /// triggered nodes (those for which `fired` is true) whose effects depend on a number that changed.
    pub(super) fn fire(&mut self, node: u32, fired: &dyn Fn(u32) -> bool, again: &mut Vec<u32>) {
        self.found.clear();
        if self.changes.get(node as usize).is_empty() {
            return;
        }
        for &Move { comparison, gain } in self.moves.get(node as usize) {
            let relation = self.numbers.comparisons[comparison as usize].relation;
            if let Some(times) = repetitions(self.gaps[comparison as usize], relation, gain) {
                self.found.push((self.first + 2 * comparison, times));
            }
        }
        if !self.dynamic {
            return;
        }
        for place in 0..self.changes.get(node as usize).len() {
            let Some(number) = self.widen(node, place) else { continue };
            self.mover[number as usize] = node;
            again.extend(self.amounts_on[number as usize].iter().copied().filter(|&n| fired(n)));
            for &comparison in self.numbers.read_by.get(number as usize) {
                let asked = &self.numbers.comparisons[comparison as usize];
                let (left, right) = (self.range(&asked.left), self.range(&asked.right));
                let fact = self.first + 2 * comparison;
                let known = self.found.iter().any(|(found, _)| *found == fact);
                if self.needed[comparison as usize] && !known && left.may(asked.relation, right) {
                    self.found.push((fact, self.times_now(node, comparison)));
                }
            }
        }
    }

    fn range(&self, expression: &GroundExpression) -> Range {
        range(expression, &|number| self.ranges[number as usize])
    }

    fn near(&self, expression: &GroundExpression) -> Range {
        range(expression, &|number| self.near[number as usize].range)
    }

    /// Widens the interval of a number by one of a node's numeric effects; returns the number, or
    /// `None` if nothing changed.
    fn widen(&mut self, node: u32, place: usize) -> Option<u32> {
        let NumberChange { number, change: Some(change), amount: Some(amount), .. } =
            &self.changes.get(node as usize)[place]
        else {
            return None;
        };
        let number = *number;
        let before = self.ranges[number as usize];
        let changed = |from: Range, amount| match change {
            Change::Assign => amount,
            Change::Increase => from.plus(amount),
            Change::Decrease => from.minus(amount),
            Change::ScaleUp => from.times(amount),
            Change::ScaleDown => from.over(amount),
        };
        let Near { first, range, .. } = self.near[number as usize];
        let once = changed(if first.is_empty() { range } else { first }, self.near(amount));
        let reached = changed(before, self.range(amount));
        if reached.is_empty() {
            return None;
        }
        let repeated = *change != Change::Assign;
        let mut after = Range { low: before.low.min(reached.low), high: before.high.max(reached.high) };
        let [lower, upper] = &mut self.widened[number as usize];
        if after.low < before.low {
            *lower += u8::from(*lower < u8::MAX);
            if (repeated && !before.is_empty()) || *lower > MOST_WIDENINGS {
                after.low = f64::NEG_INFINITY;
            }
        }
        if after.high > before.high {
            *upper += u8::from(*upper < u8::MAX);
            if (repeated && !before.is_empty()) || *upper > MOST_WIDENINGS {
                after.high = f64::INFINITY;
            }
        }
        self.ranges[number as usize] = after;
        let nearer = self.near[number as usize].reach(node, once);
        (after != before || nearer).then_some(number)
    }

    /// Number of applications of a node until a comparison holds, with its present amounts; with larger
    /// amounts that are soon reachable if this saves more than one application.
    fn times_now(&self, node: u32, comparison: u32) -> u32 {
        let still = self.times_with(node, comparison, &|number| self.near[number as usize].first);
        let soon = self.times_with(node, comparison, &|number| self.near[number as usize].range);
        if still <= soon.saturating_add(1) { still } else { soon }
    }

    fn times_with(&self, node: u32, comparison: u32, ranges: &impl Fn(u32) -> Range) -> u32 {
        let gap = self.gaps[comparison as usize];
        let relation = self.numbers.comparisons[comparison as usize].relation;
        let mut gain = 0.0;
        for change in self.changes.get(node as usize) {
            let Some((amount, weight)) = self.added(change, comparison) else { continue };
            if !matches!(change.change, Some(Change::Increase | Change::Decrease)) {
                return 1;
            }
            gain += weight * range(amount, ranges).end(upwards(relation, gap) == (weight > 0.0));
        }
        if gain.is_finite() { repetitions(gap, relation, gain).unwrap_or(UNLIKELY) } else { 1 }
    }

    /// Amount and weight with which a numeric effect changes left minus right of a comparison; `None`
    /// if it does not.
    fn added<'a>(&self, change: &'a NumberChange, comparison: u32) -> Option<(&'a GroundExpression, f64)> {
        let linear = self.numbers.linear[comparison as usize].as_ref()?;
        let (_, weight) = linear.weights.iter().find(|(n, w)| *n == change.number && *w != 0.0)?;
        let sign = if change.change == Some(Change::Decrease) { -1.0 } else { 1.0 };
        Some((change.amount.as_ref()?, sign * weight))
    }

    /// Appends the nodes that raise the contribution of `node` to the comparison of `fact`.
    pub(super) fn collect_levers(&self, fact: u32, node: u32, out: &mut Vec<u32>) {
        if !self.dynamic {
            return;
        }
        let comparison = (fact - self.first) / 2;
        let still = self.times_with(node, comparison, &|number| self.near[number as usize].first);
        if still <= self.times[comparison as usize] {
            return;
        }
        let relation = self.numbers.comparisons[comparison as usize].relation;
        let up = upwards(relation, self.gaps[comparison as usize]);
        for change in self.changes.get(node as usize) {
            let Some((amount, weight)) = self.added(change, comparison) else { continue };
            let end = up == (weight > 0.0);
            for number in reads(&[amount]) {
                let Near { first, range: near, by, .. } = self.near[number as usize];
                let with = |own: Range| {
                    let other = |n: u32| if n == number { own } else { self.near[n as usize].range };
                    let bound = range(amount, &other).end(end);
                    if end { bound } else { -bound }
                };
                let [least, low, high] = [first, Range::point(near.low), Range::point(near.high)].map(with);
                let best = if high > low { by[1] } else { by[0] };
                if low.max(high) > least && best != NONE {
                    out.push(best);
                }
            }
        }
    }

    /// Records how often the supporter of a comparison's fact must be applied.
    pub(super) fn support(&mut self, fact: u32, times: u32) {
        self.times[(fact - self.first) as usize / 2] = times;
    }

    /// Number of applications of the supporter of a comparison's fact; `None` for other facts.
    pub(super) fn repeats(&self, fact: u32) -> Option<u32> {
        if self.is_empty() || fact < self.first {
            return None;
        }
        self.times.get((fact - self.first) as usize / 2).copied()
    }

    /// Nodes that raise a number, each with the amount.
    pub(super) fn givers(&self, number: u32) -> &[(u32, f64)] {
        &self.givers[number as usize]
    }

    /// Numbers of which a relaxed plan consumes more than the state and the plan supply, each with the
    /// shortage. A minimum that a consuming operator demands of the number counts too.
    pub(super) fn shortages(&self, task: &Compiled, state: &[u32], plan: &[Relevant]) -> Vec<(u32, f64)> {
        let mut balance: Vec<f64> = vec![0.0; self.numbers.len()];
        let mut floor: Vec<f64> = vec![f64::INFINITY; self.numbers.len()];
        for entry in plan {
            for change in &self.numbers.changes[entry.operator as usize] {
                let gain = change.constant_gain().unwrap_or(0.0);
                balance[change.number as usize] += gain * f64::from(entry.times);
                if gain < 0.0 {
                    let asked = self.asked(task, entry.operator, change.number);
                    let least = &mut floor[change.number as usize];
                    *least = asked.map_or(*least, |asked| least.min(asked + gain));
                }
            }
        }
        let missing = |n: usize| floor[n] - (task.numbers.get(state, n as u32) + balance[n]);
        let short = |&n: &usize| floor[n].is_finite() && missing(n) > 0.0 && !self.givers[n].is_empty();
        (0..balance.len()).filter(short).map(|n| (n as u32, missing(n))).collect()
    }

    /// Largest minimum of a number that an operator's preconditions demand; `None` if they demand none.
    fn asked(&self, task: &Compiled, operator: u32, number: u32) -> Option<f64> {
        let preconditions = task.preconditions.get(operator as usize).iter();
        let compared = preconditions.filter_map(|f| (f.variable as usize).checked_sub(self.numbers.first));
        compared.filter_map(|c| self.numbers.least(c, number)).reduce(f64::max)
    }

    /// Appends the nodes that last widened the numbers of a fact's comparison.
    pub(super) fn collect_movers(&self, fact: u32, out: &mut Vec<u32>) {
        if !self.dynamic {
            return;
        }
        let comparison = (fact - self.first) as usize / 2;
        let static_ = self.numbers.linear[comparison].is_some() && !self.gaps[comparison].is_nan();
        if static_ && self.times[comparison] > 1 {
            return;
        }
        let movers = self.numbers.reads[comparison].iter().map(|&n| self.mover[n as usize]);
        out.extend(movers.filter(|&m| m != NONE));
    }
}
