//! The command line, and what serves editors.

pub mod commands;
pub mod findings;
pub mod layout;
pub mod lsp;
