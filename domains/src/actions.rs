//! Actions of a domain as carried out by the body: skills with arguments, limits, checks, lessons
//! from failures.

use std::sync::Arc;

use descry_planner::{Attachment, CallError, Read, Step, Task};
use descry_robots::Answer;
use descry_skills::{Call, Outcome, Skill, SkillFailure};
use serde_json::{Value, json};

use crate::abilities;
use crate::ability::{Deed, Meaning, SkillWord};
use crate::config::{ActionConfig, ActionKind, Config};
use crate::load::Domain;
use crate::situation::Situation;

/// Completed call of an action, with its step in the plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Carried {
    /// Action with its arguments.
    pub call: Call,
    /// Step of the plan; its times count from the start of the first step carried out together.
    pub step: Step,
}

/// Skill with its arguments.
pub(crate) struct Grounded {
    /// Skill of an ability.
    pub word: &'static SkillWord,
    arguments: Vec<String>,
}

impl Grounded {
    /// Object names given as arguments, in the skill's order.
    pub fn arguments(&self) -> Vec<&str> {
        self.arguments.iter().map(String::as_str).collect()
    }

    /// Reason for the skill in this situation, as a clause.
    pub fn because(&self, situation: &Situation) -> String {
        (self.word.because)(situation, &self.arguments())
    }

    /// The skill ready to run, grounded in the situation.
    pub fn skill(&self, situation: &Situation) -> Result<Box<dyn Skill>, SkillFailure> {
        (self.word.ground)(situation, &self.arguments())
            .map_err(|because| SkillFailure::Meaningless { because })
    }
}

/// Configuration of an action; by default, the skill with the action's name.
pub(crate) fn config(domain: &Domain, call: &Call) -> ActionConfig {
    domain.config.action.get(&call.action).cloned().unwrap_or_default()
}

/// Time limit of each part of a call, seconds.
pub(crate) fn limit_s(domain: &Domain, call: &Call) -> f64 {
    config(domain, call).limit_s()
}

/// Condition that must hold after a call, as PDDL; `None` without a check.
pub(crate) fn check(domain: &Domain, call: &Call) -> Option<String> {
    config(domain, call).check.map(|text| substitute(domain, call, &text, None))
}

/// Reason for a call as given by the domain, if any.
pub(crate) fn because(domain: &Domain, call: &Call) -> Option<String> {
    config(domain, call).because.map(|text| substitute(domain, call, &text, None))
}

/// Skill of part `step` of a call, from 0; `None` past the last part.
pub(crate) fn grounded(domain: &Domain, call: &Call, step: usize) -> Option<Grounded> {
    let config = config(domain, call);
    let texts = config.does.texts();
    if texts.is_empty() {
        let word = abilities::skill(&domain.config.uses, &call.action).filter(|_| step == 0)?;
        return Some(Grounded { word, arguments: call.arguments.clone() });
    }
    let text = substitute(domain, call, texts.get(step)?, None);
    let mut tokens = text.split_whitespace().map(str::to_string);
    let word = abilities::skill(&domain.config.uses, &tokens.next()?)?;
    Some(Grounded { word, arguments: tokens.collect() })
}

/// Effect of an action on the world: as declared for its program, else the strongest of its skills.
/// Unless known otherwise, an action is changing.
pub fn kind(config: &Config, action: &str) -> ActionKind {
    stated_kind(config, action).unwrap_or(ActionKind::Changing)
}

/// Effect of an action on the world; `None` for an action of a program whose kind is not declared.
pub(crate) fn stated_kind(config: &Config, action: &str) -> Option<ActionKind> {
    let own = config.action.get(action);
    if let Some(own) = own.filter(|own| own.program.is_some()) {
        return own.kind;
    }
    let texts = own.map(|own| own.does.texts()).filter(|texts| !texts.is_empty());
    let skills = texts.unwrap_or_else(|| vec![action]);
    let kind = |text: &str| {
        let skill = text.split_whitespace().next().and_then(|name| abilities::skill(&config.uses, name));
        skill.map_or(ActionKind::Changing, |skill| skill.kind)
    };
    skills.into_iter().map(kind).max()
}

