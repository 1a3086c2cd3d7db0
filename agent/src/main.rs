//! `descry`: the command line, an interface that scripts depend on.

use std::process::ExitCode;

use clap::Parser;
use descry_agent::commands::{self, Command};
use descry_agent::exit::Exit;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;

/// Merging asks for tens of megabytes a look and gives them back: one that keeps them for the next is quicker.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Finds things by looking carefully: plans where to look, drives there, records, merges, recognises, and looks again.
#[derive(Parser)]
#[command(name = "descry", version, about, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes:
  0   achieved, plan found, valid, no finding
  1   an honest no: not found after every useful view, plan invalid, findings
  2   bad input or usage
  3   proven unsolvable
  4   out of time or memory
  5   the robot or a store failed for good
  70  a bug of descry";

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|panic| {
        commands::narrate(&format!(
            "descry: {panic}\n  this is a bug of descry; please report it with the command and its input"
        ));
    }));
    warn_people();
    let outcome = std::panic::catch_unwind(|| {
        let arguments = Arguments::parse();
        commands::run(&arguments.command)
    });
    match outcome {
        Ok(Ok(exit)) => exit.into(),
        Ok(Err(error)) => {
            commands::narrate(&format!("descry: {error}"));
            error.exit().into()
        }
        Err(_) => Exit::Bug.into(),
    }
}

/// Lets warnings reach people, on standard error; `RUST_LOG` asks for more or less.
fn warn_people() {
    let filter = EnvFilter::builder().with_default_directive(LevelFilter::WARN.into()).from_env_lossy();
    let lines = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    lines.with_ansi(commands::is_coloured()).without_time().with_target(false).init();
}
