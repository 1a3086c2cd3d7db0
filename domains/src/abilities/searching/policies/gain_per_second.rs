//! `gain-per-second`: the look that is expected to settle most of the doubt for the time that it takes, one at a time.

use super::policy::{Look, Policy, best};
use crate::looking::looks::LOOK_S;
use crate::situation::Situation;

pub(super) struct GainPerSecond;

impl Policy for GainPerSecond {
    fn choose(&mut self, _: &Situation, looks: &[Look]) -> Option<Look> {
        best(looks, |look| look.gain / (look.travel_s + LOOK_S))
    }
}
