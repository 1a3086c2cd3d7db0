//! Planning problem of one round.

use std::sync::Arc;

use descry_memory::RecordId;
use descry_planner::{Attachments, Source, Task};

use crate::situation::Situation;

/// Planning problem of one round, with its bound calls.
pub struct Round {
    /// Snapshot from which the calls are answered.
    pub situation: Arc<Situation>,
    /// Parsed problem.
    pub task: Task,
    /// Attachments that answer the problem's calls.
    pub attachments: Attachments,
    /// PDDL text of the problem.
    pub problem: Source,
    /// Id of the recorded problem.
    pub record: RecordId,
}
