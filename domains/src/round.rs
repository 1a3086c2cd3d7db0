//! Planning problem of one round.

use std::sync::Arc;

use descry_memory::RecordId;
use descry_planner::{Attachments, Source, Task};

use crate::situation::Situation;

/// Planning problem of one round, with its bound calls.
pub struct Round {
    /// Snapshot from which the calls are answered.
    pub situation: Arc<Situation>,
    /// The problem.
    pub task: Task,
    /// Bound calls.
    pub attachments: Attachments,
    /// The problem's text.
    pub problem: Source,
    /// Record of the problem.
    pub record: RecordId,
}
