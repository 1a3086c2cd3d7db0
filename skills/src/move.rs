//! `(move ?from ?to)`: drives along a route on the map.

use async_trait::async_trait;

use crate::skill::{Call, Context, Outcome, Skill, SkillFailure, arguments};

/// Drives from a pose to another.
pub struct Move;

#[async_trait]
impl Skill for Move {
    fn name(&self) -> &'static str {
        "move"
    }

    fn arity(&self) -> usize {
        2
    }

    async fn perform(&self, call: &Call, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let [_, to] = arguments(call)?;
        let driven = context.robot.drive_to(context.place(to)?, &context.watch()).await?;
        Ok(Outcome::Driven(driven))
    }
}
