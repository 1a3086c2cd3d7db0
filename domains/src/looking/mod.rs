//! Viewpoints, and the update of the belief from views.

pub mod candidates;
pub mod change;
mod consistent;
mod discover;
pub mod looks;
pub(crate) mod merging;
pub mod perceive;
pub(crate) mod placing;
pub(crate) mod recording;
#[doc(hidden)]
pub mod vanished;
