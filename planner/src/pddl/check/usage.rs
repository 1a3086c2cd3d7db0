//! Warnings about declarations that are never used, and about numbers that are read but never get a
//! value.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::diagnostic::{Diagnostic, Span};
use crate::model::walk::{self, Part};
use crate::task::{
    Assignment, Change, Condition, Expression, Fluent, FunctionId, GroundChange, GroundFluent, PredicateId,
    Task, Term,
};

/// Visits everything in actions, rules, goal, constraints, preferences and metric.
fn all<'t>(task: &'t Task, visit: &mut dyn FnMut(Part<'t>)) {
    task.actions.iter().for_each(|action| walk::action(action, visit));
    task.rules.iter().for_each(|rule| walk::condition(&rule.body, visit));
    walk::aims(task, visit);
}

/// Warnings about predicates and functions that only the initial state mentions; none for tasks
/// with modules.
pub(super) fn unused(task: &Task) -> Vec<Diagnostic> {
    if !task.modules.is_empty() {
        return Vec::new();
    }
    let mut predicates: FxHashSet<PredicateId> = task.rules.iter().map(|rule| rule.predicate).collect();
    let mut functions: FxHashSet<FunctionId> = FxHashSet::default();
    all(task, &mut |part| match part {
        Part::Condition(Condition::Atom(atom)) | Part::Change(Change::Add(atom) | Change::Delete(atom)) => {
            predicates.insert(atom.predicate);
        }
        Part::Fluent(fluent) => {
            functions.insert(fluent.function);
        }
        _ => {}
    });
    let finding = |kind: &str, name: &str, span: Span| {
        let message = format!("{kind} `{name}` is never used");
        Diagnostic::warning("unused", message, span, "no action, rule or goal speaks of it")
    };
    let ids = (0..task.predicates.len() as u32).map(PredicateId).filter(|id| !predicates.contains(id));
    let predicates = ids.map(|id| finding("predicate", &task.predicate(id).name, task.predicate(id).span));
    let ids = (0..task.functions.len() as u32).map(FunctionId).filter(|id| !functions.contains(id));
    let functions = ids.map(|id| finding("function", &task.function(id).name, task.function(id).span));
    predicates.chain(functions).collect()
}

/// Warnings about numbers that are read but never get a value: all instances of a function, or
/// single ones in the goal or metric. None for tasks with modules.
pub(crate) fn without_value(task: &Task) -> Vec<Diagnostic> {
    let mut given: FxHashSet<FunctionId> =
        task.init.numbers.iter().map(|(fluent, _)| fluent.function).collect();
    let mut assigned: FxHashSet<FunctionId> = FxHashSet::default();
    assigned.extend(task.init.timed.iter().filter_map(|timed| match &timed.change {
        GroundChange::Number(fluent, _) => Some(fluent.function),
        _ => None,
    }));
    let mut read: FxHashMap<FunctionId, Span> = FxHashMap::default();
    let mut note = |fluent: &Fluent| {
        read.entry(fluent.function).or_insert(fluent.span);
    };
    all(task, &mut |part| match part {
        Part::Change(Change::Number(Assignment::Assign, fluent, _)) => {
            assigned.insert(fluent.function);
        }
        Part::Change(Change::Number(_, fluent, _)) | Part::Expression(Expression::Fluent(fluent)) => {
            note(fluent);
        }
        _ => {}
    });
    given.extend(&assigned);
    // An effect module may write any of them.
    if !task.modules.is_empty() {
        return Vec::new();
    }
    let has_objects =
        |id: FunctionId| task.function(id).parameters.iter().all(|parameter| !parameter.objects.is_empty());
    let never =
        |id: &FunctionId| !given.contains(id) && task.function(*id).result.is_none() && has_objects(*id);
    let mut findings: Vec<Diagnostic> = (0..task.functions.len() as u32)
        .map(FunctionId)
        .filter(never)
        .filter_map(|id| {
            let function = task.function(id);
            let message = format!("function `{}` never has a value", function.name);
            let label = "no value in `:init`, and no action assigns one";
            let finding = Diagnostic::warning("no-value", message, function.span, label);
            let finding = finding.with_label(*read.get(&id)?, "it is read here: that never works out");
            Some(finding.with_help(format!("state `(= ({} …) 0)` in `:init`", function.name)))
        })
        .collect();
    let known: FxHashSet<&GroundFluent> = task.init.numbers.iter().map(|(fluent, _)| fluent).collect();
    let mut told: FxHashSet<GroundFluent> = FxHashSet::default();
    walk::aims(task, &mut |part| {
        let Part::Expression(Expression::Fluent(fluent)) = part else { return };
        let Some(ground) = ground(fluent).filter(|own| !known.contains(own)) else { return };
        if given.contains(&fluent.function) && !assigned.contains(&fluent.function) && told.insert(ground) {
            let name = &task.function(fluent.function).name;
            let message = format!("this `{name}` never has a value");
            let label = "no value in `:init`, and no action assigns one";
            let finding = Diagnostic::warning("no-value", message, fluent.span, label);
            findings.push(finding.with_help("state its value in `:init`"));
        }
    });
    findings
}

fn ground(fluent: &Fluent) -> Option<GroundFluent> {
    let object = |term: &Term| match term {
        Term::Object(object) => Some(*object),
        _ => None,
    };
    let arguments: Option<Vec<_>> = fluent.arguments.iter().map(object).collect();
    Some(GroundFluent { function: fluent.function, arguments: arguments?.into() })
}
