//! Planning problem of one round.

use std::sync::Arc;

use descry_memory::RecordId;
use descry_planner::{Attachments, Source, Task};

use crate::situation::Situation;

/// The planning problem of one round, and what its calls are bound to.
pub struct Round {
    /// Snapshot from which the calls are answered.
    pub situation: Arc<Situation>,
    /// The problem.
    pub task: Task,
    /// Its calls, bound.
    pub attachments: Attachments,
    /// The problem's text.
    pub problem: Source,
    /// Its record.
    pub record: RecordId,
}
