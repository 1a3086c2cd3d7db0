//! One run of the agent in a simulated world, built-in or a program's, compared with the truth.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use descry_agent::body::{Body, program};
use descry_agent::keeping::{Keeping, Kept};
use descry_agent::report::{Event, Report};
use descry_agent::run::{self, Folder, Settings, Task, Watcher};
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies::{self, Foresight};
use descry_domains::conclusion::Verdict;
use descry_domains::goal;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::Domain;
use descry_domains::objective::Goal;
use descry_robots::Place;
use descry_robots::sim::{FaultPlan, SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::truth::{TrueObject, Truth};
use serde_json::{Value, json};

use crate::job::{Outcome, Row};
use crate::kinds::kind::runtime;

/// Maximum number of seeds tried for an arrangement with the requested occlusion.
const ARRANGEMENTS: u64 = 20;
/// Stride between the tried seeds, which keeps scenes from sharing them.
const NEXT_ARRANGEMENT: u64 = 1_000_003;

/// Note on shares, means and intervals, shown below a table.
pub(super) const NOTE: &str = "Shares with Wilson's intervals; means with intervals bootstrapped over arrangements, where there are \
                               8 or more; 95 % each. Seconds are those of the robot's clock. A run that ended with an error counts \
                               as not right.";

/// Settings of one run.
pub(super) struct Trial<'a> {
    /// Domain of the goal.
    pub domain: &'a Domain,
    /// Goal that is pursued.
    pub goal: &'a Goal,
    /// The scene; in a program's world, places and objects have the same names.
    pub spec: &'a SceneSpec,
    /// Command line of a program with its own world; `None`: the simulator.
    pub program: Option<&'a str>,
    /// Targets of the search: names or kinds in the scene.
    pub targets: &'a [String],
    /// True if the targets are in the scene.
    pub present: bool,
    /// Seed of arrangement, noise, faults and random choices.
    pub seed: u64,
    /// Injected faults.
    pub faults: FaultPlan,
    /// Name of the policy that chooses where to look next.
    pub policy: &'a str,
    /// True if the first view is taken from the start, whatever the policy.
    pub first_look_here: bool,
    /// Maximum distance between the stated and the true position of a found object, metres.
    pub tolerance_m: f64,
}

/// Carries out a run and compares its result with the target's true final position. Its record is kept in
/// `scratch`.
pub(super) fn carry_out(trial: &Trial<'_>, scratch: &Path, stop: &Stop) -> Result<Outcome, String> {
    let Lived { report, truth, arrangement, share, clock, .. } = live(trial, scratch, stop)?;
    let mut row = measured(trial, &report);
    row.insert("arrangement".into(), json!(arrangement));
    row.insert("visible_from_start".into(), json!(share.map(|s| (s * 1e4).round() / 1e4)));
    row.insert("mishaps".into(), json!(truth.events.len()));
    Ok(Outcome { rows: vec![row], clock })
}

/// Result of one run.
pub(super) struct Lived {
    /// Agent's report on the run.
    pub report: Report,
    /// True state of the scene at the end of the run.
    pub truth: Truth,
    /// Number of completed executions of each action, by name.
    pub carried: BTreeMap<String, usize>,
    /// Seed of the arrangement: the run's, or a later one where that seed has no arrangement with the
    /// requested occlusion; `None` in a program's world.
    pub arrangement: Option<u64>,
    /// Share of the target that was visible from the start; `None` if unknown.
    pub share: Option<f64>,
    /// Wall-clock times.
    pub clock: Row,
}

/// Carries out a run of the agent.
pub(super) fn live(trial: &Trial<'_>, scratch: &Path, stop: &Stop) -> Result<Lived, String> {
    let started = std::time::Instant::now();
    let Staged { body, goal, arrangement, share, foresight } = match trial.program {
        None => simulated(trial)?,
        Some(command) => run_by_program(trial, command)?,
    };
    let arranged_s = started.elapsed().as_secs_f64();
    let mut chooser = policies::named(trial.policy, trial.seed, foresight).map_err(|e| e.to_string())?;
    chooser.first_look_here = trial.first_look_here;
    let folder = Folder::made(scratch).map_err(|e| e.to_string())?;
    let settings = Settings {
        robot: trial.program.map_or_else(|| "sim".into(), |command| format!("program:{command}")),
        scene: None,
        seed: trial.seed,
        domain: trial.domain.config.name.clone(),
        policy: trial.policy.into(),
        // What a batch has done is in its journal; a power cut costs a run at most.
        keeping: Keeping { durability: Some(Kept::Process), ..Keeping::default() },
        remember: None,
    };
    let mut carried = BTreeMap::new();
    let mut count = |event: &Event| {
        if let Event::Acted { call, .. } = event {
            *carried.entry(call.action.clone()).or_default() += 1;
        }
    };
    let watcher = Watcher { stop, tell: &mut count };
    let task = Task { domain: trial.domain, goal: &goal, past: None };
    let report = runtime()?.block_on(run::pursue(task, &body, &folder, &settings, chooser, watcher));
    let report = report.map_err(|e| e.to_string())?;
    let run_s = started.elapsed().as_secs_f64() - arranged_s;
    let mut clock = Row::new();
    clock.insert("arrange_s".into(), json!(arranged_s));
    clock.insert("run_s".into(), json!(run_s));
    if report.planning_s > 0.0 {
        let poses = trial.domain.config.candidates.poses;
        clock.insert(format!("longest planning at {poses} poses, geometry apart"), json!(report.planning_s));
        clock.insert(format!("longest geometry of a plan at {poses} poses"), json!(report.geometry_s));
    }
    let truth = body.truth()?.ok_or("the body does not say how everything really stands")?;
    Ok(Lived { report, truth, carried, arrangement, share, clock })
}

