//! `(placed ?what)`: certainty of a sought object's position along its surface, given that the
//! object was found.

use crate::range::{Range, Referent};
use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent =
        |what: usize| format!("(= (placed {}) {:.6})", situation.things[what].symbol, situation.placed(what));
    (0..situation.things.len()).map(fluent).collect()
}

/// Bounds on that certainty; unknown for an object that was neither seen nor found to be *not there*.
pub(super) fn bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let [Referent::Named(what)] = of else { return Range::UNKNOWN };
    let Ok(what) = s.thing(what) else { return Range::UNKNOWN };
    let is_known = s.best(what).is_some() || s.chance_there(what) <= s.thresholds.not_there;
    if is_known { Range::certainty(s.placed(what), s.threshold) } else { Range::UNKNOWN }
}
