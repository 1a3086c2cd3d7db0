//! `read`: reads a sensor that is neither camera nor laser.

use async_trait::async_trait;

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Reads one of the body's senses.
pub struct Read {
    /// Its name.
    pub sense: String,
}

#[async_trait]
impl Skill for Read {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        Ok(Outcome::Read(context.robot.read(&self.sense, &context.watch()).await?))
    }
}
