//! `(confidence ?what)`: certainty of the place of a sought object.

use crate::range::{Range, Referent};
use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent = |what: usize| {
        format!("(= (confidence {}) {:.6})", situation.things[what].symbol, situation.confidence(what))
    };
    (0..situation.things.len()).map(fluent).collect()
}

/// Bounds on the confidence in a thing's place; zero for a thing that counts as *not there*.
pub(super) fn bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let [Referent::Named(what)] = of else { return Range::UNKNOWN };
    let Ok(what) = s.thing(what) else { return Range::UNKNOWN };
    let sure = Range::certainty(s.confidence(what), s.threshold);
    let chance = s.chance_there(what);
    let is_absent = sure.believed < s.threshold && chance <= s.thresholds.not_there;
    if is_absent { Range::exactly(0.0).with(1.0 - chance) } else { sure }
}
