//! `descry robot check BODY`: conformance test of a body.

use descry_domains::load::{DEFAULT, Domain};
use descry_robots::conformance;
use serde::Serialize;

use crate::commands::input;
use descry_agent::body;
use descry_agent::exit::{CommandError, Exit};

/// Operations on a body.
#[derive(clap::Subcommand)]
pub enum Arguments {
    /// Test a body: drives, looks, frames and stops, against the contract of bodies
    Check(CheckArguments),
}

/// Arguments of `descry robot check`.
#[derive(clap::Args)]
pub struct CheckArguments {
    /// The body: sim, recorded:DIR, program:COMMAND, or socket:HOST:PORT or socket:PATH
    robot: String,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    robot: String,
    kept: Vec<&'static str>,
    /// First failed check; `None` if all passed.
    broken: Option<Broken>,
    /// All failed checks.
    failed: Vec<Broken>,
}

#[derive(Clone, Serialize)]
struct Broken {
    check: &'static str,
    promise: &'static str,
    found: String,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let Arguments::Check(arguments) = arguments;
    let domain = Domain::load(DEFAULT).map_err(CommandError::bad_input)?;
    let body = body::open(&arguments.robot, None, 1, &domain)?;
    let runtime = input::runtime()?;
    let mut report = Report {
        robot: body.robot.description().name.clone(),
        kept: Vec::new(),
        broken: None,
        failed: Vec::new(),
    };
    input::narrate(&format!("checking \"{}\"", report.robot));
    for (check, begin) in conformance::CHECKS {
        match runtime.block_on(begin(&*body.robot)) {
            Ok(()) => {
                input::narrate(&format!("{check} ... ok"));
                report.kept.push(check);
            }
            Err(breach) => {
                input::narrate(&format!(
                    "{check} ... FAILED\n\n  every body: {}\n  this one:   {}\n",
                    breach.promise, breach.found
                ));
                report.failed.push(Broken { check, promise: breach.promise, found: breach.found });
            }
        }
    }
    report.broken = report.failed.first().cloned();
    let (kept, all) = (report.kept.len(), conformance::CHECKS.len());
    let verdict = if report.broken.is_none() { "ok" } else { "FAILED" };
    input::narrate(&format!("{verdict}: {kept} of {all} checks passed"));
    if arguments.json {
        input::print_json(&report)?;
    }
    Ok(if report.broken.is_none() { Exit::Done } else { Exit::No })
}
