//! `oracle`: knows what each view truly shows of the target, and takes the view that shows most. Where
//! none shows any, as with an absent target, takes the view that settles most doubt. For experiments
//! only.

use super::policy::{Foresight, Look, Policy, best};
use crate::situation::Situation;

pub(super) struct Oracle {
    foresight: Foresight,
}

impl Oracle {
    pub(super) fn new(foresight: Foresight) -> Self {
        Self { foresight }
    }
}

impl Policy for Oracle {
    fn choose(&mut self, situation: &Situation, looks: &[Look]) -> Option<Look> {
        let shown = |look: &Look| {
            let surface = &situation.surfaces[look.on].name;
            (self.foresight)(&situation.candidates[look.from].place, surface)
        };
        let gain = best(looks, |look| look.gain);
        match best(looks, shown) {
            Some(look) if shown(&look) > 0.0 => Some(look),
            _ => gain,
        }
    }
}
