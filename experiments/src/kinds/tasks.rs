//! Tasks in a place with several surfaces: any goals of a domain, by several policies, with and without
//! faults. Answers and actions are compared with the true final state.

use std::path::Path;

use descry_agent::body;
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::goal;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::Domain;
use descry_domains::objective::Goal;
use descry_domains::slots::type_of_slot;
use descry_domains::symbol::symbol;
use descry_robots::sim::{Fault, FaultPlan, SceneSpec};
use serde::Deserialize;
use serde_json::json;

use super::trial::{self, Trial};
use crate::error::ExperimentError;
use crate::job::{Job, Numbered, Outcome};
use crate::kinds::kind::{Head, Kind, OtherBody, Summary, inputs_of, parse, refuse};
use crate::source::Source;

mod score;
mod summary;

use score::Truly;

/// Keys of an experiment file of the kind `tasks`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    /// The experiment's name.
    name: String,
    /// `tasks`.
    kind: String,
    /// Purpose of the experiment, in a line.
    #[serde(default)]
    about: String,
    /// Built-in domain or a domain's folder.
    domain: String,
    /// Scene of the domain, or a file.
    scene: String,
    /// Number of runs of each goal, policy and case, each in an arrangement of its own.
    runs: usize,
    /// Seed of the first arrangement; each further one has the next.
    #[serde(default = "default_seed")]
    first_seed: u64,
    /// Policies that choose where to look next, from the list above.
    policies: Vec<String>,
    /// Maximum distance along the floor between the stated and the true position of a found object,
    /// metres.
    #[serde(default = "default_tolerance_m")]
    position_tolerance_m: f64,
    /// Goals; each is pursued with each policy and case.
    #[serde(rename = "goal")]
    goals: Vec<GoalText>,
    /// Cases, each with its injected faults; a single case without any if left out.
    #[serde(default = "nothing_goes_wrong", rename = "case")]
    cases: Vec<Case>,
}

/// A goal, and the condition under which it is truly achieved.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct GoalText {
    /// The goal in the words of the domain.
    say: String,
    /// The objects that the goal is about, by name or kind in the scene.
    targets: Vec<String>,
    /// Condition under which the goal is truly achieved.
    truly: Truly,
    /// The surface that the goal is about, by its name in the scene.
    #[serde(default)]
    surface: Option<String>,
    /// The room that the goal is about, by its name in the scene.
    #[serde(default)]
    room: Option<String>,
    /// Share of the runs without the targets.
    #[serde(default)]
    absent_share: f64,
    /// Actions whose share of runs with a completed execution is reported.
    #[serde(default)]
    stages: Vec<String>,
}

/// A combination of injected faults, or another body.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    /// Name of the case in tables and plots.
    name: String,
    /// Body instead of the simulator: `program:COMMAND`, whose world has the places and objects of the scene.
    #[serde(default)]
    robot: Option<OtherBody>,
    /// Injected faults; empty for a run without any.
    #[serde(default, rename = "fault")]
    faults: Vec<Fault>,
}

fn default_seed() -> u64 {
    1
}

fn default_tolerance_m() -> f64 {
    0.05
}

fn nothing_goes_wrong() -> Vec<Case> {
    vec![Case { name: "none".into(), robot: None, faults: Vec::new() }]
}

/// Experiment on tasks, as read from its file.
struct Tasks {
    head: Head,
    text: Text,
    domain: Domain,
    spec: SceneSpec,
    /// The parsed goals, in the order of the file.
    goals: Vec<Goal>,
}

/// Setting of a job: one combination of the variables.
struct Setting<'a> {
    goal: usize,
    case: &'a Case,
    policy: &'a str,
    run: usize,
}

pub(super) fn read(source: &Source) -> Result<Box<dyn Kind>, ExperimentError> {
    let text: Text = parse(source)?;
    check(source, &text)?;
    let domain = Domain::load(&text.domain)
        .map_err(|e| refuse(source, "domain", e.to_string(), "name another domain"))?;
    let spec = body::scene_spec(Some(&text.scene), &domain)
        .map_err(|e| refuse(source, "scene", e.to_string(), "name another scene"))?;
    let lexicon = Lexicon::new(&domain, &Places::of_spec(&spec));
    let goals = text.goals.iter().map(|g| {
        check_goal(source, g, &spec)?;
        let goal = goal::read(&g.say, &domain, &lexicon)
            .map_err(|e| refuse(source, "goal", e.to_string(), "see descry goals"))?;
        check_words(source, g, &goal, &domain, &spec)?;
        Ok(goal)
    });
    let goals = goals.collect::<Result<_, _>>()?;
    let head = Head { name: text.name.clone(), kind: text.kind.clone(), about: text.about.clone() };
    Ok(Box::new(Tasks { head, text, domain, spec, goals }))
}

