//! Why there is no plan.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use crate::diagnostic::{Diagnostic, Findings, Span};
use crate::ground::{GroundTask, MissingAtom, Obstacle};
use crate::task::{
    Action, Atom, Call, Change, Condition, Expression, FunctionId, GroundChange, ModuleId, PredicateId, Task,
    Term,
};

/// Why a task has no plan: findings that point at the goal, at what nobody achieves, and at who said no.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// The reasons, the goal's first.
    pub findings: Findings,
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, finding) in self.findings.list.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            f.write_str(&finding.message)?;
            if let Some(help) = &finding.help {
                write!(f, " ({help})")?;
            }
        }
        Ok(())
    }
}

/// Calls that an attachment refused, by module: no, or an infinite cost.
pub(crate) type Refusals = BTreeMap<u32, Vec<String>>;

/// How many refused calls of one module are shown.
const SHOWN: usize = 8;

/// The reasons why a task has no plan.
pub(crate) fn explain(task: &Task, refusals: &Refusals) -> Explanation {
    let reach = Reach::new(task);
    let mut list = Vec::new();
    let mut parts = Vec::new();
    conjuncts(&task.goal.body, &mut parts);
    for part in parts {
        list.extend(goal_part(task, &reach, part));
    }
    for (&module, calls) in refusals {
        list.extend(refused(task, ModuleId(module), calls));
    }
    if list.is_empty() {
        let message = "every state that can be reached was seen, and none fulfils the whole goal";
        let span = first_span(&task.goal.body).unwrap_or_default();
        let help =
            "each part of the goal can be had if nothing is ever taken away: some parts exclude each other";
        list.push(Diagnostic::error("unsolvable", message, span, "this goal").with_help(help));
    }
    Explanation { findings: Findings { sources: task.sources.to_vec(), list } }
}

fn conjuncts<'t>(condition: &'t Condition, parts: &mut Vec<&'t Condition>) {
    match condition {
        Condition::And(inner) => inner.iter().for_each(|part| conjuncts(part, parts)),
        Condition::Forall(_, inner) => conjuncts(inner, parts),
        other => parts.push(other),
    }
}

/// Predicates that can become true when nothing is taken away and arguments do not matter, and what stands in the way
/// of the actions that can never be taken.
struct Reach<'t> {
    task: &'t Task,
    predicates: Vec<bool>,
}

