//! `open-door`: opens a door from beside it.

use async_trait::async_trait;

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Opens a door.
pub struct OpenDoor {
    /// Name of the door in the map.
    pub door: String,
}

#[async_trait]
impl Skill for OpenDoor {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        Ok(Outcome::Opened(context.robot.open_door(&self.door, &context.watch()).await?))
    }
}
