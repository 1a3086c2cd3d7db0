//! `domain.toml`: phrases for goals, thresholds, how actions are carried out, and sources of predicates
//! and functions.

use std::collections::BTreeMap;

use descry_planner::{Diagnostic, Findings, Source as Text, Span};
use serde::Deserialize;

use crate::load::error::LoadError;

/// Contents of `domain.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The domain's name.
    pub name: String,
    /// Purpose of the domain, in a line.
    pub about: String,
    /// Names of the abilities that the domain uses.
    #[serde(default = "searching_alone")]
    pub uses: Vec<String>,
    /// Surfaces that goals may name although no map has them; surfaces of the map need not be named
    /// here.
    #[serde(default)]
    pub surfaces: Vec<String>,
    /// Default scene of the simulated robot.
    #[serde(default)]
    pub scene: String,
    /// Phrases that may be said, each with a goal as its meaning.
    #[serde(default)]
    pub goal: Vec<GoalPhrase>,
    /// Probabilities that count as sure.
    #[serde(default)]
    pub thresholds: Thresholds,
    /// Viewpoints around each surface.
    #[serde(default)]
    pub candidates: Candidates,
    /// Expected places of objects before anything has been seen.
    #[serde(default)]
    pub expect: Vec<Expectation>,
    /// Cost of a plan, to be minimised: a PDDL expression over the plan's duration in seconds,
    /// `(total-time)`, and the domain's functions.
    #[serde(default = "total_time")]
    pub minimise: String,
    /// Limits of a run.
    #[serde(default)]
    pub limits: Limits,
    /// Execution of each action; an action without an entry is carried out by the skill with its
    /// name.
    #[serde(default)]
    pub action: BTreeMap<String, ActionConfig>,
    /// Sources of predicates and functions that no ability states.
    #[serde(default)]
    pub word: BTreeMap<String, WordConfig>,
    /// Text for people about an action, predicate, function or call, by its name; `?from` in it stands
    /// for the name of that parameter's object. Actions read like `looking at the ?on`, predicates like
    /// `the ?way is shut`. A name without a text is shown as PDDL.
    #[serde(default)]
    pub said: BTreeMap<String, String>,
    /// Objects of the domain's own types, by type.
    #[serde(default)]
    pub objects: BTreeMap<String, Vec<String>>,
    /// Types whose objects may be named freely: a slot of such a type holds any words that are no other
    /// name.
    #[serde(default)]
    pub open: Vec<String>,
    /// Initial values of remembered or fixed predicates and functions, as PDDL atoms.
    #[serde(default)]
    pub init: Vec<String>,
    /// Programs that answer calls, by name of the call.
    #[serde(default)]
    pub attachments: BTreeMap<String, Program>,
}

fn searching_alone() -> Vec<String> {
    vec!["searching".into()]
}

fn total_time() -> String {
    "(total-time)".into()
}

/// Phrase for a goal, and its meaning.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalPhrase {
    /// Words and `<slots>`. A slot has the name of the type that fills it; two slots of one type are
    /// told apart as in `<first:thing>`.
    pub say: String,
    /// Other wordings with the same meaning and the same slots.
    #[serde(default)]
    pub also: Vec<String>,
    /// Goal condition in PDDL, with the same slots.
    pub means: String,
    /// True if the answer is yes or no. The robot moves and looks to find out; no action changes the
    /// world for a question.
    #[serde(default)]
    pub question: bool,
    /// Confidence required where the given goal states none; if left out, that of the thresholds.
    #[serde(default)]
    pub confidence: Option<f64>,
    /// Description of what the agent will do, in a line.
    #[serde(default)]
    pub about: String,
    /// Answers of the phrase, by how the run ended.
    #[serde(default)]
    pub answer: Answers,
}

impl GoalPhrase {
    /// All wordings, the usual one first.
    pub fn ways(&self) -> impl Iterator<Item = &str> {
        std::iter::once(&self.say).chain(&self.also).map(String::as_str)
    }
}

/// Answers of a phrase, by how the run ended. `<slots>` stand for what was said, `{(on <thing> ?)}` for
/// the names of the objects in the place of the question mark for which the atom holds, `{(confidence
/// <thing>)}` for a number.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answers {
    /// Answer if the goal holds.
    pub achieved: Option<String>,
    /// Answer if what was asked for is certainly not there.
    pub not_found: Option<String>,
    /// Answer if the goal cannot be decided.
    pub cannot_tell: Option<String>,
}

/// Prior expectation of an object at a place.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// Name of an object or a kind; if left out, anything.
    #[serde(default)]
    pub what: Option<String>,
    /// Name of a surface or a room.
    pub at: String,
    /// Factor by which the object is there more often than on any other surface, whatever the sizes of
    /// the surfaces.
    pub weight: f64,
}

