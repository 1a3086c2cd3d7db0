//! Belief of a situation: possible places of objects, information gain of views, and certainty.

pub(crate) mod adrift;
mod confidence;
pub mod doubt;
pub(crate) mod hidden;
pub mod hypothesis;
pub mod obstacle;
mod sight;
pub mod unnoticed;
