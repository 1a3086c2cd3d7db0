#![doc = include_str!("../README.md")]

pub mod agent;
pub mod basis;
pub mod body;
#[doc(hidden)]
pub mod compared;
pub mod exit;
pub mod explain;
pub mod keeping;
pub mod replay;
pub mod report;
pub mod run;
pub mod saying;
pub mod shell;
pub mod standing;
pub mod stop;
pub mod template;
pub mod weigh;
pub mod why_not;
