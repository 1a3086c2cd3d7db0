//! Tests of what is told of a run.

mod reasons;
mod unit;
