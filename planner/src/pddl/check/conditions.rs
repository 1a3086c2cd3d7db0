//! Checks of conditions, which are brought to negation normal form.

use super::expressions::{Place, Value};
use super::{Checker, Scope};
use crate::attachment::CallKind;
use crate::diagnostic::{Diagnostic, Span};
use crate::pddl::ast::{self, Comparison, Formula, Name, When};
use crate::task::{Atom, Condition, Expression, Timed};

impl Checker<'_> {
    /// Checks a condition and brings it, or its negation if `negated`, to negation normal form;
    /// `None` after a fault.
    pub(super) fn condition(
        &mut self,
        formula: &Formula,
        negated: bool,
        place: Place,
        scope: &mut Scope,
    ) -> Option<Condition> {
        match formula {
            Formula::And(parts) | Formula::Or(parts) => {
                // All of them, so that each finding comes up.
                let parts: Vec<Option<Condition>> =
                    parts.iter().map(|part| self.condition(part, negated, place, scope)).collect();
                let parts: Vec<Condition> = parts.into_iter().collect::<Option<_>>()?;
                let conjunction = matches!(formula, Formula::And(_)) != negated;
                Some(if conjunction { all_of(parts) } else { Condition::Or(parts) })
            }
            Formula::Not(inner) => self.condition(inner, !negated, place, scope),
            Formula::Imply(left, right) => {
                let left = self.condition(left, !negated, place, scope);
                let right = self.condition(right, negated, place, scope);
                let parts = vec![left?, right?];
                Some(if negated { all_of(parts) } else { Condition::Or(parts) })
            }
            Formula::Exists(variables, inner) | Formula::Forall(variables, inner) => {
                let (before, quantified) = self.quantify(variables, scope);
                let inner = self.condition(inner, negated, place, scope);
                scope.variables.truncate(before);
                let inner = Box::new(inner?);
                let universal = matches!(formula, Formula::Forall(..)) != negated;
                Some(if universal {
                    Condition::Forall(quantified, inner)
                } else {
                    Condition::Exists(quantified, inner)
                })
            }
            Formula::Atom { name, arguments, span } => {
                let atom = self.atom(*name, arguments, *span, scope)?;
                Some(literal(Condition::Atom(atom), negated))
            }
            Formula::Call(call) => {
                let call = self.call(call, CallKind::Condition, scope)?;
                Some(literal(Condition::Call(call), negated))
            }
            Formula::Compare { comparison, sides, span } => {
                self.comparison(*comparison, sides, *span, negated, place, scope)
            }
            Formula::Timed(_, inner, span) => {
                let message = "a time inside a condition of one time";
                self.push(Diagnostic::error(
                    "duration",
                    message,
                    *span,
                    "another time stands around this already",
                ));
                self.condition(inner, negated, place, scope)
            }
            Formula::Preference(_, _, span) => {
                let message = "a preference inside a condition";
                let help = "preferences stand in goals, conditions of actions and constraints, inside `and` and `forall`";
                self.push(Diagnostic::error("not-supported", message, *span, "not here").with_help(help));
                None
            }
            Formula::Modal { span, .. } => {
                let message = "a constraint on the whole plan inside a condition";
                let help = "it belongs into `(:constraints …)`, inside `and`, `forall` and `preference`";
                self.push(Diagnostic::error("not-supported", message, *span, "not here").with_help(help));
                None
            }
        }
    }

    pub(super) fn atom(
        &mut self,
        name: Name,
        arguments: &[ast::TermAst],
        span: Span,
        scope: &Scope,
    ) -> Option<Atom> {
        let predicate = self.find_predicate(name)?;
        let arguments = self.predicate_arguments(predicate, name, arguments, span, scope)?;
        Some(Atom { predicate, arguments, span })
    }

    fn comparison(
        &mut self,
        comparison: Comparison,
        sides: &[ast::TermAst; 2],
        span: Span,
        negated: bool,
        place: Place,
        scope: &Scope,
    ) -> Option<Condition> {
        if comparison == Comparison::Equal {
            return self.equality(sides, span, negated, place, scope);
        }
        let [left, right] = sides.each_ref().map(|side| self.expression(side, place, scope));
        let comparison = if negated { opposite(comparison) } else { comparison };
        Some(Condition::Compare(comparison, Box::new([left?, right?]), span))
    }

    /// Checks an equation (`=`), whose sides are both objects or both numbers.
    fn equality(
        &mut self,
        sides: &[ast::TermAst; 2],
        span: Span,
        negated: bool,
        place: Place,
        scope: &Scope,
    ) -> Option<Condition> {
        let [left, right] = sides.each_ref().map(|side| self.value(side, place, scope));
        let (left, right) = match (left?, right?) {
            // An object may be called 5.
            (Value::Object(left, types), Value::Number(_))
                if matches!(sides[1], ast::TermAst::Number(..)) =>
            {
                (Value::Object(left, types), self.named_like_number(&sides[1], scope)?)
            }
            (Value::Number(_), Value::Object(right, types))
                if matches!(sides[0], ast::TermAst::Number(..)) =>
            {
                (self.named_like_number(&sides[0], scope)?, Value::Object(right, types))
            }
            both => both,
        };
        match (left, right) {
            (Value::Object(left, _), Value::Object(right, _)) => {
                Some(literal(Condition::Same(Box::new([left, right]), span), negated))
            }
            (Value::Number(left), Value::Number(right)) => {
                let equal = Condition::Compare(Comparison::Equal, Box::new([left, right]), span);
                Some(literal(equal, negated))
            }
            (Value::Undefined, _) | (_, Value::Undefined) => {
                let message = "a comparison with `undefined` is not supported";
                self.push(Diagnostic::error("not-supported", message, span, "not supported"));
                None
            }
            (Value::Object(_, types), _) | (_, Value::Object(_, types)) => {
                let message = format!("a `{}` is compared with a number", self.types_text(&types));
                let finding = Diagnostic::error("wrong-kind", message, span, "these can never be equal");
                self.push(finding.with_help("both sides must be numbers, or both objects"));
                None
            }
        }
    }

    fn named_like_number(&mut self, term: &ast::TermAst, scope: &Scope) -> Option<Value> {
        self.object_term(term, scope).map(|(term, types)| Value::Object(term, types))
    }

    /// Checks the condition of a durative action, and sorts its parts by time specifier.
    pub(super) fn timed_condition(
        &mut self,
        formula: &Formula,
        scope: &mut Scope,
    ) -> Option<Timed<Condition>> {
        match formula {
            Formula::And(parts) => {
                let parts: Vec<Option<Timed<Condition>>> =
                    parts.iter().map(|part| self.timed_condition(part, scope)).collect();
                let parts: Vec<Timed<Condition>> = parts.into_iter().collect::<Option<_>>()?;
                let (mut start, mut over_all, mut end) = (Vec::new(), Vec::new(), Vec::new());
                for part in parts {
                    start.push(part.start);
                    over_all.push(part.over_all);
                    end.push(part.end);
                }
                Some(Timed { start: all_of(start), over_all: all_of(over_all), end: all_of(end) })
            }
            Formula::Timed(when, inner, _) => {
                let inner = self.condition(inner, false, Place::Durative, scope)?;
                Some(at(*when, inner))
            }
            Formula::Forall(variables, inner) => {
                let (before, quantified) = self.quantify(variables, scope);
                let inner = self.timed_condition(inner, scope);
                scope.variables.truncate(before);
                let around = |inner: Condition| {
                    if inner.is_true() {
                        inner
                    } else {
                        Condition::Forall(quantified.clone(), Box::new(inner))
                    }
                };
                inner.map(|inner| Timed {
                    start: around(inner.start),
                    over_all: around(inner.over_all),
                    end: around(inner.end),
                })
            }
            other => self.one_time(other, scope),
        }
    }

    /// Checks a condition whose leaves all have the same time specifier, by moving the specifier
    /// outside.
    fn one_time(&mut self, formula: &Formula, scope: &mut Scope) -> Option<Timed<Condition>> {
        let mut times = Vec::new();
        collect_times(formula, &mut times);
        times.dedup();
        match times.as_slice() {
            [Some(when)] => {
                let inner = self.condition(&without_times(formula), false, Place::Durative, scope)?;
                Some(at(*when, inner))
            }
            [] => Some(Timed::default()),
            [None] => {
                let span = span_of_formula(formula);
                let message = "a condition of a durative action without a time";
                let help = "write `(at start …)`, `(over all …)` or `(at end …)` around it";
                self.push(Diagnostic::error("duration", message, span, "when must it hold?").with_help(help));
                // The names in it are looked up all the same.
                self.condition(&without_times(formula), false, Place::Durative, scope);
                None
            }
            _ => {
                let span = span_of_formula(formula);
                let message = "a choice between conditions of different times is not supported";
                let help = "split the action, one for each choice";
                self.push(Diagnostic::error("not-supported", message, span, "not supported").with_help(help));
                None
            }
        }
    }
}

