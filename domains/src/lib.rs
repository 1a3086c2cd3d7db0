//! Words and meanings: PDDL text, what may be said, and the Rust that grounds the symbols.

pub mod attachments;
pub mod candidates;
pub mod doubt;
mod facts;
pub mod goal;
pub mod load;
pub mod obstacle;
pub mod situation;

pub use descry_planner;
