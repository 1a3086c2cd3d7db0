//! The grounded task: what every search works on.

mod task;

pub use task::*;
