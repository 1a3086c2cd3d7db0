//! Explanations of unsolvable tasks.

mod core;
mod relaxed;
mod sites;
mod within;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::attachment::{Attachments, CallKind};
use crate::diagnostic::{Diagnostic, Findings, Span};
use crate::ground::{GroundTask, MissingAtom, Obstacle};
use crate::model::walk::{self, Part};
use crate::pddl::{defeated, without_value};
use crate::semantics::{Binding, Semantics};
use crate::task::{
    Action, Atom, Change, Condition, Expression, FunctionId, GroundChange, ModuleId, PredicateId, Task, Term,
};

pub(crate) use self::core::{is_open, narrowed};
use self::relaxed::could_be_had;
pub(crate) use self::sites::sites;
pub(crate) use self::within::too_slow;

/// Explanation of why a task has no plan: findings that point at the goal, at atoms that nothing achieves,
/// and at attachments that refused.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// The reasons, the goal's first.
    pub findings: Findings,
    /// Actions that could start while they run, which might help, and which no search tries to the end: where there are any, the proof
    /// holds for plans in which no action overlaps itself. The last finding says so.
    pub overlapping: BTreeSet<String>,
    /// True if the goal is surely reachable when nothing is ever deleted.
    #[serde(skip)]
    pub(crate) only_lost: bool,
    /// Attachments that did not answer as needed, in the order of their findings.
    #[serde(skip)]
    refused: Vec<NoPlan>,
}

/// A reason why there is no plan, as a value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum NoPlan {
    /// An attachment did not answer as needed.
    Refused {
        /// Name of the attachment.
        module: String,
        /// The answer of the attachment.
        answer: Refusal,
        /// Its calls, in PDDL.
        calls: Vec<String>,
    },
    /// Every state that can be reached was seen, and none fulfils the goal.
    Exhausted,
    /// Anything else, in one sentence.
    Finding {
        /// The sentence.
        message: String,
        /// Advice on how to mend it.
        help: Option<String>,
    },
}

/// An answer of an attachment that leaves no plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refusal {
    /// No, where yes is needed.
    No,
    /// Yes, where no is needed.
    Yes,
    /// An infinite cost.
    Impossible,
}

impl Explanation {
    fn new(task: &Task, list: Vec<Diagnostic>) -> Explanation {
        let findings = Findings { sources: task.sources.to_vec(), list };
        Explanation { findings, ..Explanation::default() }
    }

    /// The reasons as values, in the order of the findings.
    pub fn reasons(&self) -> Vec<NoPlan> {
        let mut refused = self.refused.iter();
        let reason = |finding: &Diagnostic| {
            let plain = || NoPlan::Finding { message: finding.message.clone(), help: finding.help.clone() };
            match finding.code {
                REFUSED => refused.next().cloned().unwrap_or_else(plain),
                _ if finding.message == UNREACHED => NoPlan::Exhausted,
                _ => plain(),
            }
        };
        self.findings.list.iter().map(reason).collect()
    }

    /// The same for plans in which these actions do not overlap themselves.
    pub(crate) fn but_for(mut self, task: &Task, overlapping: &BTreeSet<String>) -> Explanation {
        let mut actions = task.actions.iter().filter(|action| overlapping.contains(&action.name));
        if let Some(first) = actions.next() {
            let message =
                "the proof holds for plans in which no action overlaps itself: others were not all looked at";
            let label = |action: &Action| format!("`{}` could start again while it runs", action.name);
            let mut finding = Diagnostic::warning(OVERLAP, message, first.span, label(first));
            for action in actions.take(SHOWN) {
                finding = finding.with_label(action.span, label(action));
            }
            let help = "if it cannot, let its start need and take what its end gives back";
            self.findings.list.push(finding.with_help(help));
        }
        self.overlapping.clone_from(overlapping);
        self
    }
}

/// Code of findings about attachments that did not answer as needed.
const REFUSED: &str = "attachment-refused";
/// Code of findings about actions that could overlap themselves.
const OVERLAP: &str = "overlap-untried";

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

/// Calls that were not answered as needed, by module and whether yes was needed (of a cost: a finite one).
pub(crate) type Refusals = BTreeMap<(u32, bool), Vec<String>>;

/// The maximum number of refused calls shown for one module.
const SHOWN: usize = 8;

