//! `(completeness-in ?of ?where)`: certainty that all objects of a kind in a room are found. In a room
//! that the goal asks about it is the certainty for all requested surfaces together, a lower bound; in
//! other rooms it is 0.

use super::completeness;
use crate::range::{Range, Referent};
use crate::situation::Situation;
use crate::symbol::symbol;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let rooms: Vec<String> = situation.robot.rooms().iter().map(|room| symbol(&room.name)).collect();
    let mut lines = Vec::new();
    for (of, kind) in situation.kinds.iter().enumerate() {
        for room in &rooms {
            let there = (0..situation.surfaces.len())
                .filter(|&n| situation.surfaces[n].is_in(std::slice::from_ref(room)));
            let is_asked = kind.on.as_ref().is_none_or(|on| there.clone().all(|n| on.contains(&n)));
            let value = if is_asked { situation.completeness(of) } else { 0.0 };
            lines.push(format!("(= (completeness-in {} {room}) {value:.6})", kind.symbol));
        }
    }
    lines
}

/// Bounds on the certainty: those of the whole kind if all surfaces of the room are requested, else
/// unknown.
pub(super) fn bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let [Referent::Named(kind), Referent::Named(room)] = of else { return Range::UNKNOWN };
    let is_there = |n: &usize| s.surfaces[*n].is_in(&[(*room).to_string()]);
    let is_asked = |kind: &crate::known::Thing| {
        kind.on.as_ref().is_none_or(|on| (0..s.surfaces.len()).filter(is_there).all(|n| on.contains(&n)))
    };
    match s.kind(kind) {
        Ok(n) if is_asked(&s.kinds[n]) => completeness::bounds(s, of),
        _ => Range::UNKNOWN,
    }
}
