//! What numbers can become when nothing is ever taken away.
//!
//! Two relaxations work together. Where an operator adds the same to a linear condition whenever it is applied, how
//! often it must be applied is known (subgoaling with repetitions; Scala, Haslum, Thiébaux and Ramirez 2020, sections 4
//! and 5). Whatever else happens to numbers (assignments, amounts that depend on the state, products) widens an
//! interval per number, to infinity where an operator can be repeated (the additive interval relaxation; Scala,
//! Haslum, Thiébaux and Ramirez 2016).

use std::sync::Arc;

use crate::classical::compiled::{Compiled, Lists};
use crate::classical::numbers::{NumberChange, Numbers, reads, repetitions};
use crate::ground::{Change, Expression, Relation};

use super::relaxed::Relevant;

/// How often a bound of an interval may move before it is taken to move without end.
const MOST_WIDENINGS: u8 = 6;
/// Nothing.
const NONE: u32 = u32::MAX;

/// The values that a number may have; none where `low` is above `high`.
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

    /// From corners; a corner that is no number (zero times infinity) counts as zero.
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

    /// Whether some value stands in this relation to one of the other.
    fn may(self, relation: Relation, other: Range) -> bool {
        !self.is_empty()
            && !other.is_empty()
            && relation.may_hold((self.low, self.high), (other.low, other.high))
    }
}

fn range(expression: &Expression, ranges: &[Range]) -> Range {
    match expression {
        Expression::Constant(value) => Range::point(*value),
        Expression::Fluent(id) => ranges[*id as usize],
        Expression::Sum(parts) => {
            parts.iter().fold(Range::point(0.0), |sum, part| sum.plus(range(part, ranges)))
        }
        Expression::Product(parts) => {
            parts.iter().fold(Range::point(1.0), |product, part| product.times(range(part, ranges)))
        }
        Expression::Difference(left, right) => range(left, ranges).minus(range(right, ranges)),
        Expression::Quotient(left, right) => range(left, ranges).over(range(right, ranges)),
        Expression::Negative(inner) => Range::point(0.0).minus(range(inner, ranges)),
        Expression::Call(_) | Expression::Duration | Expression::TotalTime | Expression::Violated(_) => EMPTY,
    }
}

/// A condition that a node can bring about.
#[derive(Clone, Copy, Debug, Default)]
struct Move {
    comparison: u32,
    /// What one application adds to left minus right; NaN where that depends on the state.
    gain: f64,
}

/// What numbers can become, with the working memory of one evaluation.
#[derive(Clone, Debug, Default)]
pub(super) struct Intervals {
    /// Facts of the first comparison: fact `first + 2 * c` says that comparison `c` holds.
    first: u32,
    numbers: Arc<Numbers>,
    /// By node.
    moves: Lists<Move>,
    changes: Lists<NumberChange>,
    /// By number: nodes whose amounts read it.
    amounts_on: Vec<Vec<u32>>,
    /// By comparison: asked for by anyone.
    needed: Vec<bool>,
    /// By number: nodes that raise it, and by how much at least.
    givers: Vec<Vec<(u32, f64)>>,
    /// Whether intervals are needed at all.
    dynamic: bool,
    gaps: Vec<f64>,
    ranges: Vec<Range>,
    widened: Vec<[u8; 2]>,
    /// By number: the node that moved it last.
    mover: Vec<u32>,
    times: Vec<u32>,
    /// Facts that the last node brings about, with how often it must be applied.
    pub(super) found: Vec<(u32, u32)>,
    /// Working memory of the caller.
    pub(super) movers: Vec<u32>,
}

impl Intervals {
    /// For the changes of each node, towards the needed facts.
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
                (Some(Change::Assign), Some(Expression::Constant(level))) => Some(*level),
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

    /// Whether the task has no numbers.
    pub(super) fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Begins an evaluation.
    pub(super) fn start(&mut self, task: &Compiled, state: &[u32]) {
        for comparison in 0..self.gaps.len() {
            if self.needed[comparison] {
                self.gaps[comparison] = task.numbers.gap(comparison, state);
            }
        }
        if self.dynamic {
            for (number, range) in self.ranges.iter_mut().enumerate() {
                *range = Range::point(task.numbers.get(state, number as u32));
            }
            self.widened.fill([0; 2]);
            self.mover.fill(NONE);
        }
    }

