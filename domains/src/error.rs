//! Errors that end a run.

use descry_planner::PlanError;
use descry_skills::Outcome;

/// Error that ends a run.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// The store failed for good.
    #[error("{0}")]
    Store(#[from] descry_memory::Error),
    /// The domain cannot be used; the text points at the place and suggests a remedy.
    #[error("{0}")]
    Domain(String),
    /// Internal error of descry.
    #[error("{0}")]
    Bug(String),
}

impl WorldError {
    /// Error of a skill that returned another skill's outcome.
    pub(crate) fn strange(outcome: &Outcome) -> Self {
        WorldError::Bug(format!("a skill came back with {outcome:?}"))
    }

    /// Error of the planner: an unreadable task, or a failed attachment.
    pub fn of_planner(error: &PlanError) -> Self {
        error.findings().map_or_else(|| Self::Domain(error.to_string()), |f| Self::Domain(f.render(false)))
    }
}
