#![doc = include_str!("../README.md")]

#[doc(hidden)]
pub mod attachment;
#[doc(hidden)]
pub mod calls;
#[doc(hidden)]
pub mod classical;
#[doc(hidden)]
pub mod clauses;
pub mod diagnostic;
mod explain;
pub mod ground;
mod grouped;
#[doc(hidden)]
pub mod heuristics;
#[doc(hidden)]
pub mod memory;
#[doc(hidden)]
pub mod model;
mod outcome;
pub mod pddl;
pub mod plan;
mod problem;
#[doc(hidden)]
pub mod search;
pub mod semantics;
mod solve;
pub mod state;
pub mod task;
mod technique;
#[doc(hidden)]
pub mod temporal;
#[doc(hidden)]
pub mod validate;

pub use attachment::{
    Answer, Attachment, AttachmentError, Attachments, Call, CallError, CallKind, CallStatistics, FactValue,
    Level, Read, Reading,
};
pub use diagnostic::{Diagnostic, Findings, Label, Severity, Source, Span};
pub use explain::{Explanation, NoPlan, Refusal};
pub use ground::Regrounded;
pub use outcome::{Options, Outcome, PlanError, Statistics};
pub use pddl::{check, nearest};
pub use plan::{EPSILON_S, Plan, Step, number_text};
pub use problem::{Misnamed, Problem};
pub use search::portfolio;
pub use semantics::Semantics;
pub use solve::optimal::plan_optimally;
pub use solve::plan;
pub use state::State;
pub use task::Task;
pub use technique::{TECHNIQUES, Technique, Without};
pub use validate::{Broken, Cause, Moment, SEPARATION_S, Unmet, Verdict, after, endless, monitor, validate};
