//! `descry lsp`: serves an editor.

use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry lsp`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Over standard input and output, which is the only way; many editors say so
    #[arg(long)]
    stdio: bool,
}

pub(super) fn run(_: &Arguments) -> Result<Exit, CommandError> {
    crate::lsp::serve()?;
    Ok(Exit::Done)
}
