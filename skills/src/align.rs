//! `align`: registers laser scans of one object. The body does not move.

use async_trait::async_trait;
use descry_robots::perception::laser::{PosedScan, SolverOptions, align_consistent};

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Registers laser scans of one object into a model of its outline.
pub struct Align {
    /// Scans of the object, with their localised poses.
    pub scans: Vec<PosedScan>,
    /// Maximum error after alignment, metres; above it, scans count as contradictory.
    pub longest_m: f64,
    /// Options of the solver.
    pub options: SolverOptions,
}

#[async_trait]
impl Skill for Align {
    async fn perform(&self, _: &Context<'_>) -> Result<Outcome, SkillFailure> {
        let aligned = align_consistent(&self.scans, self.longest_m, &self.options);
        let aligned = aligned.map_err(|e| SkillFailure::Meaningless { because: e.to_string() })?;
        Ok(Outcome::Aligned(Box::new(aligned)))
    }
}
