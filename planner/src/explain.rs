//! Explanations of unsolvable tasks.

mod core;
mod durations;
mod links;
mod obstacles;
mod relaxed;
mod sites;
mod within;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::attachment::{Attachments, CallKind};
use crate::diagnostic::{Diagnostic, Findings, Span};
use crate::ground::{GroundTask, Obstacle};
use crate::pddl::{defeated, without_value};
use crate::semantics::{Binding, Semantics};
use crate::task::{Action, Change, Condition, GroundChange, ModuleId, PredicateId, Task};

pub(crate) use self::core::narrowed;
use self::durations::without_duration;
use self::links::{Reach, goal_part};
use self::obstacles::obstacle_finding;
use self::relaxed::could_be_had;
pub(crate) use self::sites::sites;
pub(crate) use self::within::too_slow;

/// Explanation why a task has no plan: findings that point at the goal, at atoms that nothing
/// achieves, and at attachments that refused.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// Findings, with those about the goal first.
    pub findings: Findings,
    /// Names of actions for which plans that overlap two runs of one instance were not tried
    /// exhaustively. If there are any, the proof covers only plans without such overlaps, and the
    /// last finding says so.
    pub overlapping: BTreeSet<String>,
    /// True if the goal is reachable under delete relaxation.
    #[serde(skip)]
    pub(crate) only_lost: bool,
    /// True if exhaustion is the only reason: all reachable states were seen, and none fulfils the
    /// whole goal.
    #[serde(skip)]
    pub(crate) exhausted: bool,
    /// Refusals by attachments as values, in the order of their findings.
    #[serde(skip)]
    refused: Vec<NoPlan>,
}

/// Reason why no plan exists, as a value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum NoPlan {
    /// An attachment gave an answer that rules the plan out.
    Refused {
        /// PDDL name of the module.
        module: String,
        /// Answer that ruled the plan out.
        answer: Refusal,
        /// Refused calls, in PDDL.
        calls: Vec<String>,
    },
    /// All reachable states were seen, and none fulfils the goal.
    Exhausted,
    /// Other reason, in one sentence.
    Finding {
        /// Reason, in one sentence.
        message: String,
        /// Suggested remedy.
        help: Option<String>,
    },
}

/// Answer by which an attachment ruled a plan out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refusal {
    /// A condition module answered false where true is needed.
    No,
    /// A condition module answered true where false is needed.
    Yes,
    /// A cost module answered an infinite cost.
    Impossible,
}

impl Explanation {
    fn new(task: &Task, list: Vec<Diagnostic>) -> Explanation {
        let findings = Findings { sources: task.sources.to_vec(), list };
        Explanation { findings, ..Explanation::default() }
    }

    /// Reasons as values, one for each finding.
    pub fn reasons(&self) -> Vec<NoPlan> {
        let mut refused = self.refused.iter();
        let reason = |finding: &Diagnostic| {
            let plain = || NoPlan::Finding { message: finding.message.clone(), help: finding.help.clone() };
            match finding.code {
                REFUSED => refused.next().cloned().unwrap_or_else(plain),
                UNSOLVABLE if self.exhausted => NoPlan::Exhausted,
                _ => plain(),
            }
        };
        self.findings.list.iter().map(reason).collect()
    }

    /// Limits the explanation to plans in which the actions named in `overlapping` do not overlap
    /// themselves, and adds a finding that says so.
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

/// Code of findings that the goal, or a part of it, is unreachable.
const UNSOLVABLE: &str = "unsolvable";
/// Code of findings about refusing attachments.
const REFUSED: &str = "attachment-refused";
/// Code of the finding that overlaps of an action with itself were not all tried.
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

/// Refused calls as text, by module index and the answer needed (for a cost module: true, for
/// finite).
pub(crate) type Refusals = BTreeMap<(u32, bool), Vec<String>>;

/// Maximum number of calls, actions or spans that one finding lists.
const SHOWN: usize = 8;

/// Explains why a task has no plan: contradictions in the goal, obstacles found by grounding,
/// refusals by attachments, and a minimal unsolvable subset of the goal.
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
            .map(|obstacle| obstacle_finding(task, obstacle, &ground.obstacles, &parts)),
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
        list.extend(
            defeated(task).into_iter().chain(without_value(task)).chain(without_duration(task, ground)),
        );
    }
    let exhausted = list.is_empty();
    if exhausted {
        list.push(together(task, &parts, false, only_lost));
    }
    Explanation { only_lost, exhausted, refused: told_refused, ..Explanation::new(task, list) }
}

/// Message where no more specific reason is known: the goal as a whole is unreachable.
const UNREACHED: &str = "every state that can be reached was seen, and none fulfils the whole goal";

/// Explanation that no plan keeps all constraints. `reachable`: the goal is reachable without them.
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
    let mut finding = Diagnostic::error(UNSOLVABLE, message, span, "this constraint on the way");
    for span in spans.take(SHOWN) {
        finding = finding.with_label(span, "this too");
    }
    let finding = finding.with_help("make it a `(preference …)` to see how much of it can be kept");
    Explanation::new(task, vec![finding])
}

/// Finding that the given goal parts cannot be reached together. `narrowed`: `parts` is a minimal
/// such subset; `only_lost`: the goal is reachable under delete relaxation.
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
        return Diagnostic::error(UNSOLVABLE, message, task.goal_span, "this goal");
    };
    let label = if parts.len() > 1 { "this and the others exclude each other" } else { "this goal" };
    let mut finding = Diagnostic::error(UNSOLVABLE, message, span, label);
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

/// First atom that an action adds at its start and deletes at its end: the action, the atom's span
/// and its predicate.
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

/// Finding about the refused calls of one module, pointing at its calls in the domain, with the
/// reason as a value; `None` if the task never calls the module.
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
