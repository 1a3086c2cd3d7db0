//! `(on ?what ?on)`: a thing stands on a surface with at least the requested confidence.

use super::presence;
use crate::range::{Range, Referent};
use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let mut atoms = Vec::new();
    for what in 0..situation.things.len() {
        for on in 0..situation.surfaces.len() {
            if situation.presence(what, on) >= situation.threshold {
                let (thing, surface) = (&situation.things[what].symbol, &situation.surfaces[on].symbol);
                atoms.push(format!("(on {thing} {surface})"));
            }
        }
    }
    atoms
}

/// Bounds on the truth of `(on ?what ?on)` by the views so far: true, false or unknown.
pub(super) fn bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let there = match of {
        [Referent::Seen(track), Referent::Named(on)] => Range::exactly(f64::from(u8::from(track.on == **on))),
        of => presence::bounds(s, of),
    };
    match there {
        sure if sure.believed >= s.threshold => Range::exactly(1.0).with(sure.sure),
        none if none.greatest <= 0.0 => none,
        _ => Range::UNKNOWN,
    }
}
