//! `descry lsp`: serves an editor.

use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry lsp`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Use standard input and output: the only transport, accepted because many editors pass this option
    #[arg(long)]
    stdio: bool,
}

pub(super) fn run(_: &Arguments) -> Result<Exit, CommandError> {
    crate::lsp::serve()?;
    Ok(Exit::Done)
}
