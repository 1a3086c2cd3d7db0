//! Tests of single modules.

mod compared;
mod explain_looks;
mod explain_numbers;
mod explain_outcomes;
mod explain_plans;
mod explain_states;
mod explain_wording;
mod explain_wording_reasons;
mod keeping_remote;
mod report;
mod run;
mod saying;
mod shell;
mod weigh_steps;
