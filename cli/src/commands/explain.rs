//! `descry explain RUN`: explanation of a run in plain sentences.

use std::path::PathBuf;

use crate::commands::input;
use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry explain`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The run's folder
    run: PathBuf,
    /// With the duration, gain and cost of each alternative
    #[arg(long)]
    figures: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let folder = &arguments.run;
    let header = descry_agent::run::header(folder)?;
    let record = descry_agent::keeping::open(folder)?;
    let (report, damaged) = match descry_agent::run::report(folder) {
        Ok(report) => (report, None),
        Err(e) => (None, Some(e)),
    };
    let mut explained = descry_explain::of(&record, &header, report.as_ref())?;
    let faults = &record.recovery().faults;
    let nothing = descry_agent::run::lost_of_record(folder, &record)?;
    let otherwise = faults.iter().chain(&nothing).map(ToString::to_string);
    let otherwise = otherwise.chain(damaged.iter().map(ToString::to_string));
    for lost in otherwise.chain(descry_agent::run::lost_of_header(folder)) {
        if !explained.lost.contains(&lost) {
            explained.lost.push(lost);
        }
    }
    if arguments.json {
        input::print_json(&explained)?;
        explained.lost.iter().for_each(|lost| input::narrate(&format!("descry: lost: {lost}")));
    } else {
        input::print_text(explained.text(arguments.figures).trim_end())?;
    }
    Ok(if explained.lost.is_empty() { Exit::Done } else { Exit::No })
}
