//! Where a thing ends, and whether that was seen: its top, and the sides of its footprint.

use super::asker::Asker;
use crate::outline::Rectangle;
use crate::scale::APART_M;
use crate::visibility::Seen;

/// True if most places just above the object are hidden by something nearer to the cameras.
pub(super) fn top_hidden(asker: &Asker, footprint: &Rectangle, top: f64) -> bool {
    /// Places above are asked about so far from the middle, as a share of the shorter side. From: chosen.
    const REACH: f64 = 0.25;
    let reach = REACH * footprint.sides_m[1];
    let places = [(0.0, 0.0), (reach, 0.0), (-reach, 0.0), (0.0, reach), (0.0, -reach)];
    let above = top + APART_M;
    let hidden = places
        .iter()
        .filter(|(dx, dy)| asker.look(footprint.x + dx, footprint.y + dy, above) < Seen::Surface)
        .count();
    !asker.views.is_empty() && 2 * hidden > places.len()
}

/// Whether the longer and the shorter side of a footprint end where nothing was seen beyond: a box may be longer there.
pub(super) fn open_sides(asker: &Asker, footprint: &Rectangle, top: f64) -> [bool; 2] {
    /// It is asked beyond these places of an end, shares of its length. From: chosen.
    const PLACES: [f64; 3] = [-0.3, 0.0, 0.3];
    if asker.views.is_empty() {
        return [false; 2];
    }
    let (sin, cos) = footprint.turn;
    let [along, across] = footprint.along_m;
    // Had it gone on, its top would have been measured there, or a camera have looked through it.
    let is_open = |end: [f64; 2], edge: [f64; 2]| {
        let tells_nothing = |share: &&f64| {
            let [u, v] = [end[0] + **share * edge[0], end[1] + **share * edge[1]];
            let at = [footprint.x + cos * u - sin * v, footprint.y + sin * u + cos * v];
            asker.look(at[0], at[1], top) < Seen::Surface
        };
        2 * PLACES.iter().filter(tells_nothing).count() > PLACES.len()
    };
    let of_axis = |out: [f64; 2], edge: [f64; 2]| is_open(out, edge) || is_open(out.map(|m| -m), edge);
    let open = [
        of_axis([0.5 * along + APART_M, 0.0], [0.0, across]),
        of_axis([0.0, 0.5 * across + APART_M], [along, 0.0]),
    ];
    if along >= across { open } else { [open[1], open[0]] }
}
