//! `[search-cost ?on]`: penalty in seconds for a view in vain, added to the plan's first view of a
//! surface: (1 - p) / p times the time of drive and view, where p is the probability that this view
//! finds the target. Drive, view and penalty then sum to time / p, and visiting surfaces in ascending
//! order of that sum is optimal if each is viewed once. Zero if all surfaces must be viewed.

use descry_planner::{Answer, Call, CallError};
use serde::{Deserialize, Serialize};

use crate::ability::argument;
use crate::situation::Situation;

/// Maximum penalty, seconds, for a view that would find almost nothing.
const MOST_S: f64 = 10_000.0;

/// Expected result and cost of a plan's first view of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FirstLook {
    /// Probability that the view finds the target, 0 to 1.
    pub finds: f64,
    /// Duration of drive and view, seconds.
    pub takes_s: f64,
}

impl Situation {
    /// Data of a plan's first view of a surface; `None` if views in vain have no penalty.
    pub fn first_look(&self, on: usize) -> Option<FirstLook> {
        let is_open = |n: &usize| self.confidence(*n) < self.threshold;
        let mut open: Vec<usize> = (0..self.things.len()).filter(is_open).collect();
        // What has been found is looked for in vain elsewhere, too.
        if open.is_empty() {
            open = (0..self.things.len()).collect();
        }
        if open.is_empty() || !self.kinds.is_empty() {
            return None;
        }
        let finds = |&n: &usize| self.doubt_about(n).most_settled_on(self, on) + self.presence(n, on);
        let finds = open.iter().map(finds).fold(0.0, f64::max).clamp(1e-6, 1.0);
        Some(FirstLook { finds, takes_s: self.going_there_s(on) })
    }

    /// Penalty for a plan's first view of a surface, seconds; 0 if views in vain have none.
    pub(crate) fn in_vain_s(&self, on: usize) -> f64 {
        let first = self.first_look(on);
        first.map_or(0.0, |FirstLook { finds, takes_s }| ((1.0 - finds) / finds * takes_s).min(MOST_S))
    }
}

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let on = situation.surface(argument(call, 0)?)?;
    let is_begun = situation.planned_looks(call).iter().any(|look| look.1 == on);
    Ok(Answer::Number(if is_begun { 0.0 } else { situation.in_vain_s(on) }))
}
