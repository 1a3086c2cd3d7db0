//! A run from beginning to end: its folder, record and report.

mod beginning;
pub(crate) mod files;
#[doc(hidden)]
pub mod folder;
mod header;
pub mod programs;
mod remembering;
#[doc(hidden)]
pub mod resumed;

use std::path::Path;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

pub use beginning::Beginning;
use descry_domains::conclusion::{Conclusion, Verdict};
use descry_domains::goal;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::Domain;
use descry_domains::objective::Goal;
use descry_domains::past::Past;
use descry_domains::world::{Chooser, Setting};
use descry_memory::remember::Remembered;
use descry_memory::{Fault, Query, Record};
use descry_robots::Robot;
use descry_robots::recorded::TapedRobot;
pub use files::{finish, has_ended, header, keep_header, lost_of_header, lost_of_record, report};
pub use folder::Folder;
pub use header::{Header, Resumed, Settings};
pub use resumed::{GoingOn, Prepare, resume};
use serde_json::Value;

use crate::agent::{Agent, Totals};
use crate::body::Body;
use crate::body::tape::{self, RecordTape};
use crate::exit::CommandError;
use crate::report::{Event, Report};
use crate::shell;
use crate::stop::Stop;

/// Task of a run: domain, goal and remembered belief.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// Domain: predicates, actions and settings.
    pub domain: &'a Domain,
    /// Goal that is pursued.
    pub goal: &'a Goal,
    /// Belief remembered from earlier runs; `None` without one.
    pub past: Option<&'a Past>,
}

/// Means of a caller to stop and observe a run.
pub struct Watcher<'a> {
    /// Stop signal; the body is stopped before the run ends.
    pub stop: &'a Stop,
    /// Receives every event of the run.
    pub tell: &'a mut dyn FnMut(&Event),
}

/// Pursues a goal in a new run and reports. Planning and perception block the awaiting thread, so
/// this should run on a thread of its own.
///
/// # Errors
/// [`CommandError`] if the body or the record fails for good, or the domain cannot be used.
pub async fn pursue(
    task: Task<'_>,
    body: &Body,
    folder: &Folder,
    settings: &Settings,
    chooser: Chooser,
    watcher: Watcher<'_>,
) -> Result<Report, CommandError> {
    let Task { domain, goal, past } = task;
    if let Some(store) = &settings.remember {
        remembering::check(store, folder.path())?;
    }
    let header = Header {
        version: env!("CARGO_PKG_VERSION").into(),
        goal: goal.said.clone(),
        pddl_goal: goal.pddl.clone(),
        started_unix_s: now_unix_s() as u64,
        resumed: Vec::new(),
        settings: settings.clone(),
    };
    keep_header(folder.path(), &header)?;
    let record = Arc::new(settings.keeping.create(folder.path())?);
    let beginning = Beginning { past: past.cloned(), ..Beginning::new(header, domain, body.scene.clone()) };
    beginning.put(&record, body.robot.now_ns())?;
    let tape = Arc::new(RecordTape { into: Arc::clone(&record), from: Arc::clone(&record) });
    let robot = Arc::new(TapedRobot::begin(Arc::clone(&body.robot), tape));
    let kept = programs::on_record(domain, &record, None, &robot, true)?;
    let task = Task { domain: &kept.domain, ..task };
    let lived = live_through(task, &robot, &record, chooser, folder.path(), watcher).await;
    let (mut report, remembered) =
        lived.map_err(|error| how_to_go_on(error, folder.path(), record.is_at_bound()))?;
    remember(settings, past, remembered, folder.path())?;
    show_true_position(&mut report, body);
    Ok(report)
}

/// Parses a goal in words, with the names of the domain, of the body's places, and of remembered
/// objects.
///
/// # Errors
/// [`CommandError::BadInput`], which says what would be understood.
pub fn understood(
    said: &str,
    domain: &Domain,
    robot: &dyn Robot,
    past: Option<&Past>,
) -> Result<Goal, CommandError> {
    let lexicon = Lexicon::new(domain, &Places::of_body(robot)).remembering(past);
    goal::read(said, domain, &lexicon).map_err(CommandError::bad_input)
}

/// Reads the persistent belief of earlier runs from a store, if one is named.
///
/// # Errors
/// [`CommandError::Broken`] if there is a store and it cannot be read.
pub fn recall(store: Option<&str>) -> Result<Option<Past>, CommandError> {
    store.map(|store| remembering::recall(store, now_unix_s())).transpose()
}

fn now_unix_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64())
}

/// Writes what a finished run leaves to be remembered, if the settings name a store.
fn remember(
    settings: &Settings,
    past: Option<&Past>,
    left: Option<Remembered>,
    folder: &Path,
) -> Result<(), CommandError> {
    let (Some(store), Some(past), Some(left)) = (&settings.remember, past, left) else { return Ok(()) };
    remembering::keep(store, past, left, now_unix_s()).map_err(|why| {
        let folder = folder.display().to_string();
        let word = shell::word(&folder);
        CommandError::broken(format!(
            "{why}\n  the run has ended, and its record in {folder} is whole; what it has seen is not remembered in {store} yet\n  \
             once that can be written: descry do --resume {word}"
        ))
    })
}

