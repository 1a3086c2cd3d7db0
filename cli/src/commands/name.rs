//! `descry name`: the objects that runs have learned, and their names.

use std::path::{Path, PathBuf};

use descry_domains::abilities::learning::news::called;
use descry_memory::learned::LearnedThing;
use descry_memory::remember::Remembered;
use descry_memory::{Error, Options, Record};
use descry_perception::files::ply;
use serde_json::{Value, json};

use crate::commands::input;
use descry_agent::exit::{CommandError, Exit};
use descry_agent::keeping::{Address, is_address};

/// Arguments of `descry name`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Store of earlier runs: a folder, or mongodb://HOST/DATABASE
    store: PathBuf,
    /// Current name, such as "thing 1": alone, describes the object; without it, all learned objects are
    /// listed
    old: Option<String>,
    /// New name, such as "the thing from Tuesday"
    #[arg(group = "deed")]
    new: Option<String>,
    /// Write the points of the object's model to a PLY file, metres relative to its centre
    #[arg(long, value_name = "FILE", group = "deed", requires = "old")]
    points: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let store = open(&arguments.store)?;
    let mut remembered = Remembered::recall(&store).map_err(CommandError::broken)?;
    let now_unix_s = std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .map_or(0.0, |since| since.as_secs_f64());
    if let (Some(old), Some(new)) = (&arguments.old, &arguments.new) {
        let known = find(&remembered, old)?.name.clone();
        check_free(&remembered, &known, new)?;
        remembered.rename(&known, new.trim());
        remembered.keep(&store, now_unix_s).map_err(CommandError::broken)?;
    }
    if let (Some(old), Some(file)) = (&arguments.old, &arguments.points) {
        let points = ply::write(&find(&remembered, old)?.cloud, ply::PlyEncoding::Binary);
        std::fs::write(file, points)
            .map_err(|e| CommandError::BadInput(format!("--points {}: {e}", file.display())))?;
    }
    // A thing that was just named is shown among the others.
    let shown: Vec<&LearnedThing> = match (&arguments.old, &arguments.new) {
        (Some(old), None) => vec![find(&remembered, old)?],
        _ => remembered.things.iter().collect(),
    };
    let all: Vec<Value> = shown.iter().map(|t| described(t, now_unix_s)).collect();
    if arguments.json {
        input::print_json(&json!({ "things": all }))?;
        return Ok(Exit::Done);
    }
    if all.is_empty() {
        input::narrate("nothing was learned yet; `descry do \"learn what is new\" --domain learning` does");
    }
    shown.iter().try_for_each(|thing| input::print_text(&line(thing, now_unix_s)))?;
    Ok(Exit::Done)
}

fn open(store: &Path) -> Result<Record, CommandError> {
    if is_address(store) {
        let address = Address::read(&store.display().to_string())?;
        let address = if address.run.is_some() { address } else { address.of_run(Path::new("remembered")) };
        return address.write(Options::default());
    }
    Record::open(store, Options::default()).map_err(|e| match e {
        Error::NoRecord { .. } => CommandError::bad_input(e),
        other => CommandError::broken(other),
    })
}

fn find<'a>(remembered: &'a Remembered, old: &str) -> Result<&'a LearnedThing, CommandError> {
    let found = remembered.things.iter().find(|t| called(&t.name) == called(old));
    found.ok_or_else(|| {
        let names: Vec<&str> = remembered.things.iter().map(|t| t.name.as_str()).collect();
        let names = if names.is_empty() { "nothing yet".into() } else { names.join(", ") };
        CommandError::BadInput(format!("nothing that was learned is called \"{old}\"\n  there are: {names}"))
    })
}

/// Rejects a name that cannot be spoken, or that is taken.
fn check_free(remembered: &Remembered, old: &str, new: &str) -> Result<(), CommandError> {
    let symbol = called(new);
    if symbol.is_empty() {
        let text = format!("\"{new}\" is no name\n  take letters or digits, as in \"lunch box\"");
        return Err(CommandError::BadInput(text));
    }
    match remembered.things.iter().find(|t| t.name != old && called(&t.name) == symbol) {
        Some(other) => Err(CommandError::BadInput(format!(
            "\"{}\" is something else that was learned\n  take another name, or give that one another first",
            other.name
        ))),
        None => Ok(()),
    }
}

/// Size of the bounding box of an object, centimetres.
fn size_cm(thing: &LearnedThing) -> [f64; 3] {
    let (low, high) = thing.cloud.bounds().unwrap_or_default();
    [0, 1, 2].map(|k| 1e2 * f64::from(high[k] - low[k]))
}

fn described(thing: &LearnedThing, now_unix_s: f64) -> Value {
    json!({
        "name": thing.name,
        "learned_unix_s": thing.learned_unix_s,
        "learned_hours_ago": (now_unix_s - thing.learned_unix_s) / 3600.0,
        "size_m": size_cm(thing).map(|cm| 1e-2 * cm),
        "points": thing.cloud.len(),
        "sides": thing.sides,
        "meetings": thing.meetings,
        "seen": { "unix_s": thing.seen.unix_s, "on": thing.seen.on, "position_m": thing.seen.at_m },
    })
}

fn line(thing: &LearnedThing, now_unix_s: f64) -> String {
    let [w, d, h] = size_cm(thing);
    let at = thing.seen.at_m;
    format!(
        "{:24} learned on {}, {:.1} h ago: {w:.0} x {d:.0} x {h:.0} cm, {:.0} % of its sides seen in {}\n{:24} seen last on {}, {:.1} h ago, at ({:.2}, {:.2}) m on {}",
        thing.name,
        weekday(thing.learned_unix_s),
        (now_unix_s - thing.learned_unix_s) / 3600.0,
        1e2 * thing.sides,
        if thing.meetings == 1 { "one meeting".to_string() } else { format!("{} meetings", thing.meetings) },
        "",
        weekday(thing.seen.unix_s),
        (now_unix_s - thing.seen.unix_s) / 3600.0,
        at.x,
        at.y,
        thing.seen.on
    )
}

/// Day of the week in UTC; 1 January 1970 was a Thursday.
pub fn weekday(unix_s: f64) -> &'static str {
    let days = (unix_s / 86_400.0).floor() as i64;
    ["Thursday", "Friday", "Saturday", "Sunday", "Monday", "Tuesday", "Wednesday"]
        [days.rem_euclid(7) as usize]
}
