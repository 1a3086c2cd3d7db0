//! `model`: brings looks at one thing together and grows a model of it. Nothing moves.

use std::sync::Arc;

use async_trait::async_trait;
use descry_robots::nalgebra::{Unit, Vector3};
use descry_robots::perception::View;
use descry_robots::perception::learning::{Keyframe, LearnOptions, LearnedModel, learn, register};

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Brings looks together into a model of what the first shows.
pub struct Model {
    /// The looks, as localisation placed them.
    pub views: Vec<Arc<View>>,
    /// The pixels of the thing in the first.
    pub mask: Vec<bool>,
    /// Up in the map, if it is known.
    pub up: Option<Unit<Vector3<f64>>>,
    /// Returns farther than this are not used, metres.
    pub range_m: f64,
    /// Options of learning.
    pub options: LearnOptions,
}

/// Result of learning a model.
#[derive(Debug)]
pub struct Modelled {
    /// Pose and contents of each look; those that do not fit the others are left out.
    pub keyframes: Vec<Keyframe>,
    /// The model, or why there is none.
    pub model: Result<LearnedModel, String>,
}

#[async_trait]
impl Skill for Model {
    async fn perform(&self, _: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let views: Vec<View> = self.views.iter().map(|view| View::clone(view)).collect();
        let keyframes = register(&views, self.up, self.range_m)
            .map_err(|e| SkillFailure::Meaningless { because: e.to_string() })?;
        let model = learn(&views, &keyframes, &self.mask, &self.options).map_err(|e| e.to_string());
        Ok(Outcome::Modelled(Box::new(Modelled { keyframes, model })))
    }
}
