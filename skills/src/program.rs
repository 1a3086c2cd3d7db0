//! Action executed by an external program, in any language.

use std::sync::Arc;

use async_trait::async_trait;
use descry_robots::Failure;

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Answer of an external program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Asked {
    /// Success, with the program's message.
    Done(String),
    /// Failure.
    Failed {
        /// Reason of the failure.
        because: String,
        /// True if a retry may succeed.
        passing: bool,
    },
}

/// Runs an external program on a thread of its own, as it blocks until it answers or its time is over.
pub struct Program {
    /// Asks the program and waits for its answer.
    pub ask: Arc<dyn Fn() -> Asked + Send + Sync>,
}

#[async_trait]
impl Skill for Program {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let ask = Arc::clone(&self.ask);
        let asked = tokio::task::spawn_blocking(move || ask());
        tokio::select! {
            () = context.cancel.cancelled() => {
                Err(Failure::Cancelled { because: "the program was left alone".into() }.into())
            }
            said = asked => match said {
                Ok(Asked::Done(word)) => Ok(Outcome::Told(word)),
                Ok(Asked::Failed { because, passing }) => Err(SkillFailure::Program { because, passing }),
                Err(ended) => Err(SkillFailure::Program { because: ended.to_string(), passing: false }),
            },
        }
    }
}
