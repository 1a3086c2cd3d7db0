//! `(presence ?what ?on)`: how sure it is that a sought object stands on a surface.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent = |what: usize, on: usize| {
        let (thing, surface) = (&situation.things[what].symbol, &situation.surfaces[on].symbol);
        format!("(= (presence {thing} {surface}) {:.6})", situation.presence(what, on))
    };
    let surfaces = 0..situation.surfaces.len();
    (0..situation.things.len()).flat_map(|what| surfaces.clone().map(move |on| fluent(what, on))).collect()
}
