//! One request to the body: reads a sense, sweeps the laser, pushes, opens a door.

use async_trait::async_trait;
use descry_robots::{Answer, Request};

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Asks the body for one thing, and returns its answer.
pub struct Ask(pub Request);

#[async_trait]
impl Skill for Ask {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        match self.0.ask(context.robot, &context.watch()).await.0 {
            Answer::Failed(failure) => Err(failure.into()),
            answer => Ok(Outcome::Answered(Box::new(answer))),
        }
    }
}
