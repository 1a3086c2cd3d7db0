//! Tests of single modules.

mod compared;
mod keeping_remote;
mod numbers;
mod report;
mod run;
mod shell;
mod weigh_steps;
