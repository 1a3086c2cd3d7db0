//! `random`: any view, by the seed of the run.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::policy::{Look, Policy};
use crate::situation::Situation;

pub(super) struct Random(ChaCha8Rng);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }
}

impl Policy for Random {
    fn choose(&mut self, _: &Situation, looks: &[Look]) -> Option<Look> {
        looks.get(self.0.random_range(0..looks.len().max(1))).copied()
    }
}
