//! `observe`: turns the head and takes a view.

use async_trait::async_trait;
use descry_robots::nalgebra::Point3;

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Takes a view from the body's current pose.
pub struct Observe {
    /// Point to turn the head to, map frame, metres; `None` to leave the head as it is.
    pub at: Option<Point3<f64>>,
}

#[async_trait]
impl Skill for Observe {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        if let Some(point) = &self.at {
            context.robot.look_at(point, &context.watch()).await?;
        }
        let sensed = context.robot.sense(&context.watch()).await?;
        Ok(Outcome::Seen(Box::new(sensed)))
    }
}
