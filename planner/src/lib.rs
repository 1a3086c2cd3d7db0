//! From a goal and a state to a timed plan.

mod attachment;
mod calls;
mod classical;
pub mod diagnostic;
mod explain;
pub mod ground;
mod grouped;
mod heuristics;
mod memory;
mod model;
mod outcome;
pub mod pddl;
pub mod plan;
mod search;
pub mod semantics;
#[cfg(test)]
mod small;
mod solve;
pub mod state;
pub mod task;
mod temporal;
mod validate;

pub use attachment::{
    Answer, Attachment, AttachmentError, Attachments, Call, CallError, CallKind, CallStatistics, FactValue,
    Level, Read, Reading,
};
pub use diagnostic::{Diagnostic, Findings, Label, Severity, Source, Span};
pub use explain::Explanation;
pub use outcome::{Options, Outcome, PlanError, Statistics};
pub use pddl::check;
pub use plan::{EPSILON_S, Plan, Step};
pub use semantics::Semantics;
pub use solve::plan;
pub use state::State;
pub use task::Task;
pub use validate::{Broken, SEPARATION_S, Verdict, after, monitor, validate};
