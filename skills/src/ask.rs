//! One request to the body, such as to read a sense, sweep the laser, push, or open a door.

use async_trait::async_trait;
use descry_robots::{Answer, Request};

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Sends a request to the body, and returns the body's answer.
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
