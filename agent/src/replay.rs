//! Replay of a run from its record, and comparison of the results with the recorded ones.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use descry_memory::{Document, Durability, Fault, Options, Query, Record};
use descry_robots::recorded::TapedRobot;
use serde::Serialize;
use serde_json::{Value, json};

use crate::body::tape::{self, RecordTape};
use crate::exit::CommandError;
use crate::keeping::{self, Keeping, RECORD};
use crate::report::Report;
use crate::run::{self, Beginning, Task, Watcher, programs};
use descry_domains::abilities::searching::policies;

/// Kinds of documents that a replay must reproduce byte for byte.
const COMPARED: [&str; 5] = ["percepts", "belief", "problem", "skill", "event"];
/// Fields of a report that differ from run to run, or come from a simulator; these are not
/// compared.
const OWN: [&str; 7] = ["wall_s", "planning_s", "geometry_s", "run", "true_position_m", "true_on", "true_in"];

/// Outcome of a replay.
#[derive(Debug, Default, Serialize)]
pub struct Replayed {
    /// The run's folder.
    pub run: String,
    /// Damage found in the record; a damaged record is not replayed.
    pub damage: Vec<Fault>,
    /// True if all that was compared is equal.
    pub same: bool,
    /// Number of equal documents at the beginning, by kind.
    pub compared: Vec<(&'static str, usize)>,
    /// Verdict that the replay reached; `None` if the run was interrupted.
    pub verdict: Option<Value>,
    /// Reason why the record does not continue, for an interrupted run.
    pub cut_off: Option<String>,
    /// Differences from the record, one text each.
    pub differences: Vec<String>,
}

/// Options of a replay.
#[derive(Debug, Clone, Copy)]
pub struct Replay<'a> {
    /// The run's folder.
    pub run: &'a Path,
    /// Seconds of the body's clock per second of real time; `None`: as fast as possible.
    pub speed: Option<f64>,
    /// Folder in which the replayed run is kept; `None`: it is discarded.
    pub out: Option<&'a Path>,
}

/// Replays a run from its record, unless the record is damaged.
///
/// # Errors
/// [`CommandError`] if there is no run, if its record does not hold how the run began, or if the
/// replay fails.
pub async fn replay(asked: Replay<'_>, watcher: Watcher<'_>) -> Result<Replayed, CommandError> {
    run::header(asked.run)?;
    let source = Arc::new(keeping::open(asked.run)?);
    let damage = source.verify().map_err(CommandError::broken)?.faults;
    let replayed = match damage.is_empty() {
        true => live_through(asked, &source, watcher).await?,
        false => Replayed { damage, ..Replayed::default() },
    };
    Ok(Replayed { run: asked.run.display().to_string(), ..replayed })
}

/// Replays a run whose record is undamaged.
async fn live_through(
    asked: Replay<'_>,
    source: &Arc<Record>,
    watcher: Watcher<'_>,
) -> Result<Replayed, CommandError> {
    let Some(beginning) = Beginning::of(source)? else {
        let text = format!(
            "{}: the record does not say what the run began with\n  it is empty, or of an older version",
            asked.run.display()
        );
        return Err(CommandError::BadInput(text));
    };
    let header = &beginning.header;
    let scratch = Scratch::new(asked.out)?;
    let options = Options { durability: Durability::Process, ..Options::default() };
    let record = Record::create(&scratch.folder.join(RECORD), options).map_err(CommandError::broken)?;
    let record = Arc::new(record);
    let robot = Arc::new(robot(source, &record, asked)?);
    beginning.put(&record, robot.known().now_ns)?;
    let kept = programs::on_record(&beginning.domain()?, &record, Some(source), &robot, false)?;
    let goal = run::understood(&header.goal, &kept.domain, &*robot, beginning.past.as_ref())?;
    let chooser = policies::named(&header.settings.policy, header.settings.seed, None);
    let chooser = chooser.map_err(CommandError::bad_input)?;
    let task = Task { domain: &kept.domain, goal: &goal, past: beginning.past.as_ref() };
    let lived = run::live_through(task, &robot, &record, chooser, &scratch.folder, watcher).await;
    let ended = robot.ended().or_else(|| kept.ended());
    let report = match (lived, &ended) {
        (_, Some(_)) => None,
        (Ok((report, _)), None) => Some(report),
        (Err(e), None) => return Err(e),
    };
    let recorded = run::report(asked.run)?;
    let mut replayed = compare(source, &record, ended, &header.settings.keeping)?;
    replayed.verdict = report.as_ref().map(|r| json!(r.verdict));
    replayed.differences.extend(compare_reports(recorded.as_ref(), report.as_ref()));
    replayed.same = replayed.differences.is_empty();
    if let (Some(report), true) = (&report, asked.out.is_some()) {
        run::keep_header(&scratch.folder, header)?;
        run::finish(&scratch.folder, report)?;
    }
    Ok(replayed)
}

