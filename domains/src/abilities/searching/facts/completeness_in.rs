//! `(completeness-in ?of ?where)`: how sure it is that all of a kind are found that are in a room. Known of the room that is asked
//! about; of any other no more than nothing.

use crate::lexicon::symbol;
use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let rooms: Vec<String> = situation.robot.rooms().iter().map(|room| symbol(&room.name)).collect();
    let mut lines = Vec::new();
    for (of, kind) in situation.kinds.iter().enumerate() {
        for room in &rooms {
            let is_asked = kind.on.as_ref().is_some_and(|on| {
                on.iter().all(|&n| situation.surfaces[n].room.as_deref().map(symbol).as_ref() == Some(room))
            });
            let value = if is_asked { situation.completeness(of) } else { 0.0 };
            lines.push(format!("(= (completeness-in {} {room}) {value:.6})", kind.symbol));
        }
    }
    lines
}
