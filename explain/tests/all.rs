//! Tests of explanations.

mod reasons;
mod unit;
