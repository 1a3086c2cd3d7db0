//! `circle`: drives around an object through waypoints.

use async_trait::async_trait;
use descry_robots::{Driven, Place};

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Drives through waypoints, all within one time limit; the last is the destination.
pub struct Circle {
    /// Waypoints in order, without the current pose.
    pub way: Vec<Place>,
}

#[async_trait]
impl Skill for Circle {
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let mut whole: Option<Driven> = None;
        for place in &self.way {
            let so_far = whole.as_ref().map_or(0.0, |d| d.duration_s);
            let mut watch = context.watch();
            watch.time_limit_s -= so_far;
            let leg = context.robot.drive_to(place, &watch).await?;
            let distance_m = leg.distance_m + whole.as_ref().map_or(0.0, |d| d.distance_m);
            whole = Some(Driven { distance_m, duration_s: leg.duration_s + so_far, ..leg });
        }
        let nowhere = || SkillFailure::Meaningless { because: "there is no way to go".into() };
        whole.map(Outcome::Driven).ok_or_else(nowhere)
    }
}
