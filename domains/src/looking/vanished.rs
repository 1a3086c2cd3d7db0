//! Believed objects of a surface that are not found any more: gone, moved, or erased by
//! misregistered views.

use descry_memory::belief::{Belief, Track};
use descry_perception::nalgebra::Vector3;
use descry_perception::visibility::{DepthMap, Seen, Visibility};

use crate::mind::Mind;
use crate::surface::KnownSurface;

/// Minimum probability at which a requested object is reported missing.
const PERHAPS: f64 = 0.2;
/// Minimum probability of being requested at which a lost object is kept in the belief.
const UNLIKELY: f64 = 0.02;

/// Sentence about a requested object whose place the newest view looks through, because a person
/// moved it; `None` if there is none.
pub(super) fn taken_away(mind: &Mind, on: usize, gone_before: usize, newest: &DepthMap) -> Option<String> {
    let known = &mind.known;
    let up = known.surfaces[on].up;
    mind.known.belief.gone[gone_before..].iter().find_map(|track| {
        let (p, name) = known
            .things
            .iter()
            .chain(&known.kinds)
            .map(|thing| (track.probability_of(&thing.name), &thing.name))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        let [x, y, z] = track.position_m.into();
        (p > PERHAPS && looked_through(track, &up, newest))
            .then(|| format!("{name} ({p:.2}) stood at ({x:.2}, {y:.2}, {z:.2}) m and is gone"))
    })
}

/// Takes remembered objects of earlier runs out of the belief where no view has seen their places yet;
/// returns them.
pub(super) fn set_aside_unseen(
    belief: &mut Belief,
    surface: &KnownSurface,
    visibility: &Visibility,
) -> Vec<Track> {
    let is_unseen = |t: &Track| {
        let middle = t.position_m + surface.up * (t.size_m[2] / 2.0);
        t.on == surface.symbol
            && t.cites.is_empty()
            && matches!(visibility.look(&middle, SIDE_TOLERANCE_M), Seen::Never | Seen::Hidden)
    };
    let (unseen, rest) = std::mem::take(&mut belief.tracks).into_iter().partition(is_unseen);
    belief.tracks = rest;
    unseen
}

/// Restores requested objects that the merge did not find, if the newest view does not look through
/// their place, and nothing but a large object, into which they may be blurred, was found there.
pub fn keep_unrefuted(
    belief: &mut Belief,
    gone_before: usize,
    surface: &KnownSurface,
    newest: Option<&DepthMap>,
    asked: &[&str],
) {
    let vanished = belief.gone.split_off(gone_before);
    let (kept, gone): (Vec<Track>, Vec<Track>) = vanished.into_iter().partition(|track| {
        asked.iter().any(|name| track.probability_of(name) > UNLIKELY)
            && !newest.is_some_and(|newest| looked_through(track, &surface.up, newest))
            && !belief.tracks.iter().any(|other| {
                other.on == track.on
                    && surface.is_of(other, &track.position_m, ON_SURFACE_M)
                    && !track.may_be_blurred_into(other.label(), &other.size_m)
            })
    });
    belief.gone.extend(gone);
    belief.tracks.extend(kept);
    belief.tracks.sort_by_key(|track| track.id);
}

/// True if a camera saw through the axis of an object's place at several heights.
fn looked_through(track: &Track, up: &Vector3<f64>, map: &DepthMap) -> bool {
    let free = |share: f64| {
        let place = track.position_m + up * (track.size_m[2] * share);
        map.look(&place, SIDE_TOLERANCE_M) == Seen::Free
    };
    [0.3, 0.5, 0.7].into_iter().all(free)
}

/// Maximum distance between a measured surface and an object's expected side for the side to count
/// as seen, metres.
pub(super) const SIDE_TOLERANCE_M: f64 = 0.03;
/// Maximum distance of points on a surface, metres.
pub(super) const ON_SURFACE_M: f64 = 0.012;
