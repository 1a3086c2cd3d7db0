//! `observe`: turns the head and takes a view.

use async_trait::async_trait;
use descry_robots::nalgebra::Point3;

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Takes a view from the current pose.
pub struct Observe {
    /// Point for the head to turn to, map frame, metres; none: the head stays.
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