/// Body in its world, before a run.
struct Staged {
    body: Body,
    /// Goal as parsed for this body.
    goal: Goal,
    /// Seed of the arrangement; `None` in a program's world.
    arrangement: Option<u64>,
    /// Share of the target that is visible from the start; `None` if unknown.
    share: Option<f64>,
    foresight: Option<Foresight>,
}

fn simulated(trial: &Trial<'_>) -> Result<Staged, String> {
    let without = trial.targets.iter().fold(trial.spec.clone(), |spec, target| spec.without(target));
    // What hides an absent thing stands as it would if it were there.
    let (seed, mut scene) = arrangement(trial)?;
    if !trial.present {
        scene.objects.retain(|o| without.objects.iter().any(|kept| kept.name == o.name));
        scene.target = None;
    }
    let share = scene.target_visible_from_start;
    let faults = trial.faults.clone().after(trial.spec);
    let options = SimOptions { seed: trial.seed, faults, ..SimOptions::default() };
    let robot = Arc::new(SimRobot::new(scene, options));
    let foresight = Some(foresight(&robot, trial.targets));
    let (body, goal) = (Body::simulated(robot), trial.goal.clone());
    Ok(Staged { body, goal, arrangement: Some(seed), share, foresight })
}

fn run_by_program(trial: &Trial<'_>, command: &str) -> Result<Staged, String> {
    let without = if trial.present { &[] } else { trial.targets };
    let body = program::open(command, trial.seed, without).map_err(|e| e.to_string())?;
    let lexicon = Lexicon::new(trial.domain, &Places::of_body(&*body.robot));
    let goal = goal::read(&trial.goal.said, trial.domain, &lexicon).map_err(|e| e.to_string())?;
    Ok(Staged { body, goal, arrangement: None, share: None, foresight: None })
}

/// The first arrangement that can be made, with its seed.
fn arrangement(trial: &Trial<'_>) -> Result<(u64, descry_robots::sim::Scene), String> {
    let mut last = String::new();
    for n in 0..ARRANGEMENTS {
        let seed = trial.seed.wrapping_add(n.wrapping_mul(NEXT_ARRANGEMENT));
        match arrange(trial.spec, seed) {
            Ok(scene) => return Ok((seed, scene)),
            Err(why) => last = why.to_string(),
        }
    }
    Err(last)
}

/// True if the object is present and is one of the targets, by name or kind.
pub(super) fn is_among(object: &TrueObject, targets: &[String]) -> bool {
    object.present && targets.iter().any(|target| object.name == *target || object.kind == *target)
}

/// True visibility of the target from each pose at the time of the question, for the oracle.
fn foresight(robot: &Arc<SimRobot>, targets: &[String]) -> Foresight {
    let (robot, targets) = (Arc::clone(robot), targets.to_vec());
    Box::new(move |place: &Place, on: &str| {
        let Place::Pose(pose) = place else { return 0.0 };
        let stands = |o: &&TrueObject| is_among(o, &targets) && o.surface.as_deref() == Some(on);
        let shares = robot.truth().objects;
        shares.iter().filter(stands).map(|o| robot.true_visible_share(&o.name, pose)).fold(0.0, f64::max)
    })
}

/// Measurements of a report against the true final scene.
fn measured(trial: &Trial<'_>, report: &Report) -> Row {
    let believed = report.position_m.filter(|_| report.verdict == Verdict::Achieved);
    let error_m = believed.zip(report.true_position_m).map(|(believed, truth)| {
        believed.iter().zip(&truth).take(2).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    });
    let present = report.true_position_m.is_some();
    let found = report.verdict == Verdict::Achieved && error_m.is_some_and(|e| e <= trial.tolerance_m);
    let right = if present { found } else { report.verdict == Verdict::NotFound };
    // What it says in the end of the chance that the thing is there (for "achieved": that it is where it says).
    let stated = if report.verdict == Verdict::Achieved { Some(report.confidence) } else { report.remaining };
    let came_true = if report.verdict == Verdict::Achieved { found } else { present };
    let value = json!({
        "target": trial.targets.join(", "),
        "present": present,
        "verdict": report.verdict,
        "right": right,
        "false_declaration": report.verdict == Verdict::Achieved && !found,
        "views": report.views,
        "metres": report.distance_m,
        "seconds": report.sim_time_s,
        "replans": report.replans,
        "stated": stated,
        "came_true": came_true,
        "position_error_m": error_m,
        "why": report.why,
    });
    value.as_object().cloned().unwrap_or_default()
}

/// Measurements of a finished run, as the summaries read them from a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Scene of the run; runs in one scene are not independent.
    pub group: u64,
    /// True if the target was there at the end.
    pub present: bool,
    /// True if the verdict was right.
    pub right: bool,
    /// True if the run claimed to have found an absent target.
    pub false_declaration: bool,
    /// Number of views.
    pub views: f64,
    /// Distance driven, metres.
    pub metres: f64,
    /// Duration on the body's clock, seconds.
    pub seconds: f64,
    /// Probability stated at the end, and true if the event occurred; `None` if no probability was
    /// stated.
    pub forecast: Option<(f64, bool)>,
}

impl Measured {
    /// Reads the measurements from a row of the journal; `None` for a failed job.
    pub fn read(group: u64, row: &Row) -> Option<Self> {
        let truth = |key: &str| row.get(key).and_then(Value::as_bool);
        let number = |key: &str| row.get(key).and_then(Value::as_f64);
        Some(Self {
            group,
            present: truth("present")?,
            right: truth("right")?,
            false_declaration: truth("false_declaration")?,
            views: number("views")?,
            metres: number("metres")?,
            seconds: number("seconds")?,
            forecast: number("stated").zip(truth("came_true")),
        })
    }
}