/// Action of the domain that carries out a deed, with the arguments that the deed determines.
#[derive(Debug, Clone, PartialEq)]
pub struct Performer {
    /// Name of the action.
    pub action: String,
    /// Arguments of the action; `None` where the deed leaves them open.
    pub arguments: Vec<Option<String>>,
}

/// Actions that carry out a deed; those that do nothing else first. A changing action does not
/// stand in for a deed that changes nothing.
pub fn performers(domain: &Domain, deed: &Deed) -> Vec<Performer> {
    let own =
        abilities::skill(&domain.config.uses, deed.skill).map_or(ActionKind::Changing, |skill| skill.kind);
    let mut found: Vec<(usize, Performer)> = Vec::new();
    for action in &domain.vocabulary.task.actions {
        if kind(&domain.config, &action.name) > own.max(ActionKind::Moving) {
            continue;
        }
        let parameters: Vec<String> = action.parameters.iter().map(|p| p.name.clone()).collect();
        let texts = texts(&domain.config, &action.name, &parameters);
        let performer = texts.iter().find_map(|text| unified(text, deed, &parameters));
        found.extend(
            performer.map(|arguments| (texts.len(), Performer { action: action.name.clone(), arguments })),
        );
    }
    found.sort_by_key(|(steps, _)| *steps > 1);
    found.into_iter().map(|(_, performer)| performer).collect()
}

/// True if an action of the domain uses a skill.
pub(crate) fn does(domain: &Domain, skill: &str) -> bool {
    doer(domain, skill).is_some()
}

/// First action of the domain that uses a skill.
pub(crate) fn doer<'a>(domain: &'a Domain, skill: &str) -> Option<&'a descry_planner::task::Action> {
    let is_it = |text: &String| text.split_whitespace().next() == Some(skill);
    let mut actions = domain.vocabulary.task.actions.iter();
    actions.find(|action| texts(&domain.config, &action.name, &[]).iter().any(is_it))
}

/// Skill texts of an action; empty for an action of a program.
fn texts(config: &Config, action: &str, parameters: &[String]) -> Vec<String> {
    let own = config.action.get(action);
    if own.is_some_and(|own| own.program.is_some()) {
        return Vec::new();
    }
    let texts = own.map(|own| own.does.texts()).unwrap_or_default();
    match texts.is_empty() {
        true => vec![format!("{action} {}", parameters.join(" "))],
        false => texts.into_iter().map(str::to_string).collect(),
    }
}

/// Argument values from unifying a deed with one of an action's skills; `None` if they do not
/// unify.
fn unified(text: &str, deed: &Deed, parameters: &[String]) -> Option<Vec<Option<String>>> {
    let mut tokens = text.split_whitespace();
    if tokens.next() != Some(deed.skill) {
        return None;
    }
    let tokens: Vec<String> = tokens.map(str::to_lowercase).collect();
    let mut arguments = vec![None; parameters.len()];
    for (token, value) in tokens.iter().zip(&deed.arguments) {
        match parameters.iter().position(|name| name == token) {
            Some(at) if arguments[at].as_ref().is_none_or(|known| known == value) => {
                arguments[at] = Some(value.clone());
            }
            None if token == value => {}
            _ => return None,
        }
    }
    (tokens.len() == deed.arguments.len()).then_some(arguments)
}

/// Removes the actions that change the world from a task, as a question may not use them.
pub(crate) fn only_looking(config: &Config, task: &mut Task) {
    task.actions.retain(|action| kind(config, &action.name) < ActionKind::Changing);
}

/// Main skill of a call: the one with the action's name, else the first one.
pub(crate) fn foremost(domain: &Domain, call: &Call) -> Option<Grounded> {
    let parts = || (0..).map_while(|step| grounded(domain, call, step));
    parts().find(|part| part.word.name == call.action).or_else(|| parts().next())
}

