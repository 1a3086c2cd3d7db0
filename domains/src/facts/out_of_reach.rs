//! `(out-of-reach ?where)`: poses that have been given up.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let atom = |&pose: &usize| format!("(out-of-reach {})", situation.candidates[pose].symbol);
    situation.out_of_reach.iter().map(atom).collect()
}
