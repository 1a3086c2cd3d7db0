//! `(is ?what ?kind)`: a seen object certainly is of a kind.

use descry_memory::belief::Track;
use descry_perception::recognise::ObjectModel;

use crate::range::{Range, Referent};
use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let mut atoms = Vec::new();
    for (what, thing) in situation.things.iter().enumerate().filter(|(_, t)| t.track.is_some()) {
        for kind in situation.kinds.iter().filter(|k| k.name == thing.name) {
            if situation.confidence(what) >= situation.threshold {
                atoms.push(format!("(is {} {})", thing.symbol, kind.symbol));
            }
        }
    }
    atoms
}

/// Bounds on the truth of `(is ?what ?kind)` by the views so far: true, false or unknown.
pub(super) fn bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let [what, Referent::Named(kind)] = of else { return Range::UNKNOWN };
    let Ok(of) = s.kind(kind) else { return Range::UNKNOWN };
    let of_track = |track: &Track| Range::settled(track.probability_of(&s.kinds[of].name), s.threshold);
    match what {
        Referent::Seen(track) => of_track(track),
        Referent::Unseen if s.completeness(of) >= s.wanted_of(of) => {
            Range::exactly(0.0).with(s.completeness(of))
        }
        Referent::Unseen => Range::UNKNOWN,
        Referent::Named(what) => {
            let Ok(what) = s.thing(what) else { return Range::UNKNOWN };
            let thing = &s.things[what];
            let is = |m: &ObjectModel| s.kinds[of].models.iter().any(|other| other.name == m.name);
            let count = thing.models.iter().filter(|model| is(model)).count();
            match thing.track {
                Some(id) => s.belief.tracks.iter().find(|t| t.id == id).map_or(Range::UNKNOWN, of_track),
                // What a known object is, its name says, but for its colour.
                None if s.kinds[of].colour != thing.colour && count > 0 => Range::UNKNOWN,
                None if count == 0 => Range::exactly(0.0),
                None if count == thing.models.len() => Range::exactly(1.0),
                None => Range::UNKNOWN,
            }
        }
    }
}
