//! `descry memory …` and `descry export`: inspection of a record.

use std::path::PathBuf;

use descry_memory::{Document, Fault, Near, Order, Query, Record};
use serde_json::json;

use crate::commands::{fitted, input};
use descry_agent::exit::{CommandError, Exit};
use descry_agent::keeping;

/// Operations on a record.
#[derive(clap::Subcommand)]
pub enum Arguments {
    /// Show the contents of a record: counts, sizes, times
    Show(Place),
    /// List the records that match conditions
    Query(QueryArguments),
    /// Verify every record: exit 0 if all are undamaged, 1 if not
    Verify(Place),
    /// Export everything, or the records that match conditions, as one MCAP file
    Export(ExportArguments),
}

/// Location of a record.
#[derive(clap::Args)]
pub struct Place {
    /// Folder of a run or of its record, or mongodb://HOST/DATABASE[#RUN]
    record: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Arguments of `descry memory query`.
#[derive(clap::Args)]
pub struct QueryArguments {
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    filter: Filter,
    /// Only the record nearest to this time, seconds
    #[arg(long, value_name = "S")]
    nearest: Option<f64>,
    /// Maximum difference in time of the nearest, seconds
    #[arg(long, value_name = "S", default_value_t = 0.5, requires = "nearest")]
    tolerance: f64,
}

/// Arguments of `descry export`.
#[derive(clap::Args)]
pub struct ExportArguments {
    #[command(flatten)]
    place: Place,
    /// The MCAP file to write
    file: PathBuf,
    #[command(flatten)]
    filter: Filter,
}

/// Conditions, all of which must hold.
#[derive(clap::Args)]
struct Filter {
    /// Kind: cloud, image, transforms, log, belief, …
    #[arg(long)]
    kind: Option<String>,
    /// Coordinate frame
    #[arg(long)]
    frame: Option<String>,
    /// Robot that recorded it
    #[arg(long)]
    robot: Option<String>,
    /// Earliest time, seconds
    #[arg(long, value_name = "S")]
    from: Option<f64>,
    /// Latest time, seconds
    #[arg(long, value_name = "S")]
    to: Option<f64>,
    /// Mentioning this object
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Minimum confidence, 0 to 1
    #[arg(long, value_name = "P")]
    min_confidence: Option<f64>,
    /// Seen from near this point, metres
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = place)]
    seen_from: Option<[f64; 3]>,
    /// Showing this point, metres
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = place)]
    covers: Option<[f64; 3]>,
    /// Radius of nearness, metres
    #[arg(long, value_name = "M", default_value_t = 0.5)]
    radius: f64,
    /// Newest first
    #[arg(long)]
    newest: bool,
    /// Maximum number of records
    #[arg(long, value_name = "N")]
    limit: Option<usize>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    match arguments {
        Arguments::Show(place) => show(place),
        Arguments::Query(arguments) => query(arguments),
        Arguments::Verify(place) => verify(place),
        Arguments::Export(arguments) => export(arguments),
    }
}

fn open(place: &Place) -> Result<Record, CommandError> {
    keeping::open(&place.record)
}

fn show(place: &Place) -> Result<Exit, CommandError> {
    let record = open(place)?;
    let stats = record.stats().map_err(CommandError::broken)?;
    let lost = &record.recovery().faults;
    let runs = match place.record.to_str().filter(|_| keeping::is_address(&place.record)) {
        Some(address) => keeping::Address::read(address)?.runs()?,
        None => Vec::new(),
    };
    if place.json {
        let mut shown = json!({ "record": place.record.display().to_string(), "stats": stats, "lost": lost });
        if !runs.is_empty() {
            shown["runs"] = json!(runs);
        }
        input::print_json(&shown)?;
        return Ok(input::lost(lost));
    }
    let time = |ns: Option<i64>| ns.map_or("-".into(), |ns| format!("{:.3} s", seconds(ns)));
    input::print_text(&format!(
        "{} records, {:.1} MB, from {} to {}, {} pinned",
        stats.records,
        stats.bytes as f64 / 1e6,
        time(stats.oldest_ns),
        time(stats.newest_ns),
        stats.pinned
    ))?;
    for (kind, count) in &stats.kinds {
        input::print_text(&format!("{kind:20} {:8} {:10.1} MB", count.records, count.bytes as f64 / 1e6))?;
    }
    if !runs.is_empty() {
        input::print_text(&format!("runs: {}", runs.join(", ")))?;
    }
    Ok(input::lost(lost))
}

