//! `domain.toml`: what may be said, what counts as sure, how actions are carried out, where words come from.

use std::collections::BTreeMap;

use descry_planner::{Diagnostic, Findings, Source as Text, Span};
use serde::Deserialize;

use crate::load::error::LoadError;

/// `domain.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The domain's name.
    pub name: String,
    /// What the domain is for, in a line.
    pub about: String,
    /// The abilities that it uses, by name.
    #[serde(default = "searching_alone")]
    pub uses: Vec<String>,
    /// Surfaces that goals may name although no map tells of them. Those of the map are known without being named here.
    #[serde(default)]
    pub surfaces: Vec<String>,
    /// The scene of the simulated robot when none is named.
    #[serde(default)]
    pub scene: String,
    /// What may be said.
    #[serde(default)]
    pub goal: Vec<GoalPhrase>,
    /// What counts as sure.
    #[serde(default)]
    pub thresholds: Thresholds,
    /// Where to look from.
    #[serde(default)]
    pub candidates: Candidates,
    /// What is expected where before anything has been seen.
    #[serde(default)]
    pub expect: Vec<Expectation>,
    /// What plans are to make small: an expression of PDDL over the time that they take, `(total-time)`, and the domain's numbers.
    #[serde(default = "total_time")]
    pub minimise: String,
    /// Limits of a run.
    #[serde(default)]
    pub limits: Limits,
    /// How each action is carried out; one without an entry is carried out by the skill of its name.
    #[serde(default)]
    pub action: BTreeMap<String, ActionConfig>,
    /// Where words come from that no ability states.
    #[serde(default)]
    pub word: BTreeMap<String, WordConfig>,
    /// How people are told of an action, a word or a call, by its name; `?from` in it stands for the name of that parameter's object.
    /// Actions read like `looking at the ?on`, words like `the ?way is shut`. What has no line is shown as PDDL.
    #[serde(default)]
    pub said: BTreeMap<String, String>,
    /// Objects of the domain's own types, by type.
    #[serde(default)]
    pub objects: BTreeMap<String, Vec<String>>,
    /// Types whose objects a person may name as he likes: a slot of such a type holds any words that are no other name.
    #[serde(default)]
    pub open: Vec<String>,
    /// What holds in the beginning of words that are remembered or fixed: PDDL atoms and values.
    #[serde(default)]
    pub init: Vec<String>,
    /// Attachments that are programs.
    #[serde(default)]
    pub attachments: BTreeMap<String, Program>,
}

fn searching_alone() -> Vec<String> {
    vec!["searching".into()]
}

fn total_time() -> String {
    "(total-time)".into()
}

/// A phrase and its meaning.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalPhrase {
    /// Words and `<slots>`. A slot is called after the type that fills it; where two slots are of one type, `<first:thing>`.
    pub say: String,
    /// Other words for the same, with the same slots.
    #[serde(default)]
    pub also: Vec<String>,
    /// The goal condition in PDDL, with the same slots.
    pub means: String,
    /// Whether the answer is yes or no. The robot moves and looks to find out; no action changes anything for it.
    #[serde(default)]
    pub question: bool,
    /// The confidence that is asked for where the goal says none; none: that of the thresholds.
    #[serde(default)]
    pub confidence: Option<f64>,
    /// What the agent will do, in a line.
    #[serde(default)]
    pub about: String,
    /// What is answered.
    #[serde(default)]
    pub answer: Answers,
}

impl GoalPhrase {
    /// Every wording, the usual one first.
    pub fn ways(&self) -> impl Iterator<Item = &str> {
        std::iter::once(&self.say).chain(&self.also).map(String::as_str)
    }
}

/// What a phrase answers, by how the run ended. `<slots>` stand for what was said, `{(on <thing> ?)}` for the names of the
/// objects in the place of the question mark for which the atom holds, `{(confidence <thing>)}` for a number.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answers {
    /// The goal holds.
    pub achieved: Option<String>,
    /// It is sure that what was asked for is not there.
    pub not_found: Option<String>,
    /// It cannot be told.
    pub cannot_tell: Option<String>,
}

/// How much of something is expected somewhere.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// An object or a kind; none: anything.
    #[serde(default)]
    pub what: Option<String>,
    /// A surface or a room.
    pub at: String,
    /// How much more often it is there than on any other surface, however large they are.
    pub weight: f64,
}

/// How an action is carried out.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActionConfig {
    /// A skill with the action's variables, `"move ?from ?to"`, or several, one after the other.
    #[serde(default)]
    pub does: Steps,
    /// A program that carries it out, instead of a skill.
    pub program: Option<Vec<String>>,
    /// Effect of that program on the world: `sensing`, `moving` or `changing`; none: changing. A question is answered without changing.
    pub kind: Option<ActionKind>,
    /// Time for each of its skills on the body's clock, or for the program, seconds; 60 if left out.
    pub limit_s: Option<f64>,
    /// Number of tries again after a failure that may pass; 2 if left out.
    pub retries: Option<usize>,
    /// What becomes true when it is given up: atoms of remembered words over its variables.
    #[serde(default)]
    pub gives_up: Vec<String>,
    /// What a failure teaches.
    #[serde(default)]
    pub teaches: Vec<Teaching>,
    /// What must hold afterwards, in PDDL over its variables; else it has failed.
    pub check: Option<String>,
    /// Why it is done, for people, over its variables.
    pub because: Option<String>,
}

