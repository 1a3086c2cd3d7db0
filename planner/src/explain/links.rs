//! Causal chain that explains an unreachable goal part: actions that could achieve it, the
//! preconditions that these lack, and so on down to a predicate that nothing achieves.

use crate::diagnostic::{Diagnostic, Span};
use crate::model::walk::{self, Part};
use crate::task::{
    Action, Atom, Change, Condition, Expression, FunctionId, GroundChange, ModuleId, PredicateId, Task, Term,
    Written,
};

use super::UNSOLVABLE;

/// Predicates reachable under delete relaxation when their arguments are ignored.
pub(super) struct Reach<'t> {
    task: &'t Task,
    predicates: Vec<bool>,
}

impl<'t> Reach<'t> {
    pub(super) fn new(task: &'t Task) -> Reach<'t> {
        let mut predicates = vec![false; task.predicates.len()];
        for fact in &task.init.facts {
            predicates[fact.predicate.index()] = true;
        }
        for timed in &task.init.timed {
            if let GroundChange::Add(fact) = &timed.change {
                predicates[fact.predicate.index()] = true;
            }
        }
        let mut reach = Reach { task, predicates };
        while reach.grow() {}
        reach
    }

    fn grow(&mut self) -> bool {
        let task = self.task;
        let mut found: Vec<PredicateId> = Vec::new();
        for action in task.actions.iter().filter(|action| self.lacks(action).is_none()) {
            found.extend(added(task, action).map(|(predicate, _)| predicate));
        }
        let rules = task.rules.iter().filter(|rule| self.unmet(&rule.body, &[]).is_none());
        found.extend(rules.map(|rule| rule.predicate));
        let mut grown = false;
        for predicate in found {
            grown |= !std::mem::replace(&mut self.predicates[predicate.index()], true);
        }
        grown
    }

    /// First atom in the conditions of an action that is unreachable, `None` if there is none.
    /// Conditions over all and at end may use what the action adds at its start.
    fn lacks(&self, action: &'t Action) -> Option<&'t Atom> {
        let own: Vec<PredicateId> = action
            .effects
            .start
            .iter()
            .filter_map(|effect| match &effect.change {
                Change::Add(atom) => Some(atom.predicate),
                _ => None,
            })
            .collect();
        self.unmet(&action.condition.start, &[])
            .or_else(|| self.unmet(&action.condition.over_all, &own))
            .or_else(|| self.unmet(&action.condition.end, &own))
    }

    fn unmet(&self, condition: &'t Condition, own: &[PredicateId]) -> Option<&'t Atom> {
        match condition {
            Condition::And(parts) => parts.iter().find_map(|part| self.unmet(part, own)),
            Condition::Or(parts) => {
                let unmet: Option<Vec<&Atom>> = parts.iter().map(|part| self.unmet(part, own)).collect();
                unmet.and_then(|atoms| atoms.first().copied())
            }
            Condition::Exists(_, inner) => self.unmet(inner, own),
            Condition::Atom(atom) => {
                let met = self.predicates[atom.predicate.index()] || own.contains(&atom.predicate);
                (!met).then_some(atom)
            }
            Condition::Forall(..)
            | Condition::Not(_)
            | Condition::Same(..)
            | Condition::Compare(..)
            | Condition::Call(_) => None,
        }
    }
}

/// Predicates that an action can add, including those that effect modules write, each with its
/// place in the text.
fn added<'t>(task: &'t Task, action: &'t Action) -> impl Iterator<Item = (PredicateId, Span)> + 't {
    let effects = action.effects.start.iter().chain(&action.effects.end);
    effects.flat_map(|effect| match &effect.change {
        Change::Add(atom) => vec![(atom.predicate, atom.span)],
        Change::Call(call) => {
            let writes = task.module(call.module).writes.iter();
            writes
                .filter_map(|written| match written {
                    Written::Truth(atom) => Some((atom.predicate, call.span)),
                    Written::Number(_) | Written::Object(_) => None,
                })
                .collect()
        }
        _ => Vec::new(),
    })
}

/// Finding about a goal part that nothing can achieve; `None` if some action might achieve it.
/// Predicates that the finding explains are added to `told`.
pub(super) fn goal_part(
    task: &Task,
    reach: &Reach,
    part: &Condition,
    told: &mut Vec<PredicateId>,
) -> Option<Diagnostic> {
    match part {
        Condition::Atom(atom) if !reach.predicates[atom.predicate.index()] => {
            Some(nobody(task, reach, atom, told))
        }
        Condition::Compare(_, sides, span) => {
            let mut functions = Vec::new();
            sides.iter().for_each(|side| fluents(side, &mut functions));
            let changes = |action: &&Action| functions.iter().any(|&f| changes(task, action, f));
            let changing: Vec<&Action> = task.actions.iter().filter(changes).collect();
            if functions.is_empty() || changing.iter().any(|action| reach.lacks(action).is_none()) {
                return None;
            }
            let names: Vec<&str> =
                functions.iter().map(|&function| task.function(function).name.as_str()).collect();
            if let Some((action, lacks)) = changing.iter().find_map(|a| Some((a, reach.lacks(a)?))) {
                let message = format!(
                    "the goal compares `{}`, which only actions change that can never be taken",
                    names.join("`, `")
                );
                let finding = Diagnostic::error(UNSOLVABLE, message, *span, "asked for here");
                let needs = format!(
                    "`{}` changes it, but needs `{}`",
                    action.name,
                    task.predicate(lacks.predicate).name
                );
                return Some(trace(
                    task,
                    reach,
                    finding.with_label(lacks.span, needs),
                    lacks.predicate,
                    told,
                ));
            }
            let message = format!("the goal compares `{}`, which no action changes", names.join("`, `"));
            Some(
                Diagnostic::error(UNSOLVABLE, message, *span, "false at the beginning, and for ever")
                    .with_help("give some action an effect on it, or correct its value in `:init`"),
            )
        }
        _ => None,
    }
}

/// Finding about an unreachable goal atom, with the chain of obstacles down to a predicate that
/// nothing achieves.
fn nobody(task: &Task, reach: &Reach, goal: &Atom, told: &mut Vec<PredicateId>) -> Diagnostic {
    let message = format!("the goal {} can never be reached", atom_text(task, goal));
    let finding = Diagnostic::error(UNSOLVABLE, message, goal.span, "asked for here");
    trace(task, reach, finding, goal.predicate, told)
}

/// Adds labels to a finding: the chain of obstacles from the predicate `first` down to one that
/// nothing achieves. All predicates of the chain are added to `told`.
fn trace(
    task: &Task,
    reach: &Reach,
    mut finding: Diagnostic,
    first: PredicateId,
    told: &mut Vec<PredicateId>,
) -> Diagnostic {
    let name = |predicate: PredicateId| task.predicate(predicate).name.as_str();
    let (mut wanted, mut seen) = (first, vec![first]);
    loop {
        let who = task.actions.iter().find_map(|action| {
            let gives = added(task, action).find(|(predicate, _)| *predicate == wanted)?;
            let lacks = reach.lacks(action)?;
            Some((action, gives.1, lacks))
        });
        let Some((action, gives, lacks)) = who else {
            let rule = task.rules.iter().find(|rule| rule.predicate == wanted);
            match rule.and_then(|rule| Some((rule, reach.unmet(&rule.body, &[])?))) {
                Some((rule, lacks)) if !seen.contains(&lacks.predicate) => {
                    finding = finding
                        .with_label(rule.span, format!("`{}` is derived here", name(wanted)))
                        .with_label(lacks.span, format!("which needs `{}`", name(lacks.predicate)));
                    seen.push(lacks.predicate);
                    wanted = lacks.predicate;
                    continue;
                }
                _ => break,
            }
        };
        finding = finding
            .with_label(gives, format!("only an action like `{}` adds it", action.name))
            .with_label(lacks.span, format!("but `{}` needs `{}`", action.name, name(lacks.predicate)));
        if seen.contains(&lacks.predicate) {
            break;
        }
        seen.push(lacks.predicate);
        wanted = lacks.predicate;
    }
    told.extend(seen);
    let declared = task.predicate(wanted).span;
    finding.with_label(declared, format!("nothing ever makes `{}` true", name(wanted))).with_help(format!(
        "add {} to `:init`, or give some action the effect `({} …)`",
        if wanted == first { "it".to_string() } else { format!("what is needed of `{}`", name(wanted)) },
        name(wanted)
    ))
}

/// Appends the functions that an expression reads.
fn fluents(expression: &Expression, functions: &mut Vec<FunctionId>) {
    walk::expression(expression, &mut |part| {
        if let Part::Expression(Expression::Fluent(fluent)) = part {
            functions.push(fluent.function);
        }
    });
}

fn changes(task: &Task, action: &Action, function: FunctionId) -> bool {
    let written = |module: ModuleId| {
        let writes = task.module(module).writes.iter();
        writes.into_iter().any(|w| matches!(w, Written::Number(fluent) if fluent.function == function))
    };
    let effects = action.effects.start.iter().chain(&action.effects.end);
    let changed = effects.into_iter().any(|effect| match &effect.change {
        Change::Number(_, fluent, _) => fluent.function == function,
        Change::Call(call) => written(call.module),
        _ => false,
    });
    changed || action.continuous.iter().any(|rate| rate.fluent.function == function)
}

fn atom_text(task: &Task, atom: &Atom) -> String {
    let mut text = format!("({}", task.predicate(atom.predicate).name);
    for argument in &atom.arguments {
        text.push(' ');
        match argument {
            Term::Object(object) => text.push_str(&task.object(*object).name),
            Term::Variable(_) => text.push('?'),
            Term::Function(fluent) => text.push_str(&task.function(fluent.function).name),
        }
    }
    text.push(')');
    text
}