/// Execution of an action.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActionConfig {
    /// Skill with the action's variables, `"move ?from ?to"`, or several skills, carried out one after
    /// the other.
    #[serde(default)]
    pub does: Steps,
    /// Program that carries the action out, instead of a skill.
    pub program: Option<Vec<String>>,
    /// Effect of that program on the world: `sensing`, `moving` or `changing`; if left out, `changing`,
    /// and what it sets and a program states is unknown. A question uses no changing action.
    pub kind: Option<ActionKind>,
    /// Time limit of each skill on the body's clock, or of the program, seconds; 60 if left out.
    pub limit_s: Option<f64>,
    /// Number of tries again after a failure that may pass; 2 if left out.
    pub retries: Option<usize>,
    /// Facts that become true when the action is given up: atoms of remembered predicates over its
    /// variables.
    #[serde(default)]
    pub gives_up: Vec<String>,
    /// Facts learned from failures of the action.
    #[serde(default)]
    pub teaches: Vec<Teaching>,
    /// PDDL condition over the action's variables that must hold afterwards; otherwise the action has
    /// failed.
    pub check: Option<String>,
    /// Reason for the action, for people, over its variables.
    pub because: Option<String>,
}

/// Effect of an action on the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ActionKind {
    /// The action looks, reads or computes: the world stays as it is.
    Sensing,
    /// The body moves and leaves everything else in its place.
    Moving,
    /// Something other than the body moves, opens or changes.
    Changing,
}

/// Skills of an action: none named, one or several.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(untagged, expecting = "a skill with the action's variables, or a list of them")]
pub enum Steps {
    /// No skill is named.
    #[default]
    Unsaid,
    /// Single skill, with the action's variables as arguments.
    One(String),
    /// Several skills, carried out one after the other.
    Several(Vec<String>),
}

impl Steps {
    /// Texts of the skills, in order.
    pub fn texts(&self) -> Vec<&str> {
        match self {
            Steps::Unsaid => Vec::new(),
            Steps::One(step) => vec![step],
            Steps::Several(steps) => steps.iter().map(String::as_str).collect(),
        }
    }
}

/// Fact learned from a failure of an action.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Teaching {
    /// Kind of failure: `blocked`, `slipped`, `unreachable`, ….
    pub when: String,
    /// Atom that becomes true, over the action's variables and `?by`, the blocking object.
    pub says: String,
}

impl ActionConfig {
    /// Predicates that failures of the action set.
    pub fn taught(&self) -> impl Iterator<Item = String> + '_ {
        let atoms = self.gives_up.iter().chain(self.teaches.iter().map(|t| &t.says));
        atoms.filter_map(|atom| {
            let tokens = atom.split(|c: char| c.is_whitespace() || "()".contains(c));
            tokens.filter(|t| !t.is_empty() && *t != "not").map(str::to_lowercase).next()
        })
    }

    /// Default time limit of each skill, seconds.
    pub const LIMIT_S: f64 = 60.0;
    /// Default number of retries.
    pub const RETRIES: usize = 2;

    /// Time limit of each skill, or of the program, seconds.
    pub fn limit_s(&self) -> f64 {
        self.limit_s.unwrap_or(Self::LIMIT_S)
    }

    /// Number of retries after the first try.
    pub fn retries(&self) -> usize {
        self.retries.unwrap_or(Self::RETRIES)
    }
}

/// Source of a predicate or function that no ability states.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WordConfig {
    /// Program that states the values: they are sensed.
    pub program: Option<Vec<String>>,
    /// Time limit of the program's answer, seconds.
    #[serde(default = "default_program_time_s")]
    pub time_limit_s: f64,
    /// Predicate of the same arguments that holds while the program has yet to find out; meanwhile, the
    /// program's silence denies nothing.
    pub untold: Option<String>,
    /// `remembered`, `fixed` or `planned`, to override what follows from the effects of the actions.
    pub is: Option<Source>,
}

/// Source of the values of a predicate or function that neither an ability nor a program states.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// Values change with the effects of carried-out actions.
    Remembered,
    /// Values never change.
    Fixed,
    /// Values change within a plan alone: every round begins with those of `init`, else without any.
    Planned,
}

/// Probabilities by which something counts as sure.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Thresholds {
    /// Confidence that ends a search.
    pub confidence: f64,
    /// Least probability that views must be able to settle to be worthwhile.
    pub remaining: f64,
    /// Greatest probability left at places visible from nowhere for an object to count as not there;
    /// with `remaining` added, the greatest at all places together.
    pub out_of_sight: f64,
    /// Greatest probability that an object is there after all, hidden or as one of the seen objects, for
    /// the object to count as not there.
    pub not_there: f64,
    /// Probability that a sought object is there, before the first view; more than `remaining` and
    /// `not_there`, else nobody would look.
    pub prior: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { confidence: 0.8, remaining: 0.04, out_of_sight: 0.01, not_there: 0.05, prior: 0.75 }
    }
}

/// Ring of poses around each surface.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Candidates {
    /// Number of poses in the ring.
    pub poses: usize,
    /// Distance of the robot from the centre of the surface, metres.
    pub distance_m: f64,
}

