//! `descry explain RUN`: why a run went as it did, in plain sentences.

use std::path::PathBuf;

use crate::commands::input;
use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry explain`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The run's folder
    run: PathBuf,
    /// With what each way to get further takes and gains, and what is counted for it
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
    let mut explained = descry_agent::explain::of(&record, &header, report.as_ref())?;
    explained.lost.extend(descry_agent::run::lost_of_header(folder));
    if arguments.json {
        input::print_json(&explained)?;
    } else {
        input::print_text(explained.text(arguments.figures).trim_end())?;
    }
    if let Some(damaged) = &damaged {
        input::narrate(&format!("descry: lost: {damaged}"));
    }
    let exit = input::lost(&record.recovery().faults);
    Ok(if damaged.is_some() || !explained.lost.is_empty() { Exit::No } else { exit })
}