/// Checks the meaning of values that the format allows.
fn check(source: &Source, text: &Text) -> Result<(), ExperimentError> {
    let known = policies::names();
    if let Some(absent) = text.policies.iter().find(|p| !known.contains(&p.as_str())) {
        let problem = format!("no policy is called \"{absent}\"");
        return Err(refuse(source, "policies", problem, format!("one of: {}", known.join(", "))));
    }
    let wrong = |holds: bool, key, problem: &str, mend: &str| match holds {
        true => Ok(()),
        false => Err(refuse(source, key, problem, mend)),
    };
    wrong(!text.policies.is_empty(), "policies", "there is no policy", "name one, such as \"plan\"")?;
    wrong((1..=1_000_000).contains(&text.runs), "runs", "so many runs make no experiment", "1 to 1000000")?;
    let tolerance_m = text.position_tolerance_m;
    wrong(tolerance_m > 0.0, "position_tolerance_m", "nothing is ever so near", "metres, such as 0.05")?;
    wrong(!text.goals.is_empty(), "goal", "there is no goal", "add a [[goal]]")?;
    wrong(!text.cases.is_empty(), "case", "there is no case", "add a [[case]], or leave them out")?;
    for case in &text.cases {
        let plan = FaultPlan { faults: case.faults.clone() };
        plan.check()
            .map_err(|o| refuse(source, "case", format!("case \"{}\": {}", case.name, o.problem), o.mend))?;
        let ours = case.robot.is_none() || case.faults.is_empty();
        wrong(ours, "case", "mishaps befall our simulator only", "leave robot or fault out")?;
        let foresee = text.policies.iter().find(|p| policies::named(p, 1, None).is_err());
        if let (Some(_), Some(policy)) = (&case.robot, foresee) {
            let problem = format!("\"{policy}\" asks our simulator what a look would show");
            return Err(refuse(source, "policies", problem, "leave it out, or every case with a robot"));
        }
    }
    Ok(())
}

/// Checks that a goal names parts of the scene, and everything needed to judge it.
fn check_goal(source: &Source, goal: &GoalText, spec: &SceneSpec) -> Result<(), ExperimentError> {
    let refused = |problem: String, mend: String| {
        Err(refuse(source, "goal", format!("goal \"{}\": {problem}", goal.say), mend))
    };
    if goal.targets.is_empty() {
        return refused(
            "it has no targets".into(),
            "name what it is about, such as targets = [\"cup A\"]".into(),
        );
    }
    let is_there =
        |t: &&String| spec.objects.iter().any(|o| o.name == **t || o.kind.as_deref() == Some(t.as_str()));
    if let Some(absent) = goal.targets.iter().find(|t| !is_there(t)) {
        let names: Vec<&str> = spec.objects.iter().map(|o| o.name.as_str()).collect();
        return refused(
            format!("nothing in the scene is called \"{absent}\""),
            format!("one of: {}", names.join(", ")),
        );
    }
    let known = |name: &Option<String>, of: Vec<&str>, what: &str| match name {
        Some(name) if !of.contains(&name.as_str()) => {
            refused(format!("the scene has no {what} \"{name}\""), format!("one of: {}", of.join(", ")))
        }
        _ => Ok(()),
    };
    known(&goal.surface, spec.surfaces.iter().map(|s| s.name.as_str()).collect(), "surface")?;
    known(&goal.room, spec.rooms.iter().map(|r| r.name.as_str()).collect(), "room")?;
    if goal.truly.needs_surface() && goal.surface.is_none() {
        return refused("it is not said on which surface".into(), "add surface = \"…\"".into());
    }
    match (0.0..1.0).contains(&goal.absent_share) {
        true => Ok(()),
        false => refused("absent_share is no share".into(), "from 0 to below 1, such as 0.25".into()),
    }
}

