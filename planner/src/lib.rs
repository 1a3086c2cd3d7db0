//! From a goal and a state to a timed plan.

mod attachment;
pub mod ground;

pub use attachment::{
    Answer, Attachment, AttachmentError, Attachments, Call, CallError, CallKind, CallStatistics, FactValue,
    Level, Read, Reading,
};
