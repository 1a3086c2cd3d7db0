//! `nearest`: the nearest viewpoint not used yet.

use super::policy::{Look, Policy, best};
use crate::situation::Situation;

pub(super) struct Nearest;

impl Policy for Nearest {
    fn choose(&mut self, _: &Situation, looks: &[Look]) -> Option<Look> {
        best(looks, |look| -look.travel_s)
    }
}
