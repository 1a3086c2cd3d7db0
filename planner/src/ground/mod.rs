//! Grounded task, the input of all searches, and its construction from the lifted task.

mod assemble;
mod atoms;
mod build;
mod earliest;
mod groups;
mod instantiate;
#[doc(hidden)]
pub mod invariants;
mod metric;
mod normal;
mod obstacles;
#[doc(hidden)]
pub mod pairs;
mod pddl3;
mod raw;
mod reach;
mod relaxed;
mod relevant;
mod restate;
mod rules;
mod statics;
#[doc(hidden)]
pub mod task;
mod unused;
mod variables;

pub use build::{GroundError, ground};
pub(crate) use build::{Keep, ground_with};
pub(crate) use earliest::Earliest;
pub(crate) use metric::{added, weights};
pub use obstacles::{MissingAtom, Obstacle};
pub use pairs::exclusive;
pub(crate) use pddl3::{WITNESS, compile};
pub use restate::Regrounded;
pub(crate) use restate::Restated;
pub use task::*;
