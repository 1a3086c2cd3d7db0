//! `(completeness ?of)`: certainty that all objects of a kind are found: which of the seen ones belong
//! to the kind, and that no more are hidden.

use crate::range::{Range, Referent};
use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent = |of: usize| {
        format!("(= (completeness {}) {:.6})", situation.kinds[of].symbol, situation.completeness(of))
    };
    (0..situation.kinds.len()).map(fluent).collect()
}

/// Bounds on the completeness of a kind; unknown for a kind that was not searched.
pub(super) fn bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    match of.first() {
        Some(Referent::Named(kind)) => match s.kind(kind) {
            Ok(of) if is_looked_for(s, of) => Range::certainty(s.completeness(of), s.wanted_of(of)),
            _ => Range::UNKNOWN,
        },
        _ => Range::UNKNOWN,
    }
}

/// True if a surface was viewed on which an object of the kind could stand.
fn is_looked_for(s: &Situation, of: usize) -> bool {
    (0..s.surfaces.len()).any(|on| s.kinds[of].may_be_on(on) && s.is_looked_at(on))
}
