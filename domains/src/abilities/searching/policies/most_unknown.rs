//! `most-unknown`: the view that shows most of the unobserved space above the surface.

use super::policy::{Look, Policy, best};
use super::unseen;
use crate::situation::Situation;

pub(super) struct MostUnknown;

impl Policy for MostUnknown {
    fn choose(&mut self, situation: &Situation, looks: &[Look]) -> Option<Look> {
        best(looks, |look| unseen::visible(situation, look, |_| true))
    }
}
