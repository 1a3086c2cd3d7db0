//! Heuristics: estimates of the cost to reach the goal.

#[doc(hidden)]
pub mod intervals;
pub(crate) mod landmark_cut;
#[doc(hidden)]
pub mod landmarks;
pub(crate) mod queue;
#[doc(hidden)]
pub mod relaxed;
