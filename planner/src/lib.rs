//! From a goal and a state to a timed plan.

mod attachment;
mod calls;
pub mod diagnostic;
mod explain;
pub mod ground;
mod heuristics;
mod invariants;
mod landmarks;
pub mod pddl;
pub mod plan;
mod search;
mod solve;
pub mod task;
mod temporal;

pub use attachment::{
    Answer, Attachment, AttachmentError, Attachments, Call, CallError, CallKind, CallStatistics, FactValue,
    Level, Read, Reading,
};
pub use diagnostic::{Diagnostic, Findings, Label, Severity, Source, Span};
pub use explain::Explanation;
pub use pddl::check;
pub use plan::{Plan, Step};
pub use solve::{EPSILON_S, Options, Outcome, PlanError, Statistics, plan};
pub use task::Task;
