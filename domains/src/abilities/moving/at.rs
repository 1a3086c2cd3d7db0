//! `(at ?where)`: place of the body.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    vec![format!("(at {})", situation.candidates[situation.at].symbol)]
}
