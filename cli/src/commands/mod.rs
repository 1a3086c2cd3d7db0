//! The commands: one file each, and the list of them.

mod check;
mod experiment;
mod explain;
mod find;
#[doc(hidden)]
pub mod fitted;
mod fmt;
mod goals;
mod input;
#[doc(hidden)]
pub mod keeping;
mod limits;
#[doc(hidden)]
pub mod line;
mod live;
mod lsp;
mod manual;
mod mcp;
mod memory;
#[doc(hidden)]
pub mod name;
mod new;
mod plan;
#[doc(hidden)]
pub mod recognise;
mod replay;
mod robot;
#[doc(hidden)]
pub mod runs;
mod serve;
mod show;
mod validate;

use clap::Subcommand;

pub use input::{is_coloured, narrate, narrate_fitted};
pub use limits::heed_limits;
pub use line::asked;

use descry_agent::exit::{CommandError, Exit};
use descry_agent::stop::Stop;

/// What descry can be asked to do.
#[derive(Subcommand)]
pub enum Command {
    /// Find something: short for `do "find THING"`
    Find(find::FindArguments),
    /// Pursue a goal, in the words of a domain
    Do(find::DoArguments),
    /// Write a small domain of your own into a folder: it runs, and is there to be changed
    New(new::Arguments),
    /// List what may be said to a domain
    Goals(goals::Arguments),
    /// Plan: any PDDL domain and problem
    Plan(plan::Arguments),
    /// Check a plan against its domain and problem
    Validate(validate::Arguments),
    /// Read a domain (and a problem) and show every finding under its text
    Check(check::Arguments),
    /// Lay out PDDL and plans: comments stay, and what is read is the same
    Fmt(fmt::Arguments),
    /// Serve editors: findings, hover, definitions, completion and layout of PDDL, plans and domain.toml (LSP, standard input and output)
    Lsp(lsp::Arguments),
    /// Serve assistants that call tools: check, plan, validate, run in simulation, explain and more (MCP, standard input and output)
    Mcp(mcp::Arguments),
    /// Stay: take goals over HTTP, pursue one after the other, urgent ones first, and remember what was seen
    Serve(serve::Arguments),
    /// Find the table and the objects in point clouds (PCD, PLY)
    Recognise(recognise::Arguments),
    /// Carry out a batch of runs: tables with intervals, plots and a page; goes on where it was cut off
    Experiment(experiment::Arguments),
    /// A body by itself: check that it keeps the promises of bodies
    #[command(subcommand)]
    Robot(robot::Arguments),
    /// Show what happened in a run
    Show(show::Arguments),
    /// Say why a run went as it did: why each plan, why this and not that, what the verdict rests on
    Explain(explain::Arguments),
    /// Live through a run again from its record: the same percepts, beliefs and verdict, or where they part
    Replay(replay::Arguments),
    /// List the runs
    Runs(runs::Arguments),
    /// A record by itself: show, query, verify, export
    #[command(subcommand)]
    Memory(memory::Arguments),
    /// Say what a thing is called that a run has learned; without names, list what was learned
    Name(name::Arguments),
    /// Write a record into one MCAP file: short for `memory export`
    Export(memory::ExportArguments),
    /// Print what lets a shell complete commands and options
    Completions(manual::CompletionsArguments),
    /// Print the man page, or write one for each command
    Man(manual::ManArguments),
}

impl Command {
    /// Whether it ends in order when it is asked to stop; others may be ended at any time.
    pub fn can_be_stopped(&self) -> bool {
        matches!(self, Self::Find(_) | Self::Do(_) | Self::Experiment(_))
    }
}

/// Carries a command out; `stop` ends it early, if it can be stopped.
///
/// # Errors
/// [`CommandError`] with its text ready to be shown.
pub fn run(command: &Command, stop: &Stop) -> Result<Exit, CommandError> {
    match command {
        Command::Find(arguments) => find::find(arguments, stop),
        Command::Do(arguments) => find::pursue(arguments, stop),
        Command::Goals(arguments) => goals::run(arguments),
        Command::Plan(arguments) => plan::run(arguments),
        Command::Validate(arguments) => validate::run(arguments),
        Command::New(arguments) => new::run(arguments),
        Command::Check(arguments) => check::run(arguments),
        Command::Fmt(arguments) => fmt::run(arguments),
        Command::Lsp(arguments) => lsp::run(arguments),
        Command::Mcp(arguments) => mcp::run(arguments),
        Command::Serve(arguments) => serve::run(arguments),
        Command::Recognise(arguments) => recognise::run(arguments),
        Command::Experiment(arguments) => experiment::run(arguments, stop),
        Command::Robot(arguments) => robot::run(arguments),
        Command::Show(arguments) => show::run(arguments),
        Command::Explain(arguments) => explain::run(arguments),
        Command::Replay(arguments) => replay::run(arguments),
        Command::Runs(arguments) => runs::run(arguments),
        Command::Memory(arguments) => memory::run(arguments),
        Command::Name(arguments) => name::run(arguments),
        Command::Export(arguments) => memory::export(arguments),
        Command::Completions(arguments) => manual::completions(arguments),
        Command::Man(arguments) => manual::man(arguments),
    }
}
