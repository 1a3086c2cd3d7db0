//! From a goal and a state to a timed plan.

mod attachment;
mod calls;
pub mod diagnostic;
mod explain;
pub mod ground;
mod grouped;
mod heuristics;
mod invariants;
mod landmarks;
mod memory;
mod model;
pub mod pddl;
pub mod plan;
mod search;
pub mod semantics;
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
pub use pddl::check;
pub use plan::{Plan, Step};
pub use semantics::Semantics;
pub use solve::{EPSILON_S, Options, Outcome, PlanError, Statistics, plan};
pub use state::State;
pub use task::Task;
pub use validate::{Broken, SEPARATION_S, Verdict, after, monitor, validate};
