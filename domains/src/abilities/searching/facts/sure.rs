//! `(sure)`: the confidence that the goal requires, 0 to 1.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    vec![format!("(= (sure) {})", situation.threshold)]
}