/// Resumes an interrupted run: the agent replays the record, and then continues with the body.
///
/// # Errors
/// [`CommandError`] as for [`pursue`], or if the body is not the one of that run.
pub async fn go_on(
    task: Task<'_>,
    body: &Body,
    folder: &Folder,
    record: Record,
    settings: &Settings,
    chooser: Chooser,
    watcher: Watcher<'_>,
) -> Result<Report, CommandError> {
    let record = Arc::new(record);
    let entries = tape::entries(&record)?;
    let tape = Arc::new(RecordTape { into: Arc::clone(&record), from: Arc::clone(&record) });
    let robot = Arc::new(TapedRobot::go_on(Arc::clone(&body.robot), tape, entries));
    let kept = programs::on_record(task.domain, &record, Some(&record), &robot, true)?;
    let task = Task { domain: &kept.domain, ..task };
    let lived = live_through(task, &robot, &record, chooser, folder.path(), watcher).await;
    let (mut report, remembered) =
        lived.map_err(|error| how_to_go_on(error, folder.path(), record.is_at_bound()))?;
    // What a run leaves that had ended is kept, and others may have gone on from there.
    if !files::has_ended(folder.path()) {
        remember(settings, task.past, remembered, folder.path())?;
    }
    show_true_position(&mut report, body);
    Ok(report)
}

/// Runs the agent with a body that records its answers or replays them, and writes into `record`.
/// `folder` is named in the report.
///
/// # Errors
/// [`CommandError`] if the body or the record fails for good, or the domain cannot be used.
pub async fn live_through(
    task: Task<'_>,
    robot: &Arc<TapedRobot>,
    record: &Record,
    chooser: Chooser,
    folder: &Path,
    watcher: Watcher<'_>,
) -> Result<(Report, Option<Remembered>), CommandError> {
    let Task { domain, goal, past } = task;
    tape::put_known(record, robot.known())?;
    let recogniser = descry_perception::recognise::Descry::default();
    let start_ns = robot.now_ns();
    let body: Arc<dyn Robot> = Arc::clone(robot) as _;
    let eyes = Arc::clone(&body);
    let setting = Setting { domain, goal, robot: eyes, record, recogniser: &recogniser, past: past.cloned() };
    let lived = Agent::new(body, record, watcher.stop.clone(), watcher.tell).pursue(setting, chooser).await;
    let (conclusion, totals) = lived?;
    robot.finish().map_err(CommandError::broken)?;
    let mut report = Report::begin(goal, folder.display().to_string());
    report.answer = goal.question.then(|| answer(conclusion.verdict).to_string());
    let remembered = fill(&mut report, conclusion, totals);
    report.sim_time_s = (robot.now_ns() - start_ns) as f64 * 1e-9;
    files::put_report(record, robot.now_ns(), &report)?;
    record.sync().map_err(CommandError::broken)?;
    Ok((report, remembered))
}

/// Adds to the error of a stopped or failed run how to resume it. `is_at_bound`: the record is
/// full, and the run cannot be resumed, because the size limit is fixed at the start.
pub fn how_to_go_on(error: CommandError, folder: &Path, is_at_bound: bool) -> CommandError {
    let folder = folder.display().to_string();
    let resume = format!("descry do --resume {}", shell::word(&folder));
    match error {
        CommandError::Stopped { signal, .. } => {
            let said = format!("stopped; everything until here is in {folder}\n  go on with: {resume}");
            CommandError::Stopped { said, signal }
        }
        CommandError::Broken(why) if !is_at_bound => {
            CommandError::Broken(format!("{why}\n  once that is mended, go on with: {resume}"))
        }
        other => other,
    }
}

/// Fills in the true place of the requested object, if the body has ground truth.
fn show_true_position(report: &mut Report, body: &Body) {
    let object = report.object.as_deref();
    let true_place = object.and_then(|name| body.true_place(name, report.position_m));
    report.true_position_m = true_place.as_ref().map(|p| p.position_m);
    report.true_on = true_place.as_ref().and_then(|p| p.on.clone());
    report.true_room = true_place.and_then(|p| p.room);
}

/// Answer to a yes-no question for a verdict.
fn answer(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Achieved => "yes",
        Verdict::NotFound => "no",
        Verdict::CannotTell | Verdict::Impossible | Verdict::Failed => "cannot tell",
    }
}

/// Completes a report from the conclusion; returns the belief to be remembered.
fn fill(report: &mut Report, conclusion: Conclusion, totals: Totals) -> Option<Remembered> {
    report.verdict = conclusion.verdict;
    report.why = conclusion.why;
    report.confidence = conclusion.confidence;
    report.remaining = conclusion.remaining;
    report.views = totals.views;
    report.replans = totals.plans.saturating_sub(1);
    report.distance_m = totals.distance_m;
    report.planning_s = totals.planning_s;
    report.geometry_s = totals.geometry_s;
    report.object = conclusion.object;
    report.position_m = conclusion.found.as_ref().and_then(|o| o.position_m);
    report.position_sigma_m = conclusion.found.as_ref().and_then(|o| o.position_sigma_m);
    report.on = conclusion.found.as_ref().and_then(|o| o.on.clone());
    report.room = conclusion.found.and_then(|o| o.room);
    report.objects = conclusion.objects;
    conclusion.remembered
}

/// Bodies of the event documents of a run, in order, and the damage found in its record.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn events(record: &Record) -> Result<(Vec<Value>, Vec<Fault>), CommandError> {
    let (documents, faults) = record.find_whole(&Query::of_kind("event")).map_err(CommandError::broken)?;
    Ok((documents.into_iter().map(|d| d.body).collect(), faults))
}
