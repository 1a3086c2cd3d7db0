//! `gain-per-second`: greedy, the view with the greatest share of the doubt expected to be settled per
//! second.

use super::policy::{Look, Policy, best};
use crate::looking::looks::LOOK_S;
use crate::situation::Situation;

pub(super) struct GainPerSecond;

impl Policy for GainPerSecond {
    fn choose(&mut self, _: &Situation, looks: &[Look]) -> Option<Look> {
        best(looks, |look| look.gain / (look.travel_s + LOOK_S))
    }
}
