//! Warnings about language features used without the `:requirements` flag that allows them.

use super::Checker;
use super::conditions::span_of_formula;
use crate::diagnostic::{Diagnostic, Span};
use crate::pddl::ast::{ActionAst, Domain, EffectAst, Formula, ProblemAst};

/// Language feature that needs a requirement.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Feature {
    Typing,
    Negation,
    Disjunction,
    Exists,
    Forall,
    When,
}

impl Feature {
    const ALL: [Feature; 6] = [
        Feature::Typing,
        Feature::Negation,
        Feature::Disjunction,
        Feature::Exists,
        Feature::Forall,
        Feature::When,
    ];

    fn word(self) -> &'static str {
        match self {
            Feature::Typing => ":types",
            Feature::Negation => "not",
            Feature::Disjunction => "or",
            Feature::Exists => "exists",
            Feature::Forall => "forall",
            Feature::When => "when",
        }
    }

    fn allowed_by(self) -> &'static [&'static str] {
        match self {
            Feature::Typing => &[":typing", ":adl", ":ucpop"],
            Feature::Negation => &[":negative-preconditions", ":disjunctive-preconditions", ":adl"],
            Feature::Disjunction => &[":disjunctive-preconditions", ":adl"],
            Feature::Exists => &[":existential-preconditions", ":quantified-preconditions", ":adl"],
            Feature::Forall => &[":universal-preconditions", ":quantified-preconditions", ":adl"],
            Feature::When => &[":conditional-effects", ":adl", ":ucpop"],
        }
    }
}

/// Features that a task uses, with the spans of their uses.
type Uses = Vec<(Feature, Span)>;

impl Checker<'_> {
    /// Warns of each missing requirement once, at the first use of the feature.
    pub(super) fn requirements(&mut self, domain: &Domain, problem: Option<&ProblemAst>) {
        let mut uses = Uses::new();
        uses.extend(domain.types.first().map(|first| (Feature::Typing, first.name.span)));
        domain.actions.iter().for_each(|action| in_action(action, &mut uses));
        domain.derived.iter().for_each(|rule| in_formula(&rule.body, &mut uses));
        problem.iter().flat_map(|problem| &problem.goal).for_each(|goal| in_formula(goal, &mut uses));
        let declared: Vec<&str> = domain
            .requirements
            .iter()
            .chain(problem.iter().flat_map(|problem| &problem.requirements))
            .map(|name| self.name(name.symbol))
            .collect();
        for feature in Feature::ALL {
            let allowed = feature.allowed_by();
            let first = uses.iter().find(|(used, _)| *used == feature);
            let Some(&(_, span)) = first.filter(|_| !allowed.iter().any(|name| declared.contains(name)))
            else {
                continue;
            };
            let message = format!("`{}` is used without its requirement", feature.word());
            let label = format!("this needs `{}`", allowed[0]);
            let finding = Diagnostic::warning("missing-requirement", message, span, label);
            self.push(finding.with_help(format!("add `{}` to `(:requirements …)`", allowed[0])));
        }
    }
}

fn in_action(action: &ActionAst, uses: &mut Uses) {
    action.condition.iter().for_each(|condition| in_formula(condition, uses));
    action.effect.iter().for_each(|effect| in_effect(effect, uses));
}

fn in_effect(effect: &EffectAst, uses: &mut Uses) {
    match effect {
        EffectAst::And(parts) => parts.iter().for_each(|part| in_effect(part, uses)),
        EffectAst::Forall(_, inner) | EffectAst::Timed(_, inner, _) => in_effect(inner, uses),
        EffectAst::When(condition, inner) => {
            uses.push((Feature::When, span_of_formula(condition)));
            in_formula(condition, uses);
            in_effect(inner, uses);
        }
        EffectAst::Literal { .. } | EffectAst::Assign { .. } | EffectAst::Call(_) => {}
    }
}

fn in_formula(formula: &Formula, uses: &mut Uses) {
    let place = span_of_formula(formula);
    match formula {
        Formula::And(parts) => parts.iter().for_each(|part| in_formula(part, uses)),
        Formula::Or(parts) => {
            uses.push((Feature::Disjunction, place));
            parts.iter().for_each(|part| in_formula(part, uses));
        }
        Formula::Imply(left, right) => {
            uses.push((Feature::Disjunction, place));
            in_formula(left, uses);
            in_formula(right, uses);
        }
        Formula::Not(inner) => {
            // That two things are not the same needs `:equality` alone.
            if !matches!(**inner, Formula::Compare { .. }) {
                uses.push((Feature::Negation, place));
            }
            in_formula(inner, uses);
        }
        Formula::Exists(_, inner) => {
            uses.push((Feature::Exists, place));
            in_formula(inner, uses);
        }
        Formula::Forall(_, inner) => {
            uses.push((Feature::Forall, place));
            in_formula(inner, uses);
        }
        Formula::Timed(_, inner, _) | Formula::Preference(_, inner, _) => in_formula(inner, uses),
        Formula::Modal { formulas, .. } => formulas.iter().for_each(|part| in_formula(part, uses)),
        Formula::Atom { .. } | Formula::Compare { .. } | Formula::Call(_) => {}
    }
}
