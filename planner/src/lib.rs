//! From a goal and a state to a timed plan.

mod attachment;
pub mod diagnostic;
pub mod ground;
pub mod pddl;
pub mod plan;
pub mod task;

pub use attachment::{
    Answer, Attachment, AttachmentError, Attachments, Call, CallError, CallKind, CallStatistics, FactValue,
    Level, Read, Reading,
};
pub use diagnostic::{Diagnostic, Findings, Label, Severity, Source, Span};
pub use plan::{Plan, Step};
pub use task::Task;
