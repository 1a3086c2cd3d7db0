//! `read`: reads a sensor other than camera and laser.

use async_trait::async_trait;

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Reads a sensor of the body.
pub struct Read {
    /// Name of the sensor.
    pub sense: String,
}

#[async_trait]
impl Skill for Read {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        Ok(Outcome::Read(context.robot.read(&self.sense, &context.watch()).await?))
    }
}
