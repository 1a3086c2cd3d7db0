//! `descry mcp`: serves assistants over the Model Context Protocol.

use std::path::PathBuf;

use descry_agent::exit::{CommandError, Exit};

use crate::mcp::{self, Served};

/// Arguments of `descry mcp`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folder for runs; callers may only name files below it
    #[arg(long, value_name = "DIR", default_value = ".")]
    folder: PathBuf,
    /// Let callers also use this body, as in `descry do --robot`; without it, simulation only
    #[arg(long, value_name = "ROBOT")]
    robot: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let folder = arguments.folder.canonicalize().map_err(|e| {
        CommandError::bad_input(format!("{}: {e}\n  expected a folder for runs", arguments.folder.display()))
    })?;
    let served = Served { folder, robot: arguments.robot.clone() };
    mcp::serve(served).map_err(|e| CommandError::Broken(format!("standard input cannot be read: {e}")))?;
    Ok(Exit::Done)
}
