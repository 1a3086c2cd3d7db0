//! `put-down`: places the held object.

use async_trait::async_trait;
use descry_robots::{Failure, Placing, Request};

use crate::ask::Ask;
use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Places the held object; fails if the hand is empty.
pub struct PutDown {
    /// Placement to carry out.
    pub placing: Placing,
}

#[async_trait]
impl Skill for PutDown {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let hand = context.robot.hand().await?;
        if !hand.holds {
            return Err(Failure::Slipped { because: "the hand is empty".into(), moved_m: 0.0 }.into());
        }
        Ask(Request::Place(self.placing)).perform(context).await
    }
}
