//! `(observed ?from ?on)`: the looks that have been taken.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let atom = |&(from, on): &(usize, usize)| {
        format!("(observed {} {})", situation.candidates[from].symbol, situation.surfaces[on].symbol)
    };
    situation.observed.iter().map(atom).collect()
}
