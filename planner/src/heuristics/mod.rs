//! Estimates of the cost to the goal.

pub(crate) mod queue;
pub(crate) mod relaxed;
