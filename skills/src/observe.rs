//! `(observe ?from ?on)`: turns the head to the surface and takes a view.

use async_trait::async_trait;

use crate::skill::{Call, Context, Outcome, Skill, SkillFailure, arguments};

/// Takes a view of a surface from where the body stands.
pub struct Observe;

#[async_trait]
impl Skill for Observe {
    fn name(&self) -> &'static str {
        "observe"
    }

    fn arity(&self) -> usize {
        2
    }

    async fn perform(&self, call: &Call, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let [_, on] = arguments(call)?;
        if let Some(centre) = context.surface(on)? {
            context.robot.look_at(centre, &context.watch()).await?;
        }
        let sensed = context.robot.sense(&context.watch()).await?;
        Ok(Outcome::Seen(Box::new(sensed)))
    }
}
