//! The grounded task, which every search works on, and how it is made from the lifted one.

mod assemble;
mod atoms;
mod build;
mod earliest;
mod groups;
mod instantiate;
mod invariants;
mod metric;
mod normal;
mod obstacles;
mod pairs;
mod pddl3;
mod raw;
mod reach;
mod relaxed;
mod relevant;
mod rules;
mod statics;
mod task;
mod unused;
mod variables;

pub(crate) use build::ground_with;
pub use build::{GroundError, ground};
pub(crate) use earliest::Earliest;
pub(crate) use metric::{added, weights};
pub use obstacles::{MissingAtom, Obstacle};
pub(crate) use pairs::exclusive;
pub(crate) use pddl3::{WITNESS, compile};
pub use task::*;
