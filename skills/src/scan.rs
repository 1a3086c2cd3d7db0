//! `scan`: takes a sweep of the laser.

use async_trait::async_trait;

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Takes one sweep of the laser at the current pose.
pub struct Scan;

#[async_trait]
impl Skill for Scan {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let scanned = context.robot.scan(&context.watch()).await?;
        Ok(Outcome::Scanned(Box::new(scanned)))
    }
}