fn query(arguments: &QueryArguments) -> Result<Exit, CommandError> {
    let record = open(&arguments.place)?;
    let query = arguments.filter.query();
    let (found, faults) = match arguments.nearest {
        None => record.find_whole(&query).map_err(CommandError::broken)?,
        Some(s) => match record.nearest_of(&query, nanoseconds(s), nanoseconds(arguments.tolerance)) {
            Ok(document) => record.find_whole(&exactly(query, &document)).map_err(CommandError::broken)?,
            Err(e @ descry_memory::Error::NotNear { .. }) => {
                input::narrate(&format!("descry: {e}"));
                (Vec::new(), Vec::new())
            }
            Err(e) => return Err(CommandError::broken(e)),
        },
    };
    let lost: Vec<Fault> = record.recovery().faults.iter().cloned().chain(faults).collect();
    if arguments.place.json {
        input::print_json(&json!({ "records": found, "lost": lost }))?;
    } else {
        found.iter().try_for_each(|document| input::print_text(&line(document)))?;
    }
    let exit = input::lost(&lost);
    if !found.is_empty() {
        return Ok(exit);
    }
    let kinds: Vec<String> = record.stats().map_err(CommandError::broken)?.kinds.into_keys().collect();
    if let Some(kind) = arguments.filter.kind.as_ref().filter(|kind| !kinds.contains(kind)) {
        input::narrate(&format!(
            "descry: nothing of the kind \"{kind}\" is recorded\n  there are: {}",
            kinds.join(", ")
        ));
    }
    Ok(Exit::No)
}

/// Query narrowed to one document of its results.
fn exactly(query: Query, document: &Document) -> Query {
    let before = descry_memory::RecordId(document.id.0.saturating_sub(1));
    Query { after: Some((document.stamp_ns, before)), order: Order::Oldest, limit: Some(1), ..query }
}

fn verify(place: &Place) -> Result<Exit, CommandError> {
    let record = open(place)?;
    let mut report = record.verify().map_err(CommandError::broken)?;
    report.faults.extend(descry_agent::run::lost_of_record(&place.record, &record)?);
    if place.json {
        input::print_json(&json!({ "report": report, "whole": report.is_whole() }))?;
    } else {
        input::print_text(&format!(
            "{} records are whole ({:.1} MB)",
            report.whole,
            report.bytes as f64 / 1e6
        ))?;
        for fault in &report.faults {
            let record = fault.record.map_or(String::new(), |id| format!("record {id} "));
            input::print_text(&format!("{}: {record}{}", fault.place, fault.what))?;
        }
    }
    Ok(if report.is_whole() { Exit::Done } else { Exit::No })
}

pub(super) fn export(arguments: &ExportArguments) -> Result<Exit, CommandError> {
    let record = open(&arguments.place)?;
    if arguments.file.exists() {
        return Err(CommandError::bad_input(format!(
            "{} is there already: name a new file",
            arguments.file.display()
        )));
    }
    let exported = record.export(&arguments.filter.query(), &arguments.file).map_err(CommandError::broken)?;
    let lost: Vec<Fault> = record.recovery().faults.iter().chain(&exported.faults).cloned().collect();
    if arguments.place.json {
        let file = arguments.file.display().to_string();
        let (records, bytes) = (exported.records, exported.bytes);
        input::print_json(&json!({ "file": file, "records": records, "bytes": bytes, "lost": lost }))?;
    } else {
        let megabytes = exported.bytes as f64 / 1e6;
        input::print_text(&format!(
            "{}: {} records, {megabytes:.1} MB",
            arguments.file.display(),
            exported.records
        ))?;
    }
    Ok(input::lost(&lost))
}

impl Filter {
    fn query(&self) -> Query {
        let near = |place_m: Option<[f64; 3]>| place_m.map(|place_m| Near { place_m, radius_m: self.radius });
        Query {
            kind: self.kind.clone(),
            frame: self.frame.clone(),
            robot: self.robot.clone(),
            from_ns: self.from.map(nanoseconds),
            to_ns: self.to.map(nanoseconds),
            seen_from: near(self.seen_from),
            covers: near(self.covers),
            object: self.object.clone(),
            min_confidence: self.min_confidence,
            order: if self.newest { Order::Newest } else { Order::Oldest },
            limit: self.limit,
            after: None,
        }
    }
}

/// A record on one line: number, time, kind, frame, and the start of its content, cut to the terminal's
/// width.
fn line(document: &Document) -> String {
    /// Width without a terminal, columns.
    const WIDTH: usize = 100;
    let body = if document.body.is_null() { String::new() } else { document.body.to_string() };
    let bytes: u64 = document.blobs.iter().map(|b| b.bytes).sum();
    let blobs = if bytes == 0 { String::new() } else { format!("[{:.1} kB] ", bytes as f64 / 1e3) };
    let first = format!(
        "{:8} {:12.3} s  {:16} {:12} {blobs}",
        document.id.0,
        seconds(document.stamp_ns),
        document.kind,
        document.frame
    );
    let left = |width: usize| width.saturating_sub(first.chars().count() + 1);
    let most = fitted::width(&std::io::stdout()).map_or(WIDTH, left);
    match body.char_indices().nth(most) {
        Some((cut, _)) => format!("{first}{}…", &body[..cut]),
        None => first + &body,
    }
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

fn nanoseconds(s: f64) -> i64 {
    (s * 1e9).round() as i64
}

fn place(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    let numbers =
        numbers.ok().and_then(|n| <[f64; 3]>::try_from(n).ok()).filter(|n| n.iter().all(|v| v.is_finite()));
    numbers.ok_or_else(|| format!("`{text}` is no place: give three numbers, as 1.2,-0.5,0.7"))
}
