//! Belief in a situation: what may stand where, what a look would settle, how sure it is.

pub(crate) mod adrift;
mod confidence;
pub mod doubt;
pub(crate) mod hidden;
pub mod hypothesis;
pub mod obstacle;
mod sight;
pub mod unnoticed;
