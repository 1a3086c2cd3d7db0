//! `(is ?what ?kind)`: an object that was seen is surely of a kind.

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
