//! `align`: brings scans of one thing together. Nothing moves.

use async_trait::async_trait;
use descry_robots::perception::laser::{PosedScan, SolverOptions, align_consistent};

use crate::skill::{Context, Outcome, Skill, SkillFailure};

/// Brings scans together into the shape of the thing.
pub struct Align {
    /// The scans as localisation posed them.
    pub scans: Vec<PosedScan>,
    /// Beyond an error so long the scans contradict each other, metres.
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
