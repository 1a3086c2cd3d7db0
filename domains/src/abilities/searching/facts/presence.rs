//! `(presence ?what ?on)`: certainty that a sought object stands on a surface.

use crate::range::{Range, Referent};
use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent = |what: usize, on: usize| {
        let (thing, surface) = (&situation.things[what].symbol, &situation.surfaces[on].symbol);
        format!("(= (presence {thing} {surface}) {:.6})", situation.presence(what, on))
    };
    let surfaces = 0..situation.surfaces.len();
    (0..situation.things.len()).flat_map(|what| surfaces.clone().map(move |on| fluent(what, on))).collect()
}

/// Bounds on that certainty by the views so far; zero for a thing that counts as *not there*.
pub(super) fn bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let [what, on] = of else { return Range::UNKNOWN };
    let on = match on {
        Referent::Named(on) => s.surface(on).ok(),
        _ => None,
    };
    match (what, on) {
        (Referent::Named(what), Some(on)) => match s.thing(what) {
            Ok(what) => of_thing(s, what, on),
            Err(_) => Range::UNKNOWN,
        },
        // On a surface that nobody has found, it stands where it may be at all.
        (Referent::Named(what), None) => match s.thing(what) {
            Ok(what) if s.chance_there(what) <= s.thresholds.not_there => {
                Range::exactly(0.0).with(1.0 - s.chance_there(what))
            }
            _ => Range::UNKNOWN,
        },
        (Referent::Seen(track), Some(on)) => {
            Range::exactly(f64::from(u8::from(track.on == s.surfaces[on].symbol)))
        }
        (Referent::Unseen, Some(on)) if s.is_clear(on) => Range::exactly(0.0).with(s.clarity(on)),
        _ => Range::UNKNOWN,
    }
}

fn of_thing(s: &Situation, what: usize, on: usize) -> Range {
    let sure = Range::certainty(s.presence(what, on), s.threshold);
    let thing = &s.things[what];
    let chance = s.chance_on(what, on);
    match thing.track {
        Some(id) if s.on_surface(on).all(|track| track.id != id) => Range::exactly(0.0),
        None if sure.believed < s.threshold && chance <= s.thresholds.not_there => {
            Range::exactly(0.0).with(1.0 - chance)
        }
        _ => sure,
    }
}
