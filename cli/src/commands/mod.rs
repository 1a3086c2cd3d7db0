//! The commands: one file each, and their list.

mod check;
mod experiment;
mod explain;
mod find;
#[doc(hidden)]
pub mod fitted;
mod fmt;
mod goals;
mod import;
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

/// Commands of descry.
#[derive(Subcommand)]
pub enum Command {
    /// Find something: short for `do "find THING"`
    Find(find::FindArguments),
    /// Pursue a goal in the words of a domain
    Do(find::DoArguments),
    /// Create a small working domain in a folder, as a starting point
    New(new::Arguments),
    /// List the goal phrases of a domain
    Goals(goals::Arguments),
    /// Plan for any PDDL domain and problem
    Plan(plan::Arguments),
    /// Check a plan against its domain and problem
    Validate(validate::Arguments),
    /// Check a domain (and a problem) and show every finding under its text
    Check(check::Arguments),
    /// Format PDDL and plans: comments stay, and the meaning is unchanged
    Fmt(fmt::Arguments),
    /// Serve editors: findings, hover, definitions, completion and formatting of PDDL, plans and domain.toml
    /// (LSP, standard input and output)
    Lsp(lsp::Arguments),
    /// Serve assistants with tools: check, plan, validate, run in simulation, explain and more (MCP, standard
    /// input and output)
    Mcp(mcp::Arguments),
    /// Run as a service: accept goals over HTTP, pursue one after the other, urgent ones first, and remember
    /// sightings
    Serve(serve::Arguments),
    /// Find the table and the objects in point clouds (PCD, PLY, NPY, LAS, text)
    Recognise(recognise::Arguments),
    /// Import a recording in a published layout: bags of ROS 2, TUM, BOP, ScanNet, Redwood and others
    Import(import::Arguments),
    /// Run a batch of runs: tables with intervals, plots and a page; resumable
    Experiment(experiment::Arguments),
    /// Test a body: check that it fulfils the contract of bodies
    #[command(subcommand)]
    Robot(robot::Arguments),
    /// Show the events of a run
    Show(show::Arguments),
    /// Explain a run: the reason for each plan, its alternatives, and the evidence behind the verdict
    Explain(explain::Arguments),
    /// Replay a run from its record, and compare percepts, beliefs and verdict
    Replay(replay::Arguments),
    /// List the runs
    Runs(runs::Arguments),
    /// Inspect a record: show, query, verify, export
    #[command(subcommand)]
    Memory(memory::Arguments),
    /// Rename an object that runs have learned; without names, list the learned objects
    Name(name::Arguments),
    /// Export a record as one MCAP file: short for `memory export`
    Export(memory::ExportArguments),
    /// Print completions of commands and options for a shell
    Completions(manual::CompletionsArguments),
    /// Print the man page, or write one for each command
    Man(manual::ManArguments),
}

impl Command {
    /// True if the command ends in order when stopped; others may be killed at any time.
    pub fn can_be_stopped(&self) -> bool {
        matches!(self, Self::Find(_) | Self::Do(_) | Self::Experiment(_) | Self::Plan(_))
    }
}

/// Runs a command; `stop` ends it early, if it can be stopped.
///
/// # Errors
/// [`CommandError`] with its text ready for display.
pub fn run(command: &Command, stop: &Stop) -> Result<Exit, CommandError> {
    match command {
        Command::Find(arguments) => find::find(arguments, stop),
        Command::Do(arguments) => find::pursue(arguments, stop),
        Command::Goals(arguments) => goals::run(arguments),
        Command::Plan(arguments) => plan::run(arguments, stop),
        Command::Validate(arguments) => validate::run(arguments),
        Command::New(arguments) => new::run(arguments),
        Command::Check(arguments) => check::run(arguments),
        Command::Fmt(arguments) => fmt::run(arguments),
        Command::Lsp(arguments) => lsp::run(arguments),
        Command::Mcp(arguments) => mcp::run(arguments),
        Command::Serve(arguments) => serve::run(arguments),
        Command::Recognise(arguments) => recognise::run(arguments),
        Command::Import(arguments) => import::run(arguments),
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