fn at(when: When, condition: Condition) -> Timed<Condition> {
    let mut timed = Timed::default();
    match when {
        When::Start => timed.start = condition,
        When::OverAll => timed.over_all = condition,
        When::End => timed.end = condition,
    }
    timed
}

/// Conjunction of conditions, with nested conjunctions merged into it.
pub(super) fn all_of(parts: Vec<Condition>) -> Condition {
    let mut flat = Vec::with_capacity(parts.len());
    for part in parts {
        match part {
            Condition::And(inner) => flat.extend(inner),
            other => flat.push(other),
        }
    }
    if flat.len() == 1 { flat.swap_remove(0) } else { Condition::And(flat) }
}

fn literal(leaf: Condition, negated: bool) -> Condition {
    if negated { Condition::Not(Box::new(leaf)) } else { leaf }
}

fn opposite(comparison: Comparison) -> Comparison {
    match comparison {
        Comparison::Less => Comparison::GreaterOrEqual,
        Comparison::LessOrEqual => Comparison::Greater,
        Comparison::Equal => Comparison::Equal,
        Comparison::GreaterOrEqual => Comparison::Less,
        Comparison::Greater => Comparison::LessOrEqual,
    }
}

/// Adds the distinct time specifiers of a formula's leaves; `None` for leaves without one.
fn collect_times(formula: &Formula, into: &mut Vec<Option<When>>) {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => parts.iter().for_each(|part| collect_times(part, into)),
        Formula::Not(inner) | Formula::Exists(_, inner) | Formula::Forall(_, inner) => {
            collect_times(inner, into)
        }
        Formula::Imply(left, right) => {
            collect_times(left, into);
            collect_times(right, into);
        }
        Formula::Timed(when, _, _) => into.push(Some(*when)),
        _ => into.push(None),
    }
    into.sort_unstable();
    into.dedup();
}