impl<'t> Reach<'t> {
    fn new(task: &'t Task) -> Reach<'t> {
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

    /// The first atom that keeps an action from ever being taken. What its own start adds holds inside it.
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

/// Predicates that an action can make true, its effect modules included.
fn added<'t>(task: &'t Task, action: &'t Action) -> impl Iterator<Item = (PredicateId, Span)> + 't {
    use crate::task::Written;
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

fn goal_part(task: &Task, reach: &Reach, part: &Condition) -> Option<Diagnostic> {
    match part {
        Condition::Atom(atom) if !reach.predicates[atom.predicate.index()] => Some(nobody(task, reach, atom)),
        Condition::Compare(_, sides, span) => {
            let mut functions = Vec::new();
            sides.iter().for_each(|side| fluents(side, &mut functions));
            let changed =
                |function: &FunctionId| task.actions.iter().any(|action| changes(task, action, *function));
            if functions.is_empty() || functions.iter().any(changed) {
                return None;
            }
            let names: Vec<&str> =
                functions.iter().map(|&function| task.function(function).name.as_str()).collect();
            let message = format!("the goal compares `{}`, which no action changes", names.join("`, `"));
            Some(
                Diagnostic::error("unsolvable", message, *span, "false at the beginning, and for ever")
                    .with_help("give some action an effect on it, or correct its value in `:init`"),
            )
        }
        _ => None,
    }
}

/// A goal atom out of reach: who could add it, and what those lack, down to what nobody adds at all.
fn nobody(task: &Task, reach: &Reach, goal: &Atom) -> Diagnostic {
    let name = |predicate: PredicateId| task.predicate(predicate).name.as_str();
    let mut finding = Diagnostic::error(
        "unsolvable",
        format!("the goal {} can never be reached", atom_text(task, goal)),
        goal.span,
        "asked for here",
    );
    let (mut wanted, mut seen) = (goal.predicate, vec![goal.predicate]);
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
    let declared = task.predicate(wanted).span;
    finding.with_label(declared, format!("nothing ever makes `{}` true", name(wanted))).with_help(format!(
        "add {} to `:init`, or give some action the effect `({} …)`",
        if wanted == goal.predicate {
            "it".to_string()
        } else {
            format!("what is needed of `{}`", name(wanted))
        },
        name(wanted)
    ))
}

/// What an attachment refused, under the call in the domain.
fn refused(task: &Task, module: ModuleId, calls: &[String]) -> Option<Diagnostic> {
    let (action, call) = task.actions.iter().find_map(|action| Some((action, call_of(action, module)?)))?;
    let more = calls.len().saturating_sub(SHOWN);
    let mut shown = calls.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    if more > 0 {
        shown.push_str(&format!(" and {more} more"));
    }
    let message = format!("the attachment of `{}` said no: {shown}", task.module(module).name);
    Some(
        Diagnostic::error(
            "attachment-refused",
            message,
            call.span,
            format!("`{}` depends on it here", action.name),
        )
        .with_help("with any of these answered otherwise there might be a plan"),
    )
}

/// The first call of a module in an action.
fn call_of(action: &Action, module: ModuleId) -> Option<&Call> {
    let bounds = action.duration.iter().flatten().find_map(|bound| in_expression(&bound.value, module));
    let condition = &action.condition;
    bounds
        .or_else(|| {
            [&condition.start, &condition.over_all, &condition.end]
                .into_iter()
                .find_map(|c| in_condition(c, module))
        })
        .or_else(|| action.grounding.iter().find(|call| call.module == module))
}

fn in_condition(condition: &Condition, module: ModuleId) -> Option<&Call> {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            parts.iter().find_map(|part| in_condition(part, module))
        }
        Condition::Not(inner) | Condition::Forall(_, inner) | Condition::Exists(_, inner) => {
            in_condition(inner, module)
        }
        Condition::Call(call) => (call.module == module).then_some(call),
        Condition::Compare(_, sides, _) => sides.iter().find_map(|side| in_expression(side, module)),
        Condition::Atom(_) | Condition::Same(..) => None,
    }
}

fn in_expression(expression: &Expression, module: ModuleId) -> Option<&Call> {
    match expression {
        Expression::Call(call) => (call.module == module).then_some(call),
        Expression::Add(parts) | Expression::Multiply(parts) => {
            parts.iter().find_map(|part| in_expression(part, module))
        }
        Expression::Subtract(sides) | Expression::Divide(sides) => {
            sides.iter().find_map(|side| in_expression(side, module))
        }
        Expression::Negative(inner) => in_expression(inner, module),
        _ => None,
    }
}

fn fluents(expression: &Expression, functions: &mut Vec<FunctionId>) {
    match expression {
        Expression::Fluent(fluent) => functions.push(fluent.function),
        Expression::Add(parts) | Expression::Multiply(parts) => {
            parts.iter().for_each(|part| fluents(part, functions))
        }
        Expression::Subtract(sides) | Expression::Divide(sides) => {
            sides.iter().for_each(|side| fluents(side, functions))
        }
        Expression::Negative(inner) => fluents(inner, functions),
        _ => {}
    }
}

fn changes(task: &Task, action: &Action, function: FunctionId) -> bool {
    use crate::task::Written;
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

fn first_span(condition: &Condition) -> Option<Span> {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => parts.iter().find_map(first_span),
        Condition::Not(inner) | Condition::Forall(_, inner) | Condition::Exists(_, inner) => {
            first_span(inner)
        }
        Condition::Atom(atom) => Some(atom.span),
        Condition::Same(_, span) | Condition::Compare(_, _, span) => Some(*span),
        Condition::Call(call) => Some(call.span),
    }
}

impl Explanation {
    /// From what grounding found out: one finding an atom that nobody achieves, the goal's first. Empty where only the
    /// search could tell that there is no plan.
    pub fn of_obstacles(task: &Task, ground: &GroundTask) -> Explanation {
        let list = ground.obstacles.iter().map(|obstacle| finding(task, obstacle)).collect();
        Explanation { findings: Findings { sources: task.sources.to_vec(), list } }
    }
}

fn finding(task: &Task, obstacle: &Obstacle) -> Diagnostic {
    let atom = named(task, &(obstacle.predicate, obstacle.arguments.clone()));
    let predicates = task.predicates.len();
    let span = match (obstacle.predicate as usize).checked_sub(predicates) {
        None => task.predicates[obstacle.predicate as usize].span,
        Some(function) => task.functions[function].span,
    };
    let nobody = obstacle.achievers.is_empty() && obstacle.rules.is_empty();
    let message = if nobody {
        format!("{atom} never holds: it is not there at first and no action brings it about")
    } else {
        format!("{atom} never holds: nothing that could bring it about can ever be applied")
    };
    let mut finding = Diagnostic::error("out-of-reach", message, span, "declared here");
    let actions = obstacle.achievers.iter().map(|(schema, missing)| {
        let action = &task.actions[*schema as usize];
        (action.span, format!("`{}`", action.name), missing)
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

/// An atom as it is written; `?` for any object.
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
