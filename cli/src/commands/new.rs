//! `descry new DIR`: a small working domain, as a starting point.

use std::path::PathBuf;

use descry_agent::shell;
use descry_agent::template::write_domain;
use serde_json::json;

use crate::commands::input;
use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry new`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The domain's folder; its last part is the domain's name
    folder: PathBuf,
    /// Print what was written as one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let folder = &arguments.folder;
    let written = write_domain(folder)?;
    if arguments.json {
        input::print_json(&json!({ "folder": folder, "files": written }))?;
    } else {
        let shown = shell::word(&folder.display().to_string());
        let next = [
            format!("  descry check {shown}"),
            format!("  descry goals --domain {shown}"),
            format!("  descry find mug --domain {shown}"),
        ];
        input::print_text(&format!("{}\n\nnext:\n{}", written.join("\n"), next.join("\n")))?;
    }
    Ok(Exit::Done)
}
