//! `descry validate DOMAIN PROBLEM PLAN`: whether a plan reaches the goal, and if not, which step fails and why.

use std::path::PathBuf;

use descry_planner::{Plan, Task, Verdict, number_text};

use crate::commands::input::{self, AttachmentArguments};
use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry validate`.
#[derive(clap::Args)]
pub struct Arguments {
    /// PDDL domain
    domain: PathBuf,
    /// PDDL problem
    problem: PathBuf,
    /// Plan in IPC form
    plan: PathBuf,
    /// Print the verdict as one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    attachments: AttachmentArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let (domain, problem) = (input::source(&arguments.domain)?, input::source(&arguments.problem)?);
    let task = Task::read(&domain, &problem).map_err(|f| CommandError::BadInput(input::drawn(&f)))?;
    let plan =
        Plan::read(&input::source(&arguments.plan)?).map_err(|f| CommandError::BadInput(input::drawn(&f)))?;
    let attachments = arguments.attachments.bind(&arguments.domain, &task)?;
    let verdict = descry_planner::validate(&task, &attachments, &plan);
    if arguments.json {
        input::print_json(&verdict)?;
    } else {
        input::print_text(&told(&verdict))?;
    }
    Ok(if verdict.valid { Exit::Done } else { Exit::No })
}

fn told(verdict: &Verdict) -> String {
    let number = |name: &str, value: Option<f64>| {
        value.map_or(String::new(), |value| format!(", {name} {}", number_text(value)))
    };
    let numbers = number("cost", verdict.cost)
        + &number("makespan", verdict.makespan)
        + &number("metric", verdict.metric);
    match &verdict.reason {
        Some(reason) => format!("not valid: {reason}"),
        None => format!("valid{numbers}"),
    }
}