/// Texts with the action's variables replaced by the call's objects.
pub(crate) fn substituted(domain: &Domain, call: &Call, texts: &[String]) -> Vec<String> {
    texts.iter().map(|text| substitute(domain, call, text, None)).collect()
}

/// Atoms of PDDL that the domain's lessons teach for a failure of a call; `by` is the blocking object.
pub(crate) fn taught(
    domain: &Domain,
    call: &Call,
    config: &ActionConfig,
    failure: &SkillFailure,
    by: Option<&str>,
) -> Vec<String> {
    let fits =
        |t: &&crate::config::Teaching| t.when == failure.kind() && (by.is_some() || !t.says.contains("?by"));
    config.teaches.iter().filter(fits).map(|t| substitute(domain, call, &t.says, by)).collect()
}

/// Text with an action's variables replaced by a call's objects; `?by` is the blocking object.
fn substitute(domain: &Domain, call: &Call, text: &str, by: Option<&str>) -> String {
    let parameters = domain.vocabulary.action(&call.action).unwrap_or_default();
    let value = |variable: &str| {
        let at = parameters.iter().position(|(name, _)| name == variable);
        at.and_then(|n| call.arguments.get(n)).map(String::as_str).or(by.filter(|_| variable == "?by"))
    };
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('?') {
        let end = rest[at + 1..].find(|c: char| !(c.is_alphanumeric() || c == '-' || c == '_'));
        let end = end.map_or(rest.len(), |e| at + 1 + e);
        let variable = rest[at..end].to_lowercase();
        out += &rest[..at];
        out += value(&variable).unwrap_or(&variable);
        rest = &rest[end..];
    }
    out + rest
}

/// Outcome of a skill as recorded JSON.
pub(crate) fn outcome(outcome: &Outcome) -> Value {
    match outcome {
        Outcome::Driven(d) => json!({ "distance_m": d.distance_m, "duration_s": d.duration_s }),
        Outcome::Seen(s) => json!({ "stamp_ns": s.stamp_ns }),
        Outcome::Answered(answer) => answered(answer),
        Outcome::Aligned(a) => json!({
            "boundary_before_m2": a.before.boundary_m2,
            "boundary_after_m2": a.after.boundary_m2,
            "longest_m": a.longest_m(),
            "left_out": a.left_out,
            "opened": a.opened,
        }),
        Outcome::Modelled(m) => json!({
            "fits": m.keyframes.iter().map(|k| json!({ "used": k.used, "why": k.why })).collect::<Vec<_>>(),
            "points": m.model.as_ref().map_or(0, |model| model.cloud.len()),
            "looks": m.model.as_ref().map(|model| model.looks.clone()).unwrap_or_default(),
            "because": m.model.as_ref().err(),
        }),
        Outcome::Grasped(g, hand) => {
            json!({ "width_m": g.width_m, "duration_s": g.duration_s, "holds": hand.holds })
        }
        Outcome::Told(word) => json!({ "said": word }),
    }
}

/// Answer of the body as recorded JSON; of a sweep its timestamp alone, since the record has the sweep
/// itself.
fn answered(answer: &Answer) -> Value {
    match answer {
        Answer::Scanned(scanned) => json!({ "stamp_ns": scanned.stamp_ns }),
        answer => match json!(answer) {
            Value::Object(answer) => answer.into_iter().next().map_or(Value::Null, |(_, said)| said),
            said => said,
        },
    }
}

/// Attachment that answers a call of an ability in a situation.
pub(crate) struct Bound {
    pub situation: Arc<Situation>,
    pub meaning: &'static Meaning,
    /// Facts that the answer depends on, as declared to the planner.
    pub reads: Vec<Read>,
}

impl Attachment for Bound {
    fn reads(&self) -> Vec<Read> {
        self.reads.clone()
    }

    fn evaluate(&self, call: &descry_planner::Call) -> Result<descry_planner::Answer, CallError> {
        (self.meaning.answers)(&self.situation, call)
    }
}
