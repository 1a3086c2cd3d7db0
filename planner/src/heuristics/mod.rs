//! Estimates of the cost to the goal.

mod intervals;
pub(crate) mod landmarks;
pub(crate) mod queue;
pub(crate) mod relaxed;
