//! `descry runs`: list of the runs in a folder, one a line.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use descry_agent::numbers::count;

use crate::commands::input;
use descry_agent::exit::{CommandError, Exit};
use descry_agent::keeping::{self, RECORD};
use descry_agent::{run, shell};

/// Arguments of `descry runs`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folder with the runs
    #[arg(default_value = "runs")]
    folder: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let runs = list(arguments)?;
    if arguments.json {
        input::print_json(&json!({ "runs": runs }))?;
        return Ok(Exit::Done);
    }
    if !runs.is_empty() {
        input::print_fitted(&table(&runs))?;
    }
    if runs.is_empty() {
        input::narrate(&format!(
            "{}: no run yet; `descry find \"cup A\"` makes one",
            arguments.folder.display()
        ));
    }
    Ok(Exit::Done)
}

/// Table of runs: start time, folder, verdict, views and goal of each.
fn table(runs: &[Value]) -> String {
    let text = |run: &Value, key: &str| run[key].as_str().unwrap_or("?").to_string();
    let row = |run: &Value| {
        let views = run["views"].as_u64().map_or(String::new(), |n| count(n as usize, "view"));
        let started = run["started_unix_s"].as_u64().map_or("?".into(), date);
        [started, text(run, "run"), text(run, "verdict"), views, text(run, "goal")]
    };
    let rows: Vec<[String; 5]> = runs.iter().map(row).collect();
    let width = |n: usize| rows.iter().map(|row| row[n].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..5).map(width).collect();
    let cell = |(text, width): (&String, &usize)| format!("{text:width$}");
    let line = |row: &[String; 5]| row.iter().zip(&widths).map(cell).collect::<Vec<_>>().join("  ");
    rows.iter().map(|row| line(row).trim_end().to_string()).collect::<Vec<_>>().join("\n")
}

fn list(arguments: &Arguments) -> Result<Vec<Value>, CommandError> {
    let folder = &arguments.folder;
    if keeping::is_address(folder) {
        let folder = folder.display().to_string();
        let text = format!(
            "{folder}: a store, not a folder of runs\n  `descry memory show {}` names the runs whose records are there",
            shell::word(&folder)
        );
        return Err(CommandError::BadInput(text));
    }
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(folder)
        .map_err(|e| CommandError::BadInput(format!("{}: {e}", folder.display())))?;
    let is_run = |path: &PathBuf| ["run.json", RECORD].iter().any(|name| path.join(name).exists());
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(is_run).collect();
    paths.sort();
    Ok(paths.iter().map(|path| describe(path)).collect())
}

/// Description of a run, as far as its folder is readable.
fn describe(path: &Path) -> Value {
    let header = run::header(path).ok();
    let (report, otherwise) = match run::report(path) {
        Ok(report) => (report, "unfinished"),
        Err(_) => (None, "damaged"),
    };
    json!({
        "run": path.display().to_string(),
        "goal": header.as_ref().map(|h| &h.goal),
        "started_unix_s": header.as_ref().map(|h| h.started_unix_s),
        "verdict": report.as_ref().map_or(json!(otherwise), |r| json!(r.verdict)),
        "views": report.as_ref().map(|r| r.views),
        "confidence": report.as_ref().map(|r| r.confidence),
    })
}

/// Date and time in UTC, to the minute.
pub fn date(unix_s: u64) -> String {
    // Days are counted from the first of March of the year 0, so that a leap day ends a year and 400 years are one era of 146097
    // days (Richards, Explanatory Supplement to the Astronomical Almanac, 15.11.3).
    let days = unix_s / 86_400 + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let (month, later) = if from_march < 10 { (from_march + 3, 0) } else { (from_march - 9, 1) };
    let (hour, minute) = (unix_s / 3600 % 24, unix_s / 60 % 60);
    format!("{:04}-{month:02}-{day:02} {hour:02}:{minute:02}", era * 400 + year + later)
}
