//! `push-aside`: pushes an object away from the objects that it occludes.

use async_trait::async_trait;
use descry_robots::Push;

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Pushes an object aside.
pub struct PushAside {
    /// The push.
    pub push: Push,
}

#[async_trait]
impl Skill for PushAside {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        Ok(Outcome::Pushed(context.robot.push_aside(&self.push, &context.watch()).await?))
    }
}