/// The reasons why a task has no plan: what stands in the goal itself, what grounding found out, who said no; and where
/// each part of the goal could be had by itself, what that leaves.
pub(crate) fn explain(task: &Task, ground: &GroundTask, refusals: &Refusals) -> Explanation {
    let reach = Reach::new(task);
    let mut list = Vec::new();
    let mut told = Vec::new();
    let mut parts = Vec::new();
    conjuncts(&task.goal.body, &mut parts);
    let nobody = Attachments::new();
    let semantics = Semantics::new(task, &nobody);
    let start = semantics.initial().ok();
    let mut binding = Binding::new(task.goal.slots);
    let mut holds_at_first = |part: &Condition| {
        start.as_ref().is_some_and(|state| semantics.holds(state, part, &mut binding).unwrap_or(false))
    };
    for &part in &parts {
        if !holds_at_first(part) {
            list.extend(goal_part(task, &reach, part, &mut told));
        }
    }
    let untold = |obstacle: &&Obstacle| !told.iter().any(|predicate| predicate.0 == obstacle.predicate);
    list.extend(
        ground
            .obstacles
            .iter()
            .filter(untold)
            .map(|obstacle| finding(task, obstacle, &ground.obstacles, &parts)),
    );
    let mut told_refused = Vec::new();
    for (&(module, wanted), calls) in refusals {
        if let Some((finding, reason)) = refused(task, ModuleId(module), wanted, calls) {
            list.push(finding);
            told_refused.push(reason);
        }
    }
    let only_lost = list.is_empty() && could_be_had(ground);
    if list.is_empty() {
        list.extend(defeated(task).into_iter().chain(without_value(task)));
    }
    if list.is_empty() {
        list.push(together(task, &parts, false, only_lost));
    }
    Explanation { only_lost, refused: told_refused, ..Explanation::new(task, list) }
}

/// Message where no relaxation gives a better reason.
const UNREACHED: &str = "every state that can be reached was seen, and none fulfils the whole goal";

/// No way to the goal keeps the constraints. `reachable` where there is a way that breaks them.
pub(crate) fn constrained(task: &Task, reachable: bool) -> Explanation {
    let hard = task.constraints.iter().filter(|constraint| constraint.preference.is_none());
    let mut spans = hard.map(|constraint| constraint.span);
    let message = match reachable {
        true => "the goal can be reached, but on no way to it are all constraints kept",
        false => {
            "every state that can be reached was seen, and none fulfils the goal with all constraints kept"
        }
    };
    let span = spans.next().unwrap_or_default();
    let mut finding = Diagnostic::error("unsolvable", message, span, "this constraint on the way");
    for span in spans.take(SHOWN) {
        finding = finding.with_label(span, "this too");
    }
    let finding = finding.with_help("make it a `(preference …)` to see how much of it can be kept");
    Explanation::new(task, vec![finding])
}

/// Finding about parts of the goal that cannot be had together. `narrowed`: these parts alone cannot be had;
/// `only_lost`: they could be had if nothing were ever deleted.
fn together(task: &Task, parts: &[&Condition], narrowed: bool, only_lost: bool) -> Diagnostic {
    let message = match (narrowed, parts.len()) {
        (false, _) => UNREACHED.to_string(),
        (true, 1) => {
            "every state that can be reached was seen, and none fulfils this part of the goal".into()
        }
        (true, count) => {
            format!(
                "every state that can be reached was seen, and none fulfils these {count} parts of the goal"
            )
        }
    };
    let mut spans = parts.iter().filter_map(|part| first_span(part));
    let Some(span) = spans.next() else {
        // A goal of nothing, as that any of no things holds: nobody can bring that about.
        return Diagnostic::error("unsolvable", message, task.goal_span, "this goal");
    };
    let label = if parts.len() > 1 { "this and the others exclude each other" } else { "this goal" };
    let mut finding = Diagnostic::error("unsolvable", message, span, label);
    for span in spans.take(SHOWN) {
        finding = finding.with_label(span, "this too");
    }
    let mut reasons = vec![match parts.len() {
        0 | 1 => "some of what it needs excludes the rest",
        _ => "some parts of the goal exclude each other",
    }];
    let ends = |change: &GroundChange| matches!(change, GroundChange::Delete(_));
    for timed in task.init.timed.iter().filter(|timed| ends(&timed.change)).take(SHOWN) {
        finding = finding.with_label(timed.span, format!("only until {} s", timed.time_s));
    }
    if !task.init.timed.is_empty() {
        reasons.push("what is given only until some time ends too early");
    }
    for (action, span, end) in task.actions.iter().filter_map(given_while_running).take(SHOWN) {
        let name = &task.predicate(end).name;
        finding = finding.with_label(span, format!("`{}` gives `{name}` only while it runs", action.name));
        if !reasons.contains(&LASTS) {
            reasons.push(LASTS);
        }
    }
    let first = match only_lost {
        true => "with nothing ever taken away and all the time in the world it could be had: ",
        false => "perhaps ",
    };
    if !only_lost && (task.is_temporal() || !task.functions.is_empty()) {
        reasons.insert(0, "what it takes of numbers or of durations never comes out right");
    }
    finding.with_help(format!("{first}{}", reasons.join(", or ")))
}

