//! `(clarity ?on)`: certainty of the identity of every object on a surface, and that none is
//! hidden.

use crate::range::{Range, Referent};
use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent =
        |on: usize| format!("(= (clarity {}) {:.6})", situation.surfaces[on].symbol, situation.clarity(on));
    (0..situation.surfaces.len()).map(fluent).collect()
}

/// Bounds on the clarity of a surface; unknown for a surface that was not viewed.
pub(super) fn bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    match of {
        [Referent::Named(on)] => match s.surface(on) {
            Ok(on) if s.is_looked_at(on) => Range::certainty(s.clarity(on), s.threshold),
            _ => Range::UNKNOWN,
        },
        _ => Range::UNKNOWN,
    }
}
