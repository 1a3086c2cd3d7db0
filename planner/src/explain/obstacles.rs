//! Findings about atoms that grounding found unreachable.

use crate::diagnostic::{Diagnostic, Span};
use crate::ground::{MissingAtom, Obstacle};
use crate::model::walk::{self, Part};
use crate::task::{Action, Condition, Task, Term};

/// Span at which a condition mentions an atom with these arguments (`None`: any object).
fn asked(condition: &Condition, (predicate, arguments): (u32, &[Option<u32>])) -> Option<Span> {
    let same = |term: &Term, object: &Option<u32>| match term {
        Term::Object(own) => object.is_none_or(|object| own.0 == object),
        Term::Variable(_) | Term::Function(_) => true,
    };
    let mut found = None;
    walk::condition(condition, &mut |part| {
        if let Part::Condition(Condition::Atom(atom)) = part {
            let own = atom.predicate.0 == predicate
                && atom.arguments.iter().zip(arguments).all(|(term, object)| same(term, object));
            found = found.or(own.then_some(atom.span));
        }
    });
    found
}

/// Span at which an action's conditions mention one of some atoms: the first that they do mention.
fn needed(action: &Action, missing: &[MissingAtom]) -> Option<Span> {
    let condition = &action.condition;
    let asks = |(predicate, arguments): &MissingAtom| {
        [&condition.start, &condition.over_all, &condition.end]
            .into_iter()
            .find_map(|part| asked(part, (*predicate, arguments)))
    };
    missing.iter().find_map(asks)
}

/// Finding about an atom that never holds: where it is needed, which actions and rules could
/// achieve it, and which atoms these lack.
pub(super) fn obstacle_finding(
    task: &Task,
    obstacle: &Obstacle,
    chain: &[Obstacle],
    goal: &[&Condition],
) -> Diagnostic {
    let atom = named(task, &(obstacle.predicate, obstacle.arguments.clone()));
    let predicates = task.predicates.len();
    let declared = match (obstacle.predicate as usize).checked_sub(predicates) {
        None => task.predicates[obstacle.predicate as usize].span,
        Some(function) => task.functions[function].span,
    };
    let nobody = obstacle.achievers.is_empty() && obstacle.rules.is_empty();
    let message = if nobody {
        format!("{atom} never holds: it is not there at first and no action brings it about")
    } else {
        format!("{atom} never holds: nothing that could bring it about can ever be applied")
    };
    let wanted = (obstacle.predicate, obstacle.arguments.as_slice());
    let by_goal = goal.iter().find_map(|part| asked(part, wanted));
    let missing = [(obstacle.predicate, obstacle.arguments.clone())];
    let by_action = || {
        let achievers = chain.iter().flat_map(|earlier| &earlier.achievers);
        let lacks = achievers.filter(|(_, lacks)| lacks.contains(&missing[0]));
        let mut actions = lacks.map(|(schema, _)| &task.actions[*schema as usize]);
        actions.find_map(|action| Some((needed(action, &missing)?, &action.name)))
    };
    let mut finding = match by_goal {
        Some(span) => Diagnostic::error("out-of-reach", message, span, "the goal asks for it"),
        None => match by_action() {
            Some((span, name)) => {
                Diagnostic::error("out-of-reach", message, span, format!("`{name}` asks for it"))
            }
            None => Diagnostic::error("out-of-reach", message, declared, "declared here"),
        },
    };
    let actions = obstacle.achievers.iter().map(|(schema, missing)| {
        let action = &task.actions[*schema as usize];
        (needed(action, missing).unwrap_or(action.span), format!("`{}`", action.name), missing)
    });
    let rules = obstacle
        .rules
        .iter()
        .map(|(rule, missing)| (task.rules[*rule as usize].span, "this rule".to_string(), missing));
    for (span, name, missing) in actions.chain(rules) {
        let lacks: Vec<String> = missing.iter().map(|atom| named(task, atom)).collect();
        let text = if lacks.is_empty() {
            format!("{name} could bring it about, but its conditions never hold together")
        } else {
            format!("{name} could bring it about, but lacks {}", lacks.join(", "))
        };
        finding = finding.with_label(span, text);
    }
    if nobody {
        finding = finding.with_help(format!("add {atom} to `:init`, or an action with this effect"));
    }
    finding
}

/// Atom in PDDL, with `?` for any object.
fn named(task: &Task, (predicate, arguments): &MissingAtom) -> String {
    let object = |a: &Option<u32>| a.map_or("?", |a| &task.objects[a as usize].name);
    let words: Vec<&str> = arguments.iter().map(object).collect();
    match (*predicate as usize).checked_sub(task.predicates.len()) {
        None => {
            let name = task.predicates[*predicate as usize].name.as_str();
            format!("`({})`", [&[name], &words[..]].concat().join(" "))
        }
        Some(function) => {
            let name = task.functions[function].name.as_str();
            let (value, own) = words.split_last().map_or(("?", &[][..]), |(v, own)| (*v, own));
            format!("`(= ({}) {value})`", [&[name], own].concat().join(" "))
        }
    }
}
