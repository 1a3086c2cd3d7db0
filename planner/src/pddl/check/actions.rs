//! Checks of actions: parameters, durations, conditions and effects.

use super::conditions::{all_of, constant};
use super::expressions::{Place, Value, span_of};
use super::{Checker, Scope};
use crate::attachment::CallKind;
use crate::diagnostic::{Diagnostic, Span};
use crate::model::agreement::contradictions;
use crate::pddl::ast::{self, Arithmetic, Assignment, Comparison, Formula, Name, When};
use crate::task::{
    Action, Change, Condition, DurationBound, Effect, Expression, Fluent, PreferenceId, Quantified, Rate,
    Term, Timed,
};

/// Quantified variables and conditions around an effect.
#[derive(Clone, Default)]
struct Around {
    forall: Vec<Quantified>,
    when: Timed<Condition>,
}

/// Effects and rates of an action found so far.
#[derive(Default)]
struct Found {
    effects: Timed<Vec<Effect>>,
    rates: Vec<Rate>,
}

impl Checker<'_> {
    pub(super) fn action(&mut self, action: &ast::ActionAst) {
        let name = self.name(action.name.symbol).to_string();
        if let Some(first) = self.actions.insert(action.name.symbol, action.name.span) {
            let message = format!("action `{name}` is declared twice");
            self.push(
                Diagnostic::error("duplicate", message, action.name.span, "declared again here")
                    .with_label(first, "first declared here")
                    .with_help("rename one of them: a plan names actions by their name alone"),
            );
        }
        let mut scope = Scope::default();
        let parameters = self.scoped_parameters(&action.parameters, &mut scope);
        let duration = action.durative.then(|| self.duration(action, &scope));
        let grounding =
            action.grounding.iter().filter_map(|call| self.call(call, CallKind::Grounding, &scope)).collect();
        let mut preferences = Vec::new();
        let condition = match &action.condition {
            Some(formula) => self.action_condition(formula, action.durative, &mut scope, &mut preferences),
            None => Some(Timed::default()),
        };
        let mut found = Found::default();
        if let Some(effect) = &action.effect {
            let when = (!action.durative).then_some(When::Start);
            self.effect(effect, &Around::default(), when, action.durative, &mut scope, &mut found);
        }
        [&found.effects.start, &found.effects.end].into_iter().for_each(|effects| self.agree(effects));
        self.task.actions.push(Action {
            name,
            parameters,
            slots: scope.slots,
            duration,
            condition: condition.unwrap_or_default(),
            effects: found.effects,
            continuous: found.rates,
            grounding,
            preferences,
            span: action.name.span,
        });
    }

    /// Reports simultaneous changes of one number or object function that contradict each other.
    fn agree(&mut self, effects: &[Effect]) {
        let is_always = |effect: &Effect| effect.when == Timed::default();
        let together = |one: &Effect, other: &Effect| {
            (one.when == other.when || is_always(one) || is_always(other))
                && (one.forall == other.forall || one.forall.is_empty() || other.forall.is_empty())
        };
        for (index, effect) in effects.iter().enumerate() {
            let earlier = effects[..index].iter().filter(|other| together(other, effect));
            let found = earlier.filter_map(|other| Some((other, contradict(other, effect)?))).next();
            if let Some((other, what)) = found {
                let message = format!("two changes of one {what} at once contradict each other");
                self.push(
                    Diagnostic::warning("contradicting-effects", message, effect.span, "and here in another way")
                        .with_label(other.span, format!("the {what} is changed here"))
                        .with_help("PDDL gives no result of both: where they happen together, the action cannot be taken; make one change of the two"),
                );
            }
        }
    }

    fn duration(&mut self, action: &ast::ActionAst, scope: &Scope) -> Vec<DurationBound> {
        let mut bounds = Vec::new();
        for bound in &action.duration {
            let Some(value) = self.expression(&bound.value, Place::Bound, scope) else { continue };
            bounds.push(DurationBound {
                when: bound.when,
                comparison: bound.comparison,
                value,
                span: bound.span,
            });
        }
        self.possible_duration(&bounds);
        bounds
    }

    /// Reports constant bounds that allow no duration.
    fn possible_duration(&mut self, bounds: &[DurationBound]) {
        let constants: Vec<(&DurationBound, f64)> =
            bounds.iter().filter_map(|bound| Some((bound, constant(&bound.value)?))).collect();
        use Comparison::{Equal, Greater, GreaterOrEqual, Less, LessOrEqual};
        let upper = constants
            .iter()
            .filter(|(bound, _)| matches!(bound.comparison, Less | LessOrEqual | Equal))
            .min_by(|left, right| left.1.total_cmp(&right.1));
        let lower = constants
            .iter()
            .filter(|(bound, _)| matches!(bound.comparison, Greater | GreaterOrEqual | Equal))
            .max_by(|left, right| left.1.total_cmp(&right.1));
        if let Some((bound, value)) = upper.filter(|(_, value)| *value < 0.0) {
            let message = format!("a duration of at most {value}");
            let label = "no action ends before it starts";
            self.push(
                Diagnostic::error("duration", message, bound.span, label)
                    .with_help("durations are at least 0"),
            );
            return;
        }
        if let (Some((upper, most)), Some((lower, least))) = (upper, lower)
            && least > most
        {
            let message = format!("no duration is at least {least} and at most {most}");
            self.push(
                Diagnostic::error("duration", message, lower.span, format!("at least {least} here"))
                    .with_label(upper.span, format!("at most {most} here"))
                    .with_help("were `<=` and `>=` exchanged?"),
            );
        }
    }

    fn action_condition(
        &mut self,
        formula: &Formula,
        durative: bool,
        scope: &mut Scope,
        preferences: &mut Vec<(PreferenceId, Timed<Condition>)>,
    ) -> Option<Timed<Condition>> {
        let mut hard = Vec::new();
        self.split_preferences(formula, durative, &[], scope, preferences, &mut hard);
        if hard.len() == 1 && std::ptr::eq(hard[0], formula) {
            return self.one_or_timed(formula, durative, scope);
        }
        let parts: Vec<Option<Timed<Condition>>> =
            hard.into_iter().map(|part| self.one_or_timed(part, durative, scope)).collect();
        let (mut start, mut over_all, mut end) = (Vec::new(), Vec::new(), Vec::new());
        for part in parts.into_iter().collect::<Option<Vec<_>>>()? {
            start.push(part.start);
            over_all.push(part.over_all);
            end.push(part.end);
        }
        Some(Timed { start: all_of(start), over_all: all_of(over_all), end: all_of(end) })
    }

    fn one_or_timed(
        &mut self,
        formula: &Formula,
        durative: bool,
        scope: &mut Scope,
    ) -> Option<Timed<Condition>> {
        if durative {
            return self.timed_condition(formula, scope);
        }
        let start = self.condition(formula, false, Place::Condition, scope)?;
        Some(Timed { start, ..Timed::default() })
    }

    /// Separates preferences from a condition: these are added to `preferences`, the other parts to
    /// `hard`.
    fn split_preferences<'f>(
        &mut self,
        formula: &'f Formula,
        durative: bool,
        quantifiers: &[&'f [ast::Typed]],
        scope: &mut Scope,
        preferences: &mut Vec<(PreferenceId, Timed<Condition>)>,
        hard: &mut Vec<&'f Formula>,
    ) {
        match formula {
            Formula::And(parts) if parts.iter().any(has_preference) => {
                for part in parts {
                    self.split_preferences(part, durative, quantifiers, scope, preferences, hard);
                }
            }
            Formula::Preference(name, inner, span) => {
                let id = self.preference(*name);
                if let Some(condition) = self.one_or_timed(inner, durative, scope) {
                    preferences.push((id, condition));
                }
                if !quantifiers.is_empty() {
                    let message = "a preference of an action inside `forall` is not supported";
                    self.push(Diagnostic::error("not-supported", message, *span, "not supported"));
                }
            }
            Formula::Forall(variables, inner) if has_preference(inner) => {
                let (before, _) = self.quantify(variables, scope);
                let around: Vec<&[ast::Typed]> =
                    quantifiers.iter().copied().chain([variables.as_slice()]).collect();
                self.split_preferences(inner, durative, &around, scope, preferences, &mut Vec::new());
                scope.variables.truncate(before);
            }
            other => hard.push(other),
        }
    }

    /// Preference of this name, created at its first use; `None` always creates a new, unnamed one.
    pub(super) fn preference(&mut self, name: Option<Name>) -> PreferenceId {
        let id = self.task.preferences.len() as u32;
        if let Some(name) = name {
            if let Some(&known) = self.preferences.get(&name.symbol) {
                return PreferenceId(known);
            }
            self.preferences.insert(name.symbol, id);
        }
        let name = name.map_or("", |name| self.name(name.symbol)).to_string();
        self.task.preferences.push(crate::task::Preference { name, goals: Vec::new() });
        PreferenceId(id)
    }

    fn effect(
        &mut self,
        effect: &ast::EffectAst,
        around: &Around,
        when: Option<When>,
        durative: bool,
        scope: &mut Scope,
        found: &mut Found,
    ) {
        match effect {
            ast::EffectAst::And(parts) => {
                for part in parts {
                    self.effect(part, around, when, durative, scope, found);
                }
            }
            ast::EffectAst::Forall(variables, inner) => {
                let (before, quantified) = self.quantify(variables, scope);
                let mut around = around.clone();
                around.forall.extend(quantified);
                self.effect(inner, &around, when, durative, scope, found);
                scope.variables.truncate(before);
            }
            ast::EffectAst::When(condition, inner) => {
                self.conditional(condition, inner, around, when, durative, scope, found);
            }
            ast::EffectAst::Timed(when, inner, _) => {
                self.effect(inner, around, Some(*when), durative, scope, found)
            }
            ast::EffectAst::Literal { negated, name, arguments, span } => {
                let Some(atom) = self.atom(*name, arguments, *span, scope) else { return };
                self.changeable(&atom, *name);
                let change = if *negated { Change::Delete(atom) } else { Change::Add(atom) };
                self.add_effect(change, around, when, *span, found);
            }
            ast::EffectAst::Call(call) => {
                let span = call.span;
                let Some(call) = self.call(call, CallKind::Effect, scope) else { return };
                self.add_effect(Change::Call(call), around, when, span, found);
            }
            ast::EffectAst::Assign { assignment, fluent, value, span } => {
                let place = if durative { Place::Durative } else { Place::Effect };
                if durative && when.is_none() && mentions_time(value) {
                    self.rate(*assignment, fluent, value, *span, around, scope, found);
                } else if let Some(change) = self.assignment(*assignment, fluent, value, *span, place, scope)
                {
                    self.add_effect(change, around, when, *span, found);
                }
            }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "the context of an effect and the two parts of a `when`")]
    fn conditional(
        &mut self,
        condition: &Formula,
        inner: &ast::EffectAst,
        around: &Around,
        when: Option<When>,
        durative: bool,
        scope: &mut Scope,
        found: &mut Found,
    ) {
        let condition = match when {
            Some(when) => {
                let place = if durative { Place::Durative } else { Place::Condition };
                self.condition(condition, false, place, scope).map(|condition| {
                    let mut timed = Timed::default();
                    if when == When::Start {
                        timed.start = condition
                    } else {
                        timed.end = condition
                    }
                    timed
                })
            }
            None => self.timed_condition(condition, scope),
        };
        // With an unreadable condition the effect is still looked at, for its own findings.
        let condition = condition.unwrap_or_default();
        let mut around = around.clone();
        let join = |one: Condition, other: Condition| all_of(vec![one, other]);
        around.when = Timed {
            start: join(around.when.start, condition.start),
            over_all: join(around.when.over_all, condition.over_all),
            end: join(around.when.end, condition.end),
        };
        self.effect(inner, &around, when, durative, scope, found);
    }

    fn add_effect(
        &mut self,
        change: Change,
        around: &Around,
        when: Option<When>,
        span: Span,
        found: &mut Found,
    ) {
        let effect = Effect { forall: around.forall.clone(), when: around.when.clone(), change, span };
        match when {
            Some(When::Start) => {
                if !effect.when.over_all.is_true() || !effect.when.end.is_true() {
                    let message = "an effect at start depends on a later condition";
                    self.push(
                        Diagnostic::error("duration", message, span, "this happens at start")
                            .with_help("its condition can only be `(at start …)`; or let it happen `at end`"),
                    );
                }
                found.effects.start.push(effect);
            }
            Some(_) => found.effects.end.push(effect),
            None => {
                let message = "an effect of a durative action without a time";
                let help = "write `(at start …)` or `(at end …)` around it";
                self.push(
                    Diagnostic::error("duration", message, span, "when does it happen?").with_help(help),
                );
            }
        }
    }

    /// Reports an effect that changes a derived predicate.
    fn changeable(&mut self, atom: &crate::task::Atom, name: Name) {
        if self.task.predicate(atom.predicate).stratum.is_none() {
            return;
        }
        let head = self.task.rules.iter().find(|rule| rule.predicate == atom.predicate).map(|rule| rule.span);
        let message = format!("derived predicate `{}` is changed by an action", self.name(name.symbol));
        let finding = Diagnostic::error("derived", message, atom.span, "this follows from a rule");
        let finding = match head {
            Some(head) => finding.with_label(head, "the rule is here"),
            None => finding,
        };
        self.push(finding.with_help("change what the rule depends on instead"));
    }

    fn assignment(
        &mut self,
        assignment: Assignment,
        fluent: &ast::TermAst,
        value: &ast::TermAst,
        span: Span,
        place: Place,
        scope: &Scope,
    ) -> Option<Change> {
        let (fluent, result) = match self.changed_fluent(fluent, scope) {
            Some(found) => found,
            None => {
                self.value(value, place, scope);
                return None;
            }
        };
        let Some(types) = result else {
            let amount = self.expression(value, place, scope)?;
            if assignment == Assignment::ScaleDown {
                self.divides(&amount, span_of(value));
            }
            return Some(Change::Number(assignment, fluent, amount));
        };
        if assignment != Assignment::Assign {
            let message = format!("`{}` is not a number", self.task.function(fluent.function).name);
            self.push(Diagnostic::error(
                "wrong-kind",
                message,
                span,
                "only numbers grow and shrink; use `assign`",
            ));
            return None;
        }
        let value = match value {
            // An object may be called 5.
            ast::TermAst::Number(..) => {
                let (term, types) = self.object_term(value, scope)?;
                Value::Object(term, types)
            }
            _ => self.value(value, place, scope)?,
        };
        match value {
            Value::Undefined => Some(Change::Object(fluent, None)),
            Value::Object(term, own) => {
                if !self.overlap(&own, &types) {
                    let (wanted, is) = (self.types_text(&types), self.types_text(&own));
                    let name = self.task.function(fluent.function).name.clone();
                    let message = format!("the value of `{name}` is a `{wanted}`, found a `{is}`");
                    let declared = self.task.function(fluent.function).span;
                    self.push(
                        Diagnostic::error("wrong-type", message, span, format!("a `{is}` is assigned here"))
                            .with_label(declared, "declared here"),
                    );
                }
                Some(Change::Object(fluent, Some(term)))
            }
            Value::Number(_) => {
                let message = format!("a `{}` was expected, found a number", self.types_text(&types));
                self.push(Diagnostic::error("wrong-kind", message, span, "a number is assigned here"));
                None
            }
        }
    }

    /// Function that an assignment changes, with the types of its value (`None` for a number).
    fn changed_fluent(
        &mut self,
        fluent: &ast::TermAst,
        scope: &Scope,
    ) -> Option<(Fluent, Option<Vec<crate::task::TypeId>>)> {
        let (name, arguments, span): (Name, &[ast::TermAst], Span) = match fluent {
            ast::TermAst::Name(name) => (*name, &[], name.span),
            ast::TermAst::Apply { name, arguments, span } => (*name, arguments, *span),
            other => {
                let span = span_of(other);
                self.push(Diagnostic::error(
                    "wrong-kind",
                    "only fluents change",
                    span,
                    "expected `(function …)`",
                ));
                return None;
            }
        };
        let fluent = self.fluent(name, arguments, span, scope)?;
        let result = self.task.function(fluent.function).result.clone();
        Some((fluent, result))
    }

    /// Adds a continuous effect, such as `(increase (f) (* #t e))`, to `found`.
    #[expect(clippy::too_many_arguments, reason = "the context of an effect and the three parts of a change")]
    fn rate(
        &mut self,
        assignment: Assignment,
        fluent: &ast::TermAst,
        value: &ast::TermAst,
        span: Span,
        around: &Around,
        scope: &Scope,
        found: &mut Found,
    ) {
        const HELP: &str = "a change at a rate looks like `(increase (fuel ?r) (* #t 2))`";
        let unconditional = around.forall.is_empty() && around.when == Timed::default();
        let direct = matches!(assignment, Assignment::Increase | Assignment::Decrease);
        let factor = match value {
            ast::TermAst::ContinuousTime(_) => Some(Expression::Number(1.0)),
            ast::TermAst::Arithmetic { operator: Arithmetic::Multiply, operands, .. } => {
                let times = operands
                    .iter()
                    .filter(|operand| matches!(operand, ast::TermAst::ContinuousTime(_)))
                    .count();
                let others: Vec<&ast::TermAst> = operands
                    .iter()
                    .filter(|operand| !matches!(operand, ast::TermAst::ContinuousTime(_)))
                    .collect();
                let factors: Option<Vec<Expression>> = (times == 1
                    && others.iter().all(|other| !mentions_time(other)))
                .then(|| others.iter().map(|other| self.expression(other, Place::Durative, scope)).collect())
                .flatten();
                factors.map(Expression::Multiply)
            }
            _ => None,
        };
        let (Some(factor), true, true) = (factor, unconditional, direct) else {
            let message = "this change over time is not supported";
            self.push(
                Diagnostic::error("not-supported", message, span, "not a constant rate").with_help(HELP),
            );
            return;
        };
        let Some((fluent, None)) = self.changed_fluent(fluent, scope) else { return };
        let per_second =
            if assignment == Assignment::Decrease { Expression::Negative(Box::new(factor)) } else { factor };
        found.rates.push(Rate { fluent, per_second, span });
    }
}

