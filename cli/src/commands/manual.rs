//! `descry completions SHELL` and `descry man`: shell completions and man pages.

use std::path::{Path, PathBuf};

use clap_complete::Shell;

use super::line::line;
use crate::commands::input;
use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry completions`.
#[derive(clap::Args)]
pub struct CompletionsArguments {
    /// The shell
    shell: Shell,
}

/// Arguments of `descry man`.
#[derive(clap::Args)]
pub struct ManArguments {
    /// Write a page for each command into this folder, instead of the main page to standard output
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn completions(arguments: &CompletionsArguments) -> Result<Exit, CommandError> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut line(), "descry", &mut script);
    input::print_text(String::from_utf8_lossy(&script).trim_end())?;
    Ok(Exit::Done)
}

pub(super) fn man(arguments: &ManArguments) -> Result<Exit, CommandError> {
    match &arguments.out {
        None => input::print_text(page(line())?.trim_end())?,
        Some(folder) => {
            let refused =
                |e: std::io::Error| CommandError::BadInput(format!("--out {}: {e}", folder.display()));
            std::fs::create_dir_all(folder).map_err(refused)?;
            let mut all = line();
            all.build();
            write(folder, &all, "descry")?;
        }
    }
    Ok(Exit::Done)
}

/// Writes the man pages of a command and its subcommands.
fn write(folder: &Path, command: &clap::Command, name: &str) -> Result<(), CommandError> {
    let path = folder.join(format!("{name}.1"));
    let text = page(command.clone().display_name(name.to_string()))?;
    let refused = |e: std::io::Error| CommandError::BadInput(format!("{}: {e}", path.display()));
    std::fs::write(&path, text).map_err(refused)?;
    for inner in command.get_subcommands().filter(|inner| inner.get_name() != "help") {
        write(folder, inner, &format!("{name}-{}", inner.get_name()))?;
    }
    Ok(())
}

fn page(command: clap::Command) -> Result<String, CommandError> {
    let mut text = Vec::new();
    clap_mangen::Man::new(command).render(&mut text).map_err(|e| CommandError::Bug(e.to_string()))?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}
