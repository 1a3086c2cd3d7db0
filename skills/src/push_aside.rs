//! `(push-aside ?from ?what)`: pushes an object out of the way of what it hides.

use async_trait::async_trait;

use crate::skill::{Call, Context, Outcome, Skill, SkillFailure, arguments};

/// Pushes an object aside.
pub struct PushAside;

#[async_trait]
impl Skill for PushAside {
    fn name(&self) -> &'static str {
        "push-aside"
    }

    fn arity(&self) -> usize {
        2
    }

    async fn perform(&self, call: &Call, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let [_, what] = arguments(call)?;
        let pushed = context.robot.push_aside(context.push(what)?, &context.watch()).await?;
        Ok(Outcome::Pushed(pushed))
    }
}
