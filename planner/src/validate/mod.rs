//! Validator: exact replay of every happening of a plan.
//!
//! Classical plans are replayed step by step; plans with times as happenings after PDDL 2.1 (Fox and Long 2003, section 8):
//! what happens at one time must not interfere, conditions over all hold strictly between start and end, durations
//! meet their bounds, timed literals happen by themselves, and the goal is judged after the last of them (PDDL 2.2; Edelkamp and
//! Hoffmann 2004).

mod after;
mod cause;
mod endless;
mod monitor;
mod replay;
mod timeline;
mod trajectory;
mod verdict;

pub use after::after;
pub use cause::{Cause, Moment, Unmet};
pub use endless::endless;
pub use monitor::{Broken, monitor};
pub use timeline::SEPARATION_S;
pub use verdict::{Verdict, validate, validate_until};
