//! `(sure)`: the confidence that was asked for.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    vec![format!("(= (sure) {})", situation.threshold)]
}
