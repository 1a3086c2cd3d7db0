//! Integration tests of experiments, in one binary.

mod unit;
