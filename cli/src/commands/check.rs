//! `descry check DOMAIN [PROBLEM]`: all findings at once, each drawn under the text; for the folder of a
//! domain, those of all its files, and the grounding of each predicate, call and action.

use std::path::PathBuf;

use descry_domains::load::Domain;
use descry_planner::Findings;
use serde_json::json;

use crate::commands::input;
use crate::findings;
use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry check`.
#[derive(clap::Args)]
pub struct Arguments {
    /// PDDL domain, or the folder of a domain (a built-in one by its name)
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
    findings: &'a Findings,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let path = &arguments.domain;
    if arguments.problem.is_none() && (path.is_dir() || !path.exists() && path.extension().is_none()) {
        return folder(&path.display().to_string(), arguments.json);
    }
    let domain = input::source(&arguments.domain)?;
    let problem = arguments.problem.as_deref().map(input::source).transpose()?;
    let findings = descry_planner::check(&domain, problem.as_ref());
    if arguments.json {
        input::print_json(&Report { errors: findings.has_errors(), findings: &findings })?;
    } else if findings.is_empty() {
        input::narrate("no finding");
    } else {
        input::narrate(input::drawn(&findings).trim_end());
    }
    Ok(if findings.has_errors() { Exit::No } else { Exit::Done })
}

/// Checks the whole folder of a domain.
fn folder(name: &str, json: bool) -> Result<Exit, CommandError> {
    let (findings, grounding) = findings::of_folder(Domain::load(name)).map_err(CommandError::bad_input)?;
    say(&findings, &grounding, json)
}

fn say(findings: &Findings, grounding: &[String], json: bool) -> Result<Exit, CommandError> {
    if json {
        let errors = findings.has_errors();
        input::print_json(&json!({ "errors": errors, "findings": findings, "grounding": grounding }))?;
    } else {
        if !grounding.is_empty() {
            input::print_fitted(&grounding.join("\n"))?;
        }
        let said = if findings.is_empty() { "no finding".to_string() } else { input::drawn(findings) };
        input::narrate(said.trim_end());
    }
    Ok(if findings.has_errors() { Exit::No } else { Exit::Done })
}