/// Kind of value that two effects change in contradicting ways: "number" or "object"; `None`
/// without contradiction.
fn contradict(one: &Effect, other: &Effect) -> Option<&'static str> {
    if let (Change::Object(fluent, value), Change::Object(other_fluent, other_value)) =
        (&one.change, &other.change)
    {
        let named = |value: &Option<Term>| value.as_ref().is_none_or(|term| matches!(term, Term::Object(_)));
        let same = fluent.function == other_fluent.function && fluent.arguments == other_fluent.arguments;
        return (same && value != other_value && named(value) && named(other_value)).then_some("object");
    }
    let (Change::Number(how, fluent, amount), Change::Number(other_how, other_fluent, other_amount)) =
        (&one.change, &other.change)
    else {
        return None;
    };
    let kinds = [(how, amount), (other_how, other_amount)];
    let kinds = kinds.map(|(how, amount)| ((), *how, constant(amount).unwrap_or(f64::NAN)));
    let same = fluent.function == other_fluent.function && fluent.arguments == other_fluent.arguments;
    (same && !contradictions(kinds.into_iter()).is_empty()).then_some("number")
}

fn has_preference(formula: &Formula) -> bool {
    match formula {
        Formula::Preference(..) => true,
        Formula::And(parts) => parts.iter().any(has_preference),
        Formula::Forall(_, inner) => has_preference(inner),
        _ => false,
    }
}

fn mentions_time(term: &ast::TermAst) -> bool {
    match term {
        ast::TermAst::ContinuousTime(_) => true,
        ast::TermAst::Arithmetic { operands, .. } => operands.iter().any(mentions_time),
        _ => false,
    }
}
