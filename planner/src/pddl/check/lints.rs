//! Warnings about a faultless task, above all about goals that nothing can achieve.

use rustc_hash::FxHashSet;

use super::{Checker, usage};
use crate::diagnostic::{Diagnostic, Span};
use crate::model::defeat::self_defeating;
use crate::task::{
    Action, Atom, Change, Condition, Effect, Fact, GroundChange, Modal, ObjectId, Parameter, Task, Term,
    Trajectory, Written,
};

impl Checker<'_> {
    pub(super) fn lints(&mut self) {
        let goal = std::mem::replace(&mut self.task.goal.body, Condition::TRUE);
        let mut wanted = Vec::new();
        certain_atoms(&goal, &mut wanted);
        let mut findings: Vec<Diagnostic> = Vec::new();
        let initially: FxHashSet<&Fact> = self.task.init.facts.iter().collect();
        for atom in wanted {
            let fact = Fact { predicate: atom.predicate, arguments: objects(atom).into() };
            if !initially.contains(&fact) {
                findings.extend(unreachable_goal(&self.task, atom, &fact.arguments));
            }
        }
        self.findings.append(&mut findings);
        self.task.goal.body = goal;
        let mut unused = usage::unused(&self.task);
        unused.extend(usage::without_value(&self.task));
        unused.extend(self.task.constraints.iter().filter_map(not_planned));
        self.findings.append(&mut unused);
    }
}

/// Warning about a constraint of a kind that no search supports; `None` for other kinds.
fn not_planned(constraint: &Trajectory) -> Option<Diagnostic> {
    let name = match constraint.operator {
        Modal::AlwaysWithin => "always-within",
        Modal::HoldDuring => "hold-during",
        Modal::HoldAfter => "hold-after",
        _ => return None,
    };
    let message = format!("`{name}` is checked in plans, but plans that keep it are not searched for");
    let finding = Diagnostic::warning("not-planned", message, constraint.span, "this constraint");
    Some(finding.with_help("ask for the same in conditions and the goal"))
}

/// Warnings about durative actions whose start deletes one of their own invariants.
pub(crate) fn defeated(task: &Task) -> Vec<Diagnostic> {
    let finding = |action: &Action| {
        let (atom, effect) = self_defeating(action)?;
        let name = &task.predicate(atom.predicate).name;
        let message = format!(
            "`{}` can never be taken: its start takes away `{name}`, which it needs over all",
            action.name
        );
        let finding = Diagnostic::warning("self-defeating", message, effect, "taken away at the start");
        let finding = finding.with_label(atom.span, "needed from right after the start on");
        let help = "ask for it `at start`, if it is only needed then, or let the action keep it";
        Some(finding.with_help(help))
    };
    task.actions.iter().filter_map(finding).collect()
}

/// Appends the ground atoms that must hold for the condition to hold.
fn certain_atoms<'c>(condition: &'c Condition, into: &mut Vec<&'c Atom>) {
    match condition {
        Condition::And(parts) => parts.iter().for_each(|part| certain_atoms(part, into)),
        Condition::Atom(atom) if atom.arguments.iter().all(|term| matches!(term, Term::Object(_))) => {
            into.push(atom)
        }
        _ => {}
    }
}

fn objects(atom: &Atom) -> Vec<ObjectId> {
    let object = |term: &Term| match term {
        Term::Object(id) => Some(*id),
        _ => None,
    };
    atom.arguments.iter().filter_map(object).collect()
}

