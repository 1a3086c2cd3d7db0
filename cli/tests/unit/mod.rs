//! Tests of single modules.

mod commands_fitted;
mod commands_keeping;
mod commands_line;
mod commands_name;
mod commands_recognise;
mod commands_runs;
mod lsp_keys;
mod lsp_texts;