/// Checks that the words of a goal are about the objects and surfaces that its truth is judged by.
fn check_words(
    source: &Source,
    text: &GoalText,
    goal: &Goal,
    domain: &Domain,
    spec: &SceneSpec,
) -> Result<(), ExperimentError> {
    let refused = |problem: String, mend: &str| {
        Err(refuse(source, "goal", format!("goal \"{}\": {problem}", text.say), mend))
    };
    match (goal.question, text.truly == Truly::Answered) {
        (true, false) => return refused("it is a question".into(), "truly = \"answered\""),
        (false, true) => {
            return refused("it is no question".into(), "ask it as one, or leave \"answered\" to those");
        }
        _ => {}
    }
    let said = |of: &'static str| goal.slots.iter().filter(move |slot| type_of_slot(&slot.slot) == of);
    for (of, held) in [("surface", &text.surface), ("room", &text.room)] {
        let is_held = |name: &String| said(of).any(|slot| slot.symbol == symbol(name));
        if let Some(slot) = said(of).next().filter(|_| !held.as_ref().is_some_and(is_held)) {
            return refused(
                format!("it is about the {of} \"{}\"", slot.name),
                &format!("{of} = \"{}\"", slot.name),
            );
        }
    }
    let names: Vec<String> = text.targets.iter().flat_map(|target| names(target, domain, spec)).collect();
    let mut things = said("thing").chain(said("kind")).peekable();
    match things.peek().map(|slot| slot.name.clone()) {
        Some(thing) if !things.any(|slot| names.contains(&slot.symbol)) => {
            refused(format!("it is about \"{thing}\", which none of its targets is"), "name that in targets")
        }
        _ => Ok(()),
    }
}

/// The symbols by which a goal may name a target: its name, its identity, and its kind.
fn names(target: &str, domain: &Domain, spec: &SceneSpec) -> Vec<String> {
    let there = spec.objects.iter().filter(|o| o.name == target || o.kind.as_deref() == Some(target));
    let called = there.flat_map(|o| [Some(&o.name), o.kind.as_ref()]).flatten();
    let mut all: Vec<String> = called.map(|name| symbol(name)).collect();
    let kinds = domain.objects.iter().filter(|model| all.contains(&symbol(&model.name)));
    let kinds: Vec<String> = kinds.map(|model| symbol(&model.kind)).collect();
    all.extend(kinds);
    all
}

impl Tasks {
    /// The setting of a job. Runs are outermost, so that the first of many shards covers everything, and
    /// neighbours share an arrangement.
    fn setting(&self, number: usize) -> Setting<'_> {
        let Text { goals, cases, policies, .. } = &self.text;
        let (rest, policy) = (number / policies.len(), number % policies.len());
        let (rest, case) = (rest / cases.len(), rest % cases.len());
        let (run, goal) = (rest / goals.len(), rest % goals.len());
        Setting { goal, case: &cases[case], policy: &policies[policy], run }
    }

    fn seed(&self, run: usize) -> u64 {
        self.text.first_seed.wrapping_add(run as u64)
    }
}

impl Kind for Tasks {
    fn head(&self) -> &Head {
        &self.head
    }

    fn inputs(&self) -> Vec<(String, String)> {
        let bodies = self.text.cases.iter().filter_map(|case| case.robot.as_ref());
        inputs_of(&self.domain, format!("{:?}", self.spec), bodies)
    }

    fn jobs(&self) -> Vec<Job> {
        let Text { goals, cases, policies, runs, .. } = &self.text;
        let job = |number| {
            let Setting { goal, case, policy, run } = self.setting(number);
            Job::new([
                ("run", json!(run)),
                ("goal", json!(goals[goal].say)),
                ("case", json!(case.name)),
                ("policy", json!(policy)),
            ])
            .with_seed(self.seed(run))
        };
        (0..runs * goals.len() * cases.len() * policies.len()).map(job).collect()
    }

    fn run(&self, number: usize, scratch: &Path, stop: &Stop) -> Result<Outcome, String> {
        let Setting { goal, case, policy, run } = self.setting(number);
        let said = &self.text.goals[goal];
        let (n, share) = (run as f64, said.absent_share);
        let present = ((n + 1.0) * share).floor() <= (n * share).floor();
        let trial = Trial {
            domain: &self.domain,
            goal: &self.goals[goal],
            spec: &self.spec,
            program: case.robot.as_ref().map(OtherBody::command),
            targets: &said.targets,
            present,
            seed: self.seed(run),
            faults: FaultPlan { faults: case.faults.clone() },
            policy,
            first_look_here: false,
            tolerance_m: self.text.position_tolerance_m,
        };
        let lived = trial::live(&trial, scratch, stop)?;
        let row = score::row(said, trial.tolerance_m, present, &lived);
        Ok(Outcome { rows: vec![row], clock: lived.clock })
    }

    fn summarise(&self, finished: &[Numbered<'_>]) -> Summary {
        summary::summarise(self, finished)
    }
}
