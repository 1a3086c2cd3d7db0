//! The continual loop and the command line.

pub mod agent;
pub mod body;
pub mod commands;
pub mod exit;
pub mod experiment;
pub mod explain;
pub mod findings;
pub mod gantt;
pub mod keeping;
pub mod layout;
pub mod live;
pub mod lsp;
pub mod page;
pub mod picture;
pub mod report;
pub mod run;
pub mod stop;
pub mod weigh;
