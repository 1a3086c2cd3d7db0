//! `descry check DOMAIN [PROBLEM]`: every finding at once, drawn under the text.

use std::path::PathBuf;

use crate::commands::input;
use crate::exit::{CommandError, Exit};

/// Arguments of `descry check`.
#[derive(clap::Args)]
pub struct Arguments {
    /// PDDL domain
    domain: PathBuf,
    /// PDDL problem
    problem: Option<PathBuf>,
    /// Print the findings as one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    errors: bool,
    findings: &'a [descry_planner::Diagnostic],
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let domain = input::source(&arguments.domain)?;
    let problem = arguments.problem.as_deref().map(input::source).transpose()?;
    let findings = descry_planner::check(&domain, problem.as_ref());
    if arguments.json {
        input::print_json(&Report { errors: findings.has_errors(), findings: &findings.list })?;
    } else if findings.is_empty() {
        eprintln!("no finding");
    } else {
        eprint!("{}", input::drawn(&findings));
    }
    Ok(if findings.has_errors() { Exit::No } else { Exit::Done })
}