impl Default for Candidates {
    fn default() -> Self {
        Self { poses: 8, distance_m: 1.4 }
    }
}

/// Limits of a run, so that every run ends.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Maximum number of views in a run.
    pub views: usize,
    /// Maximum number of pushes in a run.
    pub pushes: usize,
    /// Maximum number of plans in a run.
    pub plans: usize,
    /// Maximum number of times that the very same situation may come back.
    pub repeats: usize,
    /// Maximum number of states evaluated in the search for a plan; then the best plan so far is taken,
    /// or one good view.
    pub states: u64,
    /// Maximum duration of a run on the body's clock, seconds.
    pub seconds: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { views: 40, pushes: 6, plans: 300, repeats: 3, states: 2500, seconds: 7200.0 }
    }
}

/// Program that answers a call by JSON lines.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// Command and its arguments, run in the domain's folder.
    pub program: Vec<String>,
    /// Time limit of one answer, seconds.
    #[serde(default = "default_program_time_s")]
    pub time_limit_s: f64,
    /// Predicates and functions whose values are sent to the program with every call.
    #[serde(default)]
    pub reads: Vec<String>,
}

fn default_program_time_s() -> f64 {
    5.0
}

/// Valid confidence: with less, a yes would be no likelier than a no.
const SURE: &str = "a number above 0.5 and below 1";

/// Valid remaining probability: with more, "not there" would be no likelier than its contrary.
const LEFT: &str = "a number above 0 and below 0.5";

/// Valid prior: with less, no view would be worthwhile, and everything unseen would count as "not
/// there".
const WORTH_A_LOOK: &str = "a number above `remaining` and `not_there`, and below 1";

/// Checks the numbers of a configuration.
pub(crate) fn check(source: &Text, config: &Config) -> Result<(), LoadError> {
    let value = |key: &str, value: f64, holds: bool, expected: &'static str| {
        let path: Vec<&str> = key.split('.').collect();
        let error = || {
            let place = crate::toml_place::TomlPlaces::of(&source.text).at(&path);
            let message = format!("{key} is {value}");
            let told = Diagnostic::error("value", message, Span { source: 0, ..place }, "here");
            let list = vec![told.with_help(format!("expected: {expected}"))];
            LoadError::Findings { findings: Findings { sources: vec![source.clone()], list } }
        };
        if holds { Ok(()) } else { Err(error()) }
    };
    for (n, phrase) in config.goal.iter().enumerate() {
        let p = phrase.confidence.unwrap_or(0.5);
        let is_usual = phrase.confidence.is_none();
        value(&format!("goal.{n}.confidence"), p, is_usual || p > 0.5 && p < 1.0, SURE)?;
    }
    let t = &config.thresholds;
    value("thresholds.confidence", t.confidence, t.confidence > 0.5 && t.confidence < 1.0, SURE)?;
    for (key, p) in [
        ("thresholds.remaining", t.remaining),
        ("thresholds.out_of_sight", t.out_of_sight),
        ("thresholds.not_there", t.not_there),
    ] {
        value(key, p, p > 0.0 && p < 0.5, LEFT)?;
    }
    let left = t.remaining.max(t.not_there);
    value("thresholds.prior", t.prior, t.prior > left && t.prior < 1.0, WORTH_A_LOOK)?;
    let c = &config.candidates;
    value("candidates.poses", c.poses as f64, (1..=1000).contains(&c.poses), "1 to 1000 poses")?;
    let fits = c.distance_m > 0.0 && c.distance_m < 20.0;
    value("candidates.distance_m", c.distance_m, fits, "metres, above 0 and below 20")?;
    let l = &config.limits;
    value("limits.views", l.views as f64, l.views > 0, "at least one look")?;
    value("limits.plans", l.plans as f64, l.plans > 0, "at least one plan")?;
    value("limits.repeats", l.repeats as f64, l.repeats > 0, "at least one")?;
    value("limits.states", l.states as f64, l.states > 0, "at least one")?;
    value("limits.seconds", l.seconds, l.seconds > 0.0, "seconds, above 0")?;
    for (name, action) in &config.action {
        let (key, limit_s) = (format!("action.{name}.limit_s"), action.limit_s());
        value(&key, limit_s, limit_s > 0.0 && limit_s.is_finite(), "seconds, above 0")?;
    }
    let programs = config.attachments.iter().map(|(name, p)| (format!("attachments.{name}"), p.time_limit_s));
    let facts = config.word.iter().map(|(name, w)| (format!("word.{name}"), w.time_limit_s));
    for (of, limit_s) in programs.chain(facts) {
        let key = format!("{of}.time_limit_s");
        value(&key, limit_s, limit_s > 0.0 && limit_s.is_finite(), "seconds, above 0")?;
    }
    for (n, expectation) in config.expect.iter().enumerate() {
        let (key, w) = (format!("expect.{n}.weight"), expectation.weight);
        value(&key, w, w > 0.0 && w.is_finite(), "a number above 0")?;
    }
    Ok(())
}
