//! Tests of the whole, and inputs for fuzzing the readers of external bytes.

pub mod fuzz;
