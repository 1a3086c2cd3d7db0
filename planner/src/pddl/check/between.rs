//! Checks of conditions on numbers that change continuously: only those that can be decided exactly
//! between happenings are accepted.

use rustc_hash::FxHashSet;

use super::Checker;
use crate::diagnostic::{Diagnostic, Span};
use crate::model::walk::{self, Part};
use crate::task::{Condition, Expression, FunctionId, Modal, PredicateId, Task};

/// Maximum number of continuously changing factors in a product whose sign can be decided exactly.
const MOST_FACTORS: u32 = 2;

impl Checker<'_> {
    /// Reports over-all conditions with products of more than two continuously changing numbers, or
    /// division by one, and constraints on such numbers.
    pub(super) fn told_between(&mut self) {
        let flowing: FxHashSet<FunctionId> =
            self.task.actions.iter().flat_map(|a| &a.continuous).map(|rate| rate.fluent.function).collect();
        if flowing.is_empty() {
            return;
        }
        let mut found = Vec::new();
        for (comparison, span) in over_all(&self.task) {
            if comparison.iter().any(|side| degree(side, &flowing).is_none_or(|most| most > MOST_FACTORS)) {
                let message = "how these numbers compare between two happenings is not told exactly";
                let label = "a quotient, or a product of more than two, of numbers that change at rates";
                let help =
                    "compare sums, or products of two such numbers; multiply both sides by what divides one";
                found.push(Diagnostic::error("not-supported", message, span, label).with_help(help));
            }
        }
        for constraint in self.task.constraints.iter().filter(|one| one.operator != Modal::AtEnd) {
            let mut number = None;
            for condition in closed(&self.task, &constraint.conditions.iter().collect::<Vec<_>>()) {
                walk::condition(condition, &mut |part| {
                    if let Part::Fluent(fluent) = part {
                        number = number.or(Some(fluent.function).filter(|own| flowing.contains(own)));
                    }
                });
            }
            let Some(number) = number else { continue };
            let name = &self.task.function(number).name;
            let message = format!("a constraint on `{name}`, which changes between happenings");
            let label = "only what holds at happenings is looked at";
            let help = "ask for it in conditions `over all` of the actions that change it, or at the end";
            found.push(Diagnostic::error("not-supported", message, constraint.span, label).with_help(help));
        }
        found.into_iter().for_each(|finding| self.push(finding));
    }
}

/// Sides and spans of the comparisons in over-all conditions, including those in the rules of
/// derived predicates.
fn over_all(task: &Task) -> Vec<(&[Expression; 2], Span)> {
    let mut conditions = Vec::new();
    for action in &task.actions {
        conditions.push(&action.condition.over_all);
        conditions.extend(action.preferences.iter().map(|(_, preferred)| &preferred.over_all));
        conditions.extend(action.effects.end.iter().map(|effect| &effect.when.over_all));
    }
    let mut comparisons = Vec::new();
    for condition in closed(task, &conditions) {
        walk::condition(condition, &mut |part| {
            if let Part::Condition(Condition::Compare(_, sides, span)) = part {
                comparisons.push((&**sides, *span));
            }
        });
    }
    comparisons
}

/// Conditions, and the bodies of all rules of derived predicates that these depend on.
fn closed<'t>(task: &'t Task, conditions: &[&'t Condition]) -> Vec<&'t Condition> {
    let mut all = conditions.to_vec();
    let mut seen: FxHashSet<PredicateId> = FxHashSet::default();
    let mut next = 0;
    while let Some(&condition) = all.get(next) {
        next += 1;
        let mut named = Vec::new();
        walk::condition(condition, &mut |part| {
            if let Part::Condition(Condition::Atom(atom)) = part {
                named.push(atom.predicate);
            }
        });
        for predicate in named.into_iter().filter(|&predicate| seen.insert(predicate)) {
            all.extend(task.rules.iter().filter(|rule| rule.predicate == predicate).map(|rule| &rule.body));
        }
    }
    all
}

/// Degree of an expression as a polynomial in the continuously changing numbers `flowing`; `None`
/// if one of these is in a divisor.
fn degree(expression: &Expression, flowing: &FxHashSet<FunctionId>) -> Option<u32> {
    let all = |parts: &[Expression]| -> Option<Vec<u32>> {
        parts.iter().map(|part| degree(part, flowing)).collect()
    };
    match expression {
        Expression::Fluent(fluent) => Some(u32::from(flowing.contains(&fluent.function))),
        Expression::Add(parts) => Some(all(parts)?.into_iter().max().unwrap_or(0)),
        Expression::Multiply(parts) => Some(all(parts)?.into_iter().sum()),
        Expression::Subtract(sides) => Some(all(&**sides)?.into_iter().max().unwrap_or(0)),
        Expression::Divide(sides) => {
            degree(&sides[0], flowing).filter(|_| degree(&sides[1], flowing) == Some(0))
        }
        Expression::Negative(inner) => degree(inner, flowing),
        Expression::Number(_)
        | Expression::Duration
        | Expression::TotalTime
        | Expression::Violated(_)
        | Expression::Call(_) => Some(0),
    }
}