/// Body that answers as recorded.
fn robot(source: &Arc<Record>, into: &Arc<Record>, asked: Replay<'_>) -> Result<TapedRobot, CommandError> {
    let Some(known) = tape::known(source)? else {
        let text = format!(
            "{}: the record does not say what the body was\n  it is empty, of an older version, or its beginning was pruned",
            asked.run.display()
        );
        return Err(CommandError::BadInput(text));
    };
    let entries = tape::entries(source)?;
    let tape = Arc::new(RecordTape { into: Arc::clone(into), from: Arc::clone(source) });
    Ok(TapedRobot::replay(known, tape, entries, asked.speed))
}

/// Compares replayed documents with the recorded ones, as far as these were kept and the run was
/// not interrupted (`ended`: why).
fn compare(
    source: &Record,
    again: &Record,
    ended: Option<String>,
    keeping: &Keeping,
) -> Result<Replayed, CommandError> {
    let mut replayed = Replayed { cut_off: ended, ..Replayed::default() };
    let cut = match replayed.cut_off {
        Some(_) => again.newest(tape::ANSWER).map_err(CommandError::broken)?.map(|d| d.id),
        None => None,
    };
    for kind in COMPARED {
        let recorded = source.find(&source.own(kind)).map_err(CommandError::broken)?;
        let mut found = again.find(&Query::of_kind(kind)).map_err(CommandError::broken)?;
        found.retain(|d| cut.is_none_or(|cut| d.id < cut));
        if keeping.prunes() {
            // What was pruned is not there to be compared.
            let kept: BTreeSet<i64> = recorded.iter().map(|d| d.stamp_ns).collect();
            found.retain(|d| kept.contains(&d.stamp_ns));
        }
        let text = |d: &Document| format!("{} {}", d.stamp_ns, d.body);
        let pairs = recorded.iter().zip(&found);
        let same = pairs.take_while(|(a, b)| text(a) == text(b)).count();
        replayed.compared.push((kind, same));
        let whole = recorded.len().min(found.len());
        if same < whole {
            let (a, b) = (text(&recorded[same]), text(&found[same]));
            replayed.differences.push(difference(kind, same + 1, &a, &b));
        } else if cut.is_none() && recorded.len() != found.len() {
            let line = format!("{kind}: {} were recorded, {} came about", recorded.len(), found.len());
            replayed.differences.push(line);
        }
    }
    Ok(replayed)
}

/// Description of the first difference between two texts, with some context.
fn difference(kind: &str, number: usize, recorded: &str, found: &str) -> String {
    const SHOWN: usize = 60;
    let common = recorded.chars().zip(found.chars()).take_while(|(a, b)| a == b).count();
    let from = common.saturating_sub(SHOWN / 2);
    let part = |text: &str| text.chars().skip(from).take(SHOWN).collect::<String>();
    format!("{kind} {number}: recorded …{}…, now …{}…", part(recorded), part(found))
}

fn compare_reports(recorded: Option<&Report>, found: Option<&Report>) -> Vec<String> {
    let (Some(recorded), Some(found)) = (recorded, found) else {
        let only = recorded.is_some() && found.is_none();
        return only.then(|| "the run had come to an end, the replay did not".into()).into_iter().collect();
    };
    let [recorded, found] = [recorded, found].map(|r| json!(r));
    let text = |report: &Value, key: &str| report[key].to_string();
    let keys = recorded.as_object().into_iter().flat_map(|o| o.keys());
    keys.filter(|key| !OWN.contains(&key.as_str()))
        .map(|key| (key, text(&recorded, key), text(&found, key)))
        .filter(|(_, recorded, found)| recorded != found)
        .map(|(key, recorded, found)| format!("{key}: recorded {recorded}, now {found}"))
        .collect()
}

/// Folder of the replayed run: the requested one, or a temporary one that is removed on drop.
struct Scratch {
    folder: PathBuf,
    goes: bool,
}

impl Scratch {
    fn new(asked: Option<&Path>) -> Result<Self, CommandError> {
        let own = || std::env::temp_dir().join(format!("descry-replay-{}", std::process::id()));
        let folder = asked.map_or_else(own, Path::to_path_buf);
        std::fs::create_dir_all(&folder)
            .map_err(|e| CommandError::BadInput(format!("{}: {e}", folder.display())))?;
        Ok(Scratch { folder, goes: asked.is_none() })
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if self.goes
            && let Err(e) = std::fs::remove_dir_all(&self.folder)
        {
            tracing::warn!("{}: {e}", self.folder.display());
        }
    }
}
