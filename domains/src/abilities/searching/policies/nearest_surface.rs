//! `nearest-surface`: optimistic, nearest first. Goes to the nearest surface with open doubt, looks
//! until no view there is worthwhile, then goes to the next.

use super::policy::{Look, Policy, best};
use crate::situation::Situation;

#[derive(Default)]
pub(super) struct NearestSurface {
    /// Index of the surface that is being searched.
    on: Option<usize>,
}

impl Policy for NearestSurface {
    fn choose(&mut self, situation: &Situation, looks: &[Look]) -> Option<Look> {
        let left = situation.doubts().iter().map(|doubt| doubt.remaining()).fold(0.0, f64::max);
        let is_worth_it = |look: &&Look| look.gain * left >= situation.thresholds.remaining;
        let worth: Vec<Look> = looks.iter().filter(is_worth_it).copied().collect();
        let here: Vec<Look> = worth.iter().filter(|look| Some(look.on) == self.on).copied().collect();
        let look = best(&here, |look| look.gain)
            .or_else(|| best(&worth, |look| -look.travel_s))
            .or_else(|| best(looks, |look| look.gain))?;
        self.on = Some(look.on);
        Some(look)
    }
}