fn without_times(formula: &Formula) -> Formula {
    let all = |parts: &[Formula]| parts.iter().map(without_times).collect();
    let boxed = |inner: &Formula| Box::new(without_times(inner));
    match formula {
        Formula::And(parts) => Formula::And(all(parts)),
        Formula::Or(parts) => Formula::Or(all(parts)),
        Formula::Not(inner) => Formula::Not(boxed(inner)),
        Formula::Imply(left, right) => Formula::Imply(boxed(left), boxed(right)),
        Formula::Exists(variables, inner) => Formula::Exists(variables.clone(), boxed(inner)),
        Formula::Forall(variables, inner) => Formula::Forall(variables.clone(), boxed(inner)),
        Formula::Timed(_, inner, _) => (**inner).clone(),
        other => other.clone(),
    }
}

pub(super) fn span_of_formula(formula: &Formula) -> Span {
    let around = |parts: &[Formula]| {
        let spans: Vec<Span> = parts.iter().map(span_of_formula).collect();
        spans.iter().copied().reduce(Span::to).unwrap_or_default()
    };
    match formula {
        Formula::And(parts) | Formula::Or(parts) => around(parts),
        Formula::Not(inner) | Formula::Exists(_, inner) | Formula::Forall(_, inner) => span_of_formula(inner),
        Formula::Imply(left, right) => span_of_formula(left).to(span_of_formula(right)),
        Formula::Atom { span, .. }
        | Formula::Compare { span, .. }
        | Formula::Timed(_, _, span)
        | Formula::Preference(_, _, span)
        | Formula::Modal { span, .. } => *span,
        Formula::Call(call) => call.span,
    }
}

/// Value of an expression that consists of numbers only; `None` for other expressions.
pub(super) fn constant(expression: &Expression) -> Option<f64> {
    let all = |parts: &[Expression]| parts.iter().map(constant).collect::<Option<Vec<f64>>>();
    Some(match expression {
        Expression::Number(number) => *number,
        Expression::Add(parts) => all(parts)?.iter().sum(),
        Expression::Multiply(parts) => all(parts)?.iter().product(),
        Expression::Subtract(both) => constant(&both[0])? - constant(&both[1])?,
        Expression::Divide(both) => constant(&both[0])? / constant(&both[1])?,
        Expression::Negative(inner) => -constant(inner)?,
        _ => return None,
    })
}
