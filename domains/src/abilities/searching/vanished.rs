//! What was believed to stand on a surface and is not found there: gone, moved, or only rubbed out by views that do not fit.

use descry_memory::belief::{Belief, Track};
use descry_perception::nalgebra::Vector3;
use descry_perception::visibility::{DepthMap, Seen, Visibility};

use super::perceive::{ON_SURFACE_M, SIDE_TOLERANCE_M};
use crate::mind::Mind;
use crate::situation::KnownSurface;

/// What is sought and was at least so probable is missed when it is gone.
const PERHAPS: f64 = 0.2;
/// An object that is less probable to be what is asked about is not missed when a merge does not find it again.
const UNLIKELY: f64 = 0.02;

/// What was sought and believed to stand where the newest view looks through: somebody has moved it. In words; none if nothing.
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

/// Takes out of a belief what is remembered of earlier runs on a surface and stands where no view has looked yet: of that the views
/// say nothing.
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

/// Takes back into a belief what may be something that is asked about and was not found in the merge, though the newest view does not look
/// through its place and nothing that was found stands there, but a large thing into which it may be blurred: views that lie beside each
/// other rub it out.
pub(super) fn keep_unrefuted(
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

/// Whether a camera saw through the middle of an object's place, low and high.
fn looked_through(track: &Track, up: &Vector3<f64>, map: &DepthMap) -> bool {
    let free = |share: f64| {
        let place = track.position_m + up * (track.size_m[2] * share);
        map.look(&place, SIDE_TOLERANCE_M) == Seen::Free
    };
    [0.3, 0.5, 0.7].into_iter().all(free)
}

#[cfg(test)]
mod tests {
    use descry_memory::RecordId;
    use descry_perception::Intrinsics;
    use descry_perception::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
    use descry_perception::recognise::Evidence;

    use super::*;

    /// A camera two metres above a table that sees something of a height everywhere.
    fn seen_from_above(height_m: f64) -> DepthMap {
        let intrinsics = Intrinsics { width: 64, height: 48, fx: 100.0, fy: 100.0, cx: 32.0, cy: 24.0 };
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let world_from_camera = Isometry3::from_parts(Translation3::new(0.0, 0.0, 2.0), down);
        let depths_m = vec![(2.0 - height_m) as f32; 64 * 48].into();
        DepthMap { intrinsics, camera_from_world: world_from_camera.inverse(), depths_m }
    }

    fn track(id: u64, x: f64, cup: f64, side_m: f64) -> Track {
        Track {
            id,
            on: "table".into(),
            position_m: Point3::new(x, 0.0, 0.0),
            position_sigma_m: 0.002,
            size_m: [side_m, side_m, 0.12],
            footprint_m: vec![],
            probabilities: vec![("cup A".into(), cup)],
            kinds: vec![("cup".into(), cup)],
            unknown: 1.0 - cup,
            seen_fraction: 0.5,
            viewpoints_m: vec![],
            evidence: Evidence::default(),
            cites: vec![RecordId(1)],
            first_ns: 0,
            last_ns: 0,
        }
    }

    /// Whether an object is still believed in that no merge found again: what it may be, what the newest view shows there, where another was found
    /// and how wide that is.
    fn check(cup: f64, newest_m: Option<f64>, other: Option<(f64, f64)>, kept: bool) {
        let table = KnownSurface {
            symbol: "table".into(),
            name: "table".into(),
            room: None,
            floor: Vec::new(),
            outline: vec![],
            up: Vector3::z(),
            whole: true,
            doubtful: None,
            placed: None,
        };
        let mut belief = Belief::default();
        belief.gone = vec![track(0, 0.0, 1.0, 0.07), track(1, 0.0, cup, 0.07)];
        belief.tracks = other.map(|(x, side_m)| track(2, x, 0.1, side_m)).into_iter().collect();
        let newest = newest_m.map(seen_from_above);
        keep_unrefuted(&mut belief, 1, &table, newest.as_ref(), &["cup A", "cup"]);
        let still = belief.tracks.iter().any(|t| t.id == 1);
        let context = format!("cup {cup}, newest {newest_m:?}, other {other:?}");
        assert_eq!((still, belief.gone.len()), (kept, if kept { 1 } else { 2 }), "{context}");
        assert_eq!(belief.gone[0].id, 0, "what was gone before stays gone: {context}");
    }

    #[test]
    fn what_no_view_refutes_is_still_believed_in() {
        check(0.4, None, None, true);
        check(0.4, Some(0.1), None, true);
        check(0.4, Some(0.0), None, false);
        check(0.01, None, None, false);
        check(0.4, None, Some((0.02, 0.07)), false);
        check(0.4, None, Some((0.09, 0.07)), true);
        check(0.4, None, Some((0.09, 0.25)), false);
        check(0.6, None, Some((0.09, 0.25)), true);
        check(0.6, None, Some((0.02, 0.07)), false);
    }
}