/// Error about a goal atom that is initially false and that no effect can make true; `None`
/// otherwise.
fn unreachable_goal(task: &Task, goal: &Atom, wanted: &[ObjectId]) -> Option<Diagnostic> {
    let predicate = task.predicate(goal.predicate);
    if predicate.stratum.is_some() {
        return None;
    }
    let timed =
        |change: &GroundChange| matches!(change, GroundChange::Add(fact) if fact.predicate == goal.predicate);
    if task.init.timed.iter().any(|timed_one| timed(&timed_one.change)) {
        return None;
    }
    let writes =
        |written: &Written| matches!(written, Written::Truth(atom) if atom.predicate == goal.predicate);
    if task.modules.iter().any(|module| module.writes.iter().any(writes)) {
        return None;
    }
    let achievers: Vec<(Span, Vec<Achiever<'_>>)> = task
        .actions
        .iter()
        .flat_map(|action| {
            let effects = action.effects.start.iter().chain(&action.effects.end);
            effects.map(move |effect| (action, effect))
        })
        .filter_map(|(action, effect)| match &effect.change {
            Change::Add(atom) if atom.predicate == goal.predicate => {
                Some((effect.span, arguments(task, atom, &action.parameters, effect)))
            }
            _ => None,
        })
        .collect();
    let fits = |all: &[Achiever<'_>]| all.iter().zip(wanted).all(|(one, object)| one.can_be(*object));
    if achievers.iter().any(|(_, all)| fits(all)) {
        return None;
    }
    let text = fact_text(task, goal);
    let finding = Diagnostic::error(
        "unreachable-goal",
        format!("nobody achieves the goal `{text}`"),
        goal.span,
        "false at first, and nothing makes it true",
    );
    Some(match achievers.first() {
        None => nothing_adds(task, goal, finding),
        Some((span, all)) => {
            let (position, object) = all
                .iter()
                .zip(wanted)
                .enumerate()
                .find(|(_, (one, object))| !one.can_be(**object))
                .map(|(position, (_, object))| (position, *object))?;
            let name = &task.object(object).name;
            let is: Vec<&str> =
                task.object(object).types.iter().map(|&id| task.type_of(id).name.as_str()).collect();
            let wants = all[position].text(task);
            finding
                .with_label(*span, format!("this makes `{}` true of {wants} only", predicate.name))
                .with_help(format!("`{name}` is a `{}`: no effect can add this fact", is.join(" or ")))
        }
    })
}

fn nothing_adds(task: &Task, goal: &Atom, finding: Diagnostic) -> Diagnostic {
    let predicate = task.predicate(goal.predicate);
    let deleted = task.actions.iter().find_map(|action| {
        let mut effects = action.effects.start.iter().chain(&action.effects.end);
        effects.find_map(|effect| match &effect.change {
            Change::Delete(atom) if atom.predicate == goal.predicate => {
                Some((effect.span, action.name.clone()))
            }
            _ => None,
        })
    });
    let finding = match deleted {
        Some((span, name)) => finding.with_label(span, format!("`{name}` only ever makes it false")),
        None => finding.with_label(predicate.span, "no action has this predicate in its effect"),
    };
    finding.with_help(format!(
        "give an action the effect `({}{})`, or state the fact in `(:init …)`",
        predicate.name,
        predicate.parameters.iter().map(|own| format!(" {}", own.name)).collect::<String>()
    ))
}

/// Objects that an argument of an effect may stand for.
enum Achiever<'t> {
    Constant(ObjectId),
    Of(&'t Parameter),
    Anything,
}

impl Achiever<'_> {
    fn can_be(&self, object: ObjectId) -> bool {
        match self {
            Achiever::Constant(own) => *own == object,
            Achiever::Of(parameter) => parameter.objects.binary_search(&object).is_ok(),
            Achiever::Anything => true,
        }
    }

    fn text(&self, task: &Task) -> String {
        match self {
            Achiever::Constant(own) => format!("`{}`", task.object(*own).name),
            Achiever::Of(parameter) => {
                let types: Vec<&str> =
                    parameter.types.iter().map(|&id| task.type_of(id).name.as_str()).collect();
                format!("a `{}`", types.join(" or "))
            }
            Achiever::Anything => "anything".to_string(),
        }
    }
}

fn arguments<'t>(
    task: &'t Task,
    atom: &Atom,
    parameters: &'t [Parameter],
    effect: &'t Effect,
) -> Vec<Achiever<'t>> {
    let of = |term: &Term| match term {
        Term::Object(id) => Achiever::Constant(*id),
        Term::Variable(slot) => match parameters.get(slot.index()) {
            Some(parameter) => Achiever::Of(parameter),
            None => match effect.forall.iter().find(|one| one.slot == *slot) {
                Some(one) => Achiever::Of(&one.parameter),
                None => Achiever::Anything,
            },
        },
        Term::Function(_) => Achiever::Anything,
    };
    debug_assert_eq!(atom.arguments.len(), task.predicate(atom.predicate).parameters.len());
    atom.arguments.iter().map(of).collect()
}

fn fact_text(task: &Task, atom: &Atom) -> String {
    let names: String = objects(atom).iter().map(|&id| format!(" {}", task.object(id).name)).collect();
    format!("({}{names})", task.predicate(atom.predicate).name)
}