/// Effect of an action on the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ActionKind {
    /// It looks, reads or reckons: the world stays as it is.
    Sensing,
    /// The body moves and leaves everything else in its place.
    Moving,
    /// Something else moves, opens or becomes otherwise.
    Changing,
}

/// One step or several.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(untagged, expecting = "a skill with the action's variables, or a list of them")]
pub enum Steps {
    /// Nothing is said.
    #[default]
    Unsaid,
    /// One.
    One(String),
    /// One after the other.
    Several(Vec<String>),
}

impl Steps {
    /// Each as its text.
    pub fn texts(&self) -> Vec<&str> {
        match self {
            Steps::Unsaid => Vec::new(),
            Steps::One(step) => vec![step],
            Steps::Several(steps) => steps.iter().map(String::as_str).collect(),
        }
    }
}

/// What a failure teaches.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Teaching {
    /// The kind of failure: `blocked`, `slipped`, `unreachable`, ….
    pub when: String,
    /// The atom that becomes true, over the action's variables and `?by`, what was in the way.
    pub says: String,
}

impl ActionConfig {
    /// The words that its failures teach.
    pub fn taught(&self) -> impl Iterator<Item = String> + '_ {
        let atoms = self.gives_up.iter().chain(self.teaches.iter().map(|t| &t.says));
        atoms.filter_map(|atom| {
            let tokens = atom.split(|c: char| c.is_whitespace() || "()".contains(c));
            tokens.filter(|t| !t.is_empty() && *t != "not").map(str::to_lowercase).next()
        })
    }

    /// Seconds for each skill where none are named.
    pub const LIMIT_S: f64 = 60.0;
    /// Tries after the first where none are named.
    pub const RETRIES: usize = 2;

    /// Time for each of its skills, or for the program, seconds.
    pub fn limit_s(&self) -> f64 {
        self.limit_s.unwrap_or(Self::LIMIT_S)
    }

    /// Tries after the first.
    pub fn retries(&self) -> usize {
        self.retries.unwrap_or(Self::RETRIES)
    }
}

/// Where a word comes from that no ability states.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WordConfig {
    /// A program that states it: the word is sensed.
    pub program: Option<Vec<String>>,
    /// Time for its answer, seconds.
    #[serde(default = "default_program_time_s")]
    pub time_limit_s: f64,
    /// Another word of the same arguments: where that one holds, the program has yet to find out, and its silence denies
    /// nothing.
    pub untold: Option<String>,
    /// `remembered`, `fixed` or `planned`, where it should be said rather than follow from the effects of the actions.
    pub is: Option<Source>,
}

/// Where a word that no fact states has its value from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// It changes as the effects of carried-out actions say.
    Remembered,
    /// It never changes.
    Fixed,
    /// It changes within a plan alone: every round begins as `init` says, else without it.
    Planned,
}

/// What counts as sure; all are probabilities.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Thresholds {
    /// Ends a search.
    pub confidence: f64,
    /// No look is worth it where no more than this could be settled.
    pub remaining: f64,
    /// No more than this may hang on places that can be seen from nowhere, for an object to be called not there; and no more than this
    /// and `remaining` together on all places.
    pub out_of_sight: f64,
    /// An object is called not there where the probability that it is there after all, hidden or as one of the objects that were seen, is
    /// no more than this.
    pub not_there: f64,
    /// That a sought object is there, before the first look; more than `remaining` and `not_there`, else nobody would look.
    pub prior: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { confidence: 0.8, remaining: 0.04, out_of_sight: 0.01, not_there: 0.05, prior: 0.75 }
    }
}

/// A ring of poses around each surface.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Candidates {
    /// How many poses the ring holds.
    pub poses: usize,
    /// From the centre of the surface to the robot.
    pub distance_m: f64,
}

impl Default for Candidates {
    fn default() -> Self {
        Self { poses: 8, distance_m: 1.4 }
    }
}

/// Limits of a run, so that none is without end.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Looks in a run.
    pub views: usize,
    /// Pushes in a run.
    pub pushes: usize,
    /// Plans in a run.
    pub plans: usize,
    /// How often the very same situation may come back.
    pub repeats: usize,
    /// States that the search for a plan evaluates; then the best plan so far, or one good look, is taken.
    pub states: u64,
    /// Time for a run on the body's clock.
    pub seconds: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { views: 40, pushes: 6, plans: 300, repeats: 3, states: 2500, seconds: 7200.0 }
    }
}

/// An attachment that is a program which answers JSON lines.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// The command and its arguments, run in the domain's folder.
    pub program: Vec<String>,
    /// Time for one answer.
    #[serde(default = "default_program_time_s")]
    pub time_limit_s: f64,
    /// Predicates and functions whose values the program wants with every call.
    #[serde(default)]
    pub reads: Vec<String>,
}

fn default_program_time_s() -> f64 {
    5.0
}

/// With less a yes would be no likelier than a no.
const SURE: &str = "a number above 0.5 and below 1";

/// With more left, "not there" would be no likelier than its contrary.
const LEFT: &str = "a number above 0 and below 0.5";

/// With less, no look were worth it, and all were "not there" unseen.
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
