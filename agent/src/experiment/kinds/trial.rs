//! One run of the agent in a simulated scene, held against the truth.

use std::path::Path;

use descry_domains::goal::Goal;
use descry_domains::load::Domain;
use descry_robots::Place;
use descry_robots::sim::{FaultPlan, SceneSpec, SimOptions, SimRobot, arrange};
use serde_json::{Value, json};

use crate::body::Body;
use crate::experiment::{Outcome, Row};
use crate::keeping::{Keeping, Kept};
use descry_domains::abilities::searching::policies::{self, Foresight};
use descry_domains::answer::Verdict;

use crate::report::Report;
use crate::run::{self, Folder, Settings};

/// Seeds tried for an arrangement that is as hidden as was asked for.
const ARRANGEMENTS: u64 = 20;
/// Between the seeds that are tried, so that scenes do not share them.
const NEXT_ARRANGEMENT: u64 = 1_000_003;

/// What a run is made of.
pub(super) struct Trial<'a> {
    /// What may be said and what it means.
    pub domain: &'a Domain,
    /// What is pursued.
    pub goal: &'a Goal,
    /// The scene.
    pub spec: &'a SceneSpec,
    /// What is looked for: name or kind in the scene.
    pub target: &'a str,
    /// Whether it is there.
    pub present: bool,
    /// Fixes arrangement, noise, mishaps and random choices.
    pub seed: u64,
    /// What goes wrong on purpose.
    pub faults: FaultPlan,
    /// Who chooses.
    pub policy: &'a str,
    /// Whether the first look is taken from the start, whoever chooses.
    pub first_look_here: bool,
    /// A thing is found where it is if it stands no farther from there, metres.
    pub tolerance_m: f64,
}

/// Carries a run out. Its record is kept in `scratch`.
pub(super) fn carry_out(trial: &Trial<'_>, scratch: &Path) -> Result<Outcome, String> {
    let started = std::time::Instant::now();
    let without = trial.spec.without(trial.target);
    let arrangement = arrangement(trial)?;
    // What hides an absent thing stands as it would if it were there.
    let mut scene = arrangement;
    if !trial.present {
        scene.objects.retain(|o| without.objects.iter().any(|kept| kept.name == o.name));
        scene.target = None;
    }
    let share = scene.target_visible_from_start;
    let options = SimOptions { seed: trial.seed, faults: trial.faults.clone(), ..SimOptions::default() };
    let body = Body::simulated(SimRobot::new(scene, options));
    let arranged_s = started.elapsed().as_secs_f64();
    let mut chooser = policies::named(trial.policy, trial.seed, foresight(&body, trial.target))
        .map_err(|e| e.to_string())?;
    chooser.first_look_here = trial.first_look_here;
    let folder = Folder::made(scratch).map_err(|e| e.to_string())?;
    let settings = Settings {
        robot: "sim".into(),
        scene: None,
        seed: trial.seed,
        domain: trial.domain.config.name.clone(),
        policy: trial.policy.into(),
        // What a batch has done is in its journal; a power cut costs a run at most.
        keeping: Keeping { durability: Some(Kept::Process), ..Keeping::default() },
        remember: None,
    };
    let report = run::pursue(trial.domain, trial.goal, &body, &folder, &settings, chooser, &mut |_| {});
    let report = report.map_err(|e| e.to_string())?;
    let mut row = measured(trial, &report);
    row.insert("visible_from_start".into(), json!(share.map(|s| (s * 1e4).round() / 1e4)));
    let events = body.simulator().map_or(0, |robot| robot.truth().events.len());
    row.insert("mishaps".into(), json!(events));
    let run_s = started.elapsed().as_secs_f64() - arranged_s;
    let mut clock = Row::new();
    clock.insert("arrange_s".into(), json!(arranged_s));
    clock.insert("run_s".into(), json!(run_s));
    if report.planning_s > 0.0 {
        let poses = trial.domain.config.candidates.poses;
        clock.insert(format!("longest planning at {poses} poses, geometry apart"), json!(report.planning_s));
        clock.insert(format!("longest geometry of a plan at {poses} poses"), json!(report.geometry_s));
    }
    Ok(Outcome { rows: vec![row], clock })
}

fn arrangement(trial: &Trial<'_>) -> Result<descry_robots::sim::Scene, String> {
    let tried = (0..ARRANGEMENTS)
        .map(|n| arrange(trial.spec, trial.seed.wrapping_add(n.wrapping_mul(NEXT_ARRANGEMENT))));
    let mut last = String::new();
    for scene in tried {
        match scene {
            Ok(scene) => return Ok(scene),
            Err(why) => last = why.to_string(),
        }
    }
    Err(last)
}

/// What a look would truly show, for the oracle.
fn foresight(body: &Body, target: &str) -> Option<Foresight> {
    let robot = body.simulator()?.clone();
    let named = |o: &&descry_robots::sim::TrueObject| o.present && (o.name == target || o.kind == target);
    let names: Vec<String> = robot.truth().objects.iter().filter(named).map(|o| o.name.clone()).collect();
    Some(Box::new(move |place: &Place| match place {
        Place::Pose(pose) => {
            names.iter().map(|name| robot.true_visible_share(name, pose)).fold(0.0, f64::max)
        }
        Place::Station(_) => 0.0,
    }))
}

/// What a report says, held against how everything stands in the end.
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
        "target": trial.target,
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

/// A finished run, as the summaries read it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Measured {
    /// Runs in one scene belong together.
    pub group: u64,
    /// Whether the target was there in the end.
    pub present: bool,
    /// Whether the verdict was right.
    pub right: bool,
    /// Whether it said to have found what is not there.
    pub false_declaration: bool,
    /// Looks.
    pub views: f64,
    /// Driven.
    pub metres: f64,
    /// On the body's clock.
    pub seconds: f64,
    /// The probability that it stated, and whether it came true.
    pub forecast: Option<(f64, bool)>,
}

impl Measured {
    /// Reads a row; a job that failed gives none.
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
