//! `descry show RUN`: the events of a run, from its record.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::commands::input;
use descry_agent::exit::{CommandError, Exit};
use descry_agent::report::Event;
use descry_explain::basis;

/// Arguments of `descry show`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The run's folder
    run: PathBuf,
    /// Write the run as one page instead: map, plans, point clouds and narration on a time line
    #[arg(long, value_name = "FILE", conflicts_with = "json")]
    html: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let folder = &arguments.run;
    descry_agent::run::header(folder)?;
    let record = descry_agent::keeping::open(folder)?;
    let (events, mut lost) = descry_agent::run::events(&record)?;
    let nothing = descry_agent::run::lost_of_record(folder, &record)?;
    lost.splice(0..0, record.recovery().faults.iter().cloned().chain(nothing));
    let (report, damaged) = match descry_agent::run::report(folder) {
        Ok(report) => (report, None),
        Err(e) => (None, Some(e)),
    };
    let basis = report.as_ref().map(|_| basis::of(&record)).transpose()?;
    if let Some(page) = &arguments.html {
        let text = descry_pages::page::of_run(&record, report.as_ref())?;
        let at = |e: std::io::Error| format!("{}: {e}", page.display());
        let mut file = File::create(page).map_err(|e| {
            CommandError::BadInput(format!("--html {}\n  expected a file that can be written", at(e)))
        })?;
        file.write_all(text.as_bytes()).map_err(|e| CommandError::broken(at(e)))?;
        input::print_text(&page.display().to_string())?;
    } else if arguments.json {
        input::print_json(&json!({
            "run": folder.display().to_string(), "events": events, "report": report, "rests_on": basis, "lost": lost,
        }))?;
    } else {
        let saying = input::saying(folder);
        for event in &events {
            match serde_json::from_value::<Event>(event.clone()) {
                Ok(event) => input::print_fitted(&event.told(&saying))?,
                Err(_) => input::print_text(&compact(event))?,
            }
        }
        match (report, &damaged) {
            (Some(report), _) => {
                input::print_fitted(&report.to_string())?;
                let basis = basis.as_ref().map(ToString::to_string).filter(|said| !said.is_empty());
                basis.map_or(Ok(()), |said| input::print_fitted(&said))?;
            }
            (None, None) => input::print_text("\nthe run has not finished")?,
            (None, Some(_)) => (),
        }
    }
    if let Some(damaged) = &damaged {
        input::narrate(&format!("descry: lost: {damaged}"));
    }
    let told: BTreeSet<String> = lost.iter().map(ToString::to_string).collect();
    let more: Vec<String> = basis.map_or_else(Vec::new, |basis| basis.lost);
    let more: Vec<&String> = more.iter().filter(|lost| !told.contains(*lost)).collect();
    more.iter().for_each(|lost| input::narrate(&format!("descry: lost: {lost}")));
    let exit = input::lost(&lost);
    Ok(if damaged.is_some() || !more.is_empty() { Exit::No } else { exit })
}

/// Raw JSON of an event that another version of descry recorded.
fn compact(event: &Value) -> String {
    serde_json::to_string(event).unwrap_or_default()
}
