//! `descry show RUN`: what happened in a run, from its record.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::commands::input;
use crate::exit::{CommandError, Exit};
use crate::report::Event;

/// Arguments of `descry show`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The run's folder
    run: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let folder = &arguments.run;
    crate::run::header(folder)?;
    let record = crate::keeping::open(folder)?;
    let events = crate::run::events(&record)?;
    let report = crate::run::report(folder);
    if arguments.json {
        input::print_json(
            &json!({ "run": folder.display().to_string(), "events": events, "report": report }),
        )?;
        return Ok(Exit::Done);
    }
    for event in &events {
        match serde_json::from_value::<Event>(event.clone()) {
            Ok(event) => input::print_text(&event.to_string())?,
            Err(_) => input::print_text(&compact(event))?,
        }
    }
    match report {
        Some(report) => input::print_text(&report.to_string())?,
        None => input::print_text("\nthe run has not finished")?,
    }
    Ok(Exit::Done)
}

/// An event of another version, as it stands in the record.
fn compact(event: &Value) -> String {
    serde_json::to_string(event).unwrap_or_default()
}
