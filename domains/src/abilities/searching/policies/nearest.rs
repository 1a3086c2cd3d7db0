//! `nearest`: from the nearest pose that has not been looked from.

use super::policy::{Look, Policy, best};
use crate::situation::Situation;

pub(super) struct Nearest;

impl Policy for Nearest {
    fn choose(&mut self, _: &Situation, looks: &[Look]) -> Option<Look> {
        best(looks, |look| -look.travel_s)
    }
}
