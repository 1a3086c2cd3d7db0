//! `descry mcp`: serves assistants that call tools.

use std::path::PathBuf;

use descry_agent::exit::{CommandError, Exit};

use crate::mcp::{self, Served};

/// Arguments of `descry mcp`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folder that runs are written to, and below which callers may name files
    #[arg(long, value_name = "DIR", default_value = ".")]
    folder: PathBuf,
    /// Let callers pursue goals with this body too, as in `descry do --robot`; without it, in simulation alone
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
