//! Tests of the whole, and what fuzzing feeds the readers of bytes from outside.

pub mod fuzz;
