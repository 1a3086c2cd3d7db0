//! `(completeness ?of)`: how sure it is which objects are of a kind, and that no more are hidden.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent = |of: usize| {
        format!("(= (completeness {}) {:.6})", situation.kinds[of].symbol, situation.completeness(of))
    };
    (0..situation.kinds.len()).map(fluent).collect()
}
