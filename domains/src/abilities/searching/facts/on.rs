//! `(on ?what ?on)`: a sought object stands on a surface, as surely as was asked for.

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
