//! `sweep`: the fixed tour of Niemueller et al.: from the nearest pose all the way around the ring,
//! until the goal is achieved or every pose has been used.

use super::policy::{Look, Policy, best};
use crate::situation::Situation;

pub(super) struct Sweep;

impl Policy for Sweep {
    fn choose(&mut self, situation: &Situation, looks: &[Look]) -> Option<Look> {
        // Candidates are numbered around the ring. Where the body stands first is not on the ring of a body that can go anywhere.
        let elsewhere: Vec<Look> = looks.iter().filter(|look| look.from != situation.at).copied().collect();
        if situation.observed.is_empty() {
            return best(&elsewhere, |look| -look.travel_s).or_else(|| looks.first().copied());
        }
        looks
            .iter()
            .find(|look| look.from >= situation.at)
            .or_else(|| looks.iter().find(|look| look.from > 0))
            .or(looks.first())
            .copied()
    }

    fn looks_at_all(&self) -> bool {
        true
    }
}
