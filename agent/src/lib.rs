//! The continual loop.

pub mod experiment;