const LASTS: &str = "what an action gives only while it runs does not last long enough";

/// A predicate that an action makes true at its start and false at its end.
fn given_while_running(action: &Action) -> Option<(&Action, Span, PredicateId)> {
    action.effects.start.iter().find_map(|effect| {
        let Change::Add(atom) = &effect.change else { return None };
        let ends = |end: &crate::task::Effect| matches!(&end.change, Change::Delete(gone) if gone.predicate == atom.predicate && gone.arguments == atom.arguments);
        action.effects.end.iter().any(ends).then_some((action, atom.span, atom.predicate))
    })
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

fn goal_part(
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
                let finding = Diagnostic::error("unsolvable", message, *span, "asked for here");
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
                Diagnostic::error("unsolvable", message, *span, "false at the beginning, and for ever")
                    .with_help("give some action an effect on it, or correct its value in `:init`"),
            )
        }
        _ => None,
    }
}

/// A goal atom out of reach: who could add it, and what those lack, down to what nobody adds at all.
fn nobody(task: &Task, reach: &Reach, goal: &Atom, told: &mut Vec<PredicateId>) -> Diagnostic {
    let message = format!("the goal {} can never be reached", atom_text(task, goal));
    let finding = Diagnostic::error("unsolvable", message, goal.span, "asked for here");
    trace(task, reach, finding, goal.predicate, told)
}

/// Follows what stands in the way of a predicate, down to what nobody adds at all.
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

/// Finding about the calls of one module that were refused, pointing at its calls in the domain.
fn refused(task: &Task, module: ModuleId, wanted: bool, calls: &[String]) -> Option<(Diagnostic, NoPlan)> {
    let mut sites = sites(task, module).into_iter();
    let (who, span) = sites.next()?;
    let more = calls.len().saturating_sub(SHOWN);
    let mut shown = calls.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    if more > 0 {
        shown.push_str(&format!(" and {more} more"));
    }
    let declared = task.module(module);
    let answer = match declared.kind {
        CallKind::Cost => Refusal::Impossible,
        _ if wanted => Refusal::No,
        _ => Refusal::Yes,
    };
    let said = match answer {
        Refusal::Impossible => "called impossible (an infinite cost)",
        Refusal::No => "said no to",
        Refusal::Yes => "said yes, where no is needed, to",
    };
    let message = format!("the attachment of `{}` {said}: {shown}", declared.name);
    let mut finding = Diagnostic::error(REFUSED, message, span, format!("{who} depends on it here"));
    for (who, span) in sites {
        finding = finding.with_label(span, format!("{who} depends on it here"));
    }
    let help = "with any of these answered otherwise there might be a plan";
    let reason = NoPlan::Refused { module: declared.name.clone(), answer, calls: calls.to_vec() };
    Some((finding.with_help(help), reason))
}

/// The functions that an expression reads.
fn fluents(expression: &Expression, functions: &mut Vec<FunctionId>) {
    walk::expression(expression, &mut |part| {
        if let Part::Expression(Expression::Fluent(fluent)) = part {
            functions.push(fluent.function);
        }
    });
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

/// Span at which a condition asks for an atom.
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

/// Span at which an action asks for the first of some atoms.
fn needed(action: &Action, missing: &[MissingAtom]) -> Option<Span> {
    let condition = &action.condition;
    let asks = |(predicate, arguments): &MissingAtom| {
        [&condition.start, &condition.over_all, &condition.end]
            .into_iter()
            .find_map(|part| asked(part, (*predicate, arguments)))
    };
    missing.iter().find_map(asks)
}

fn finding(task: &Task, obstacle: &Obstacle, chain: &[Obstacle], goal: &[&Condition]) -> Diagnostic {
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
