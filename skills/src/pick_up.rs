//! `pick-up`: grasps and lifts an object, and verifies the grasp.

use async_trait::async_trait;
use descry_robots::{Failure, Grasp};

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Grasps and lifts an object; fails if the hand is empty afterwards.
pub struct PickUp {
    /// Grasp to carry out.
    pub grasp: Grasp,
}

#[async_trait]
impl Skill for PickUp {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let grasped = context.robot.grasp(&self.grasp, &context.watch()).await?;
        let hand = context.robot.hand().await?;
        if !hand.holds {
            return Err(Failure::Slipped { because: "the hand is empty".into(), moved_m: 0.0 }.into());
        }
        Ok(Outcome::Grasped(grasped, hand))
    }
}
