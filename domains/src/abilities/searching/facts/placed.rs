//! `(placed ?what)`: how sure it is that a sought object, where one is believed in, stands where on its surface it is believed to.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent =
        |what: usize| format!("(= (placed {}) {:.6})", situation.things[what].symbol, situation.placed(what));
    (0..situation.things.len()).map(fluent).collect()
}
