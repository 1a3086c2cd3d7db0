//! `descry runs`: the runs in a folder, one a line.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::commands::input;
use crate::exit::{CommandError, Exit};
use crate::keeping;

/// Arguments of `descry runs`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folder that holds runs
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
    for run in &runs {
        let text = |key: &str| run[key].as_str().unwrap_or("?").to_string();
        let views = run["views"].as_u64().map_or(String::new(), |n| format!("{n} views"));
        input::print_text(&format!(
            "{:40} {:12} {:9} {}",
            text("run"),
            text("verdict"),
            views,
            text("goal")
        ))?;
    }
    if runs.is_empty() {
        eprintln!("{}: no run yet; `descry find \"cup A\"` makes one", arguments.folder.display());
    }
    Ok(Exit::Done)
}

fn list(arguments: &Arguments) -> Result<Vec<Value>, CommandError> {
    let folder = &arguments.folder;
    if keeping::is_address(folder) {
        let text = format!(
            "{0}: a store, not a folder of runs\n  `descry memory show {0}` names the runs whose records are there",
            folder.display()
        );
        return Err(CommandError::BadInput(text));
    }
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(folder)
        .map_err(|e| CommandError::BadInput(format!("{}: {e}", folder.display())))?;
    let mut paths: Vec<PathBuf> =
        entries.flatten().map(|e| e.path()).filter(|p| p.join("run.json").exists()).collect();
    paths.sort();
    let describe = |path: &PathBuf| {
        let read = |name: &str| -> Option<Value> {
            serde_json::from_str(&std::fs::read_to_string(path.join(name)).ok()?).ok()
        };
        let header = read("run.json").unwrap_or(Value::Null);
        let report = read("report.json").unwrap_or(Value::Null);
        let verdict = report["verdict"].as_str().unwrap_or("unfinished");
        json!({
            "run": path.display().to_string(), "goal": header["goal"], "started_unix_s": header["started_unix_s"],
            "verdict": verdict, "views": report["views"], "confidence": report["confidence"],
        })
    };
    Ok(paths.iter().map(describe).collect())
}
