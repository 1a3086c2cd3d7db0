//! `model`: registers views of one object and learns a model of it. The body does not move.

use std::sync::Arc;

use async_trait::async_trait;
use descry_robots::nalgebra::{Unit, Vector3};
use descry_robots::perception::View;
use descry_robots::perception::learning::{Keyframe, LearnOptions, LearnedModel, learn, register};

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Learns a model of an object that is marked in the first view.
pub struct Model {
    /// Views of the object, with their localised poses.
    pub views: Vec<Arc<View>>,
    /// For each pixel of the first view, true if it belongs to the object.
    pub mask: Vec<bool>,
    /// Up direction in the map frame; `None` if unknown.
    pub up: Option<Unit<Vector3<f64>>>,
    /// Maximum range of the measurements used, metres.
    pub range_m: f64,
    /// Options of learning.
    pub options: LearnOptions,
}

/// Result of learning a model.
#[derive(Debug)]
pub struct Modelled {
    /// Registered pose of each view; inconsistent views are marked as unused.
    pub keyframes: Vec<Keyframe>,
    /// Learned model, or the reason why none was learned.
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
