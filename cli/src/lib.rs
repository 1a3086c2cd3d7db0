//! The command line, and the servers for editors and assistants.

mod child;
pub mod commands;
pub mod findings;
pub mod layout;
pub mod lsp;
mod mcp;
mod serve;
