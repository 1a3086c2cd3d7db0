//! `(confidence ?what)`: how sure it is where a sought object stands.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent = |what: usize| {
        format!("(= (confidence {}) {:.6})", situation.things[what].symbol, situation.confidence(what))
    };
    (0..situation.things.len()).map(fluent).collect()
}