    /// Applies a node: leaves in `found` what it brings about, and appends to `again` the nodes among those that
    /// `fired` whose amounts it changed.
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
                let (left, right) = (range(&asked.left, &self.ranges), range(&asked.right, &self.ranges));
                let fact = self.first + 2 * comparison;
                let known = self.found.iter().any(|(found, _)| *found == fact);
                if self.needed[comparison as usize] && !known && left.may(asked.relation, right) {
                    self.found.push((fact, self.times_now(node, comparison)));
                }
            }
        }
    }

    /// Lets one change widen its number; `None` if it does not.
    fn widen(&mut self, node: u32, place: usize) -> Option<u32> {
        let NumberChange { number, change: Some(change), amount: Some(amount), .. } =
            &self.changes.get(node as usize)[place]
        else {
            return None;
        };
        let number = *number;
        let before = self.ranges[number as usize];
        let amount = range(amount, &self.ranges);
        let reached = match change {
            Change::Assign => amount,
            Change::Increase => before.plus(amount),
            Change::Decrease => before.minus(amount),
            Change::ScaleUp => before.times(amount),
            Change::ScaleDown => before.over(amount),
        };
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
        (after != before).then_some(number)
    }

    /// How often a node must be applied for a condition if its amounts are taken as they can be now, at most.
    fn times_now(&self, node: u32, comparison: u32) -> u32 {
        let gap = self.gaps[comparison as usize];
        let Some(linear) = &self.numbers.linear[comparison as usize] else { return 1 };
        let mut gain = 0.0;
        for change in self.changes.get(node as usize) {
            let weight = linear.weights.iter().find(|(n, _)| *n == change.number).map_or(0.0, |w| w.1);
            let Some(amount) = change.amount.as_ref().filter(|_| weight != 0.0) else { continue };
            let amount = range(amount, &self.ranges);
            let sign = match change.change {
                Some(Change::Increase) => weight,
                Some(Change::Decrease) => -weight,
                _ => return 1,
            };
            let best = if sign * gap < 0.0 { amount.high } else { amount.low };
            gain += sign * best;
        }
        let relation = self.numbers.comparisons[comparison as usize].relation;
        if gain.is_finite() { repetitions(gap, relation, gain).unwrap_or(1) } else { 1 }
    }

    /// Notes how often the fact's supporter is to be applied.
    pub(super) fn support(&mut self, fact: u32, times: u32) {
        self.times[(fact - self.first) as usize / 2] = times;
    }

    /// How often the supporter of a comparison's fact is to be applied; `None` for other facts.
    pub(super) fn repeats(&self, fact: u32) -> Option<u32> {
        if self.is_empty() || fact < self.first {
            return None;
        }
        self.times.get((fact - self.first) as usize / 2).copied()
    }

    /// Nodes that raise a number, and by how much.
    pub(super) fn givers(&self, number: u32) -> &[(u32, f64)] {
        &self.givers[number as usize]
    }

    /// Numbers of which the operators of a relaxed plan use up more than there is and than they give back, with what
    /// is missing: each operator that asks for a least amount and takes from it must find it.
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

    /// The least amount of a number that an operator asks for.
    fn asked(&self, task: &Compiled, operator: u32, number: u32) -> Option<f64> {
        let preconditions = task.preconditions.get(operator as usize).iter();
        let compared = preconditions.filter_map(|f| (f.variable as usize).checked_sub(self.numbers.first));
        compared.filter_map(|c| self.numbers.least(c, number)).reduce(f64::max)
    }

    /// Appends the nodes that moved what a comparison reads.
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

#[cfg(test)]
mod tests {
    use crate::classical::compiled::Compiled;
    use crate::heuristics::relaxed::{Counting, Relaxed};
    use crate::small;

    /// The estimate and how often each step of the relaxed plan is repeated.
    fn check(effect: &str, init: f64, goal: &str, expected: Option<(u32, &[u32])>) {
        let domain = format!(
            "(define (domain d) (:requirements :numeric-fluents) (:predicates (p)) (:functions (n) (m))
              (:action step :parameters () :precondition () :effect {effect}))"
        );
        let problem =
            format!("(define (problem q) (:domain d) (:init (= (n) {init}) (= (m) 2)) (:goal {goal}))");
        let (_, grounded) = small::read(&domain, &problem);
        let compiled = Compiled::new(&grounded);
        let mut relaxed = Relaxed::new(&compiled, Counting::Steps);
        let estimate = relaxed.evaluate(&compiled, &compiled.initial);
        let times: Vec<u32> = relaxed.plan.iter().map(|relevant| relevant.times).collect();
        assert_eq!(estimate, expected.map(|(estimate, _)| estimate), "{effect} {goal}");
        if let Some((_, repeated)) = expected {
            assert_eq!(times, repeated, "{effect} {goal}");
        }
    }

    #[test]
    fn numbers_are_moved_as_often_as_it_takes() {
        check("(increase (n) 3)", 0.0, "(>= (n) 10)", Some((4, &[4])));
        check("(increase (n) (m))", 0.0, "(>= (n) 10)", Some((5, &[5])));
        check("(decrease (n) 1)", 0.0, "(<= (n) -2)", Some((2, &[2])));
        check("(assign (n) 7)", 0.0, "(= (n) 7)", Some((1, &[1])));
        check("(decrease (n) 1)", 0.0, "(>= (n) 1)", None);
    }
}
