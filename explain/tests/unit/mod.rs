//! Tests of single modules.

mod looks;
mod numbers;
mod outcomes;
mod plans;
mod states;
mod wording;
