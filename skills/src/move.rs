//! `move`: drives along a route on the map.

use async_trait::async_trait;
use descry_robots::Place;

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Drives to a destination on the map.
pub struct Move {
    /// Destination on the map.
    pub to: Place,
}

#[async_trait]
impl Skill for Move {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        Ok(Outcome::Driven(context.robot.drive_to(&self.to, &context.watch()).await?))
    }
}
