//! Consistency of a surface's views with the map and with each other: views of a miscalibrated
//! camera or a mislocalised body prove nothing.

use std::sync::Arc;

use descry_perception::View;
use descry_perception::consistency::{Consistency, Fault, Inconsistency, Late, MapSurface, judge};
use descry_perception::merge::ViewFit;
use descry_perception::nalgebra::Isometry3;

use crate::contradiction::Contradiction;
use crate::error::WorldError;
use crate::eyes::{Eyes, put};
use crate::mind::{Mind, Region};
use crate::note::Note;
use crate::surface::KnownSurface;
use crate::symbol::symbol;
use descry_robots::{Place, Robot, Station};

/// Distance below which two cameras count as one place, metres.
const ONE_PLACE_M: f64 = 0.1;
/// Minimum number of views for a majority to identify the wrong ones.
const FEWEST: usize = 3;

/// Saves the belief about a surface before the run's first look at it.
pub(super) fn keep_expected(mind: &mut Mind, on: usize) {
    let Mind { known, regions, .. } = mind;
    let there = || known.belief.tracks.iter().filter(|t| t.on == known.surfaces[on].symbol).cloned();
    regions[on].expected.get_or_insert_with(|| there().collect());
}

/// Contradiction between all looks at a surface and the map's outline and height, if a camera or
/// pose fault is likelier than the stated errors. `None` for an unmapped surface; a mere
/// displacement makes places there uncertain instead.
pub(super) fn with_map(mind: &mut Mind, eyes: Eyes<'_>, on: usize, views: &[View]) -> Option<Contradiction> {
    let judged = judged(eyes, &mind.known.surfaces[on], &mind.regions[on], views).unwrap_or_default();
    let (contradiction, displaced_m) = match judged.inconsistency {
        Some(Inconsistency { fault: Fault::Displaced(..), spread_m, .. }) => (None, spread_m),
        Some(lie) => (Some(Contradiction::Fault(lie.fault)), 0.0),
        None => (None, 0.0),
    };
    let known = &mut mind.known.surfaces[on];
    known.displaced_m = displaced_m.hypot(judged.spread_m);
    known.sensor_doubt = if contradiction.is_some() { 0.0 } else { judged.doubt };
    contradiction
}

/// Evidence of a surface's views about camera and poses; `None` if the map has no such surface.
fn judged(eyes: Eyes<'_>, known: &KnownSurface, region: &Region, views: &[View]) -> Option<Consistency> {
    let hints = eyes.robot.surfaces();
    let asked = hints.iter().position(|hint| known.whole && symbol(&hint.name) == known.symbol)?;
    let of_hint = |hint: &descry_robots::SurfaceHint| MapSurface {
        outline_m: hint.outline_m.clone(),
        height_m: hint.height_m,
    };
    let map: Vec<MapSurface> = hints.iter().map(of_hint).collect();
    // Looks from one place share the error of localisation there: the last of them counts.
    let mut looks: Vec<(&View, Isometry3<f64>)> = Vec::new();
    for (look, view) in region.looks.iter().zip(views) {
        let stated = look.localised(view);
        let eye = stated.translation.vector;
        looks.retain(|(_, other)| (other.translation.vector - eye).norm() > ONE_PLACE_M);
        looks.push((view, stated));
    }
    let stated: Vec<Isometry3<f64>> = looks.iter().map(|(_, pose)| *pose).collect();
    Some(judge(&looks, &map, asked, &late(eyes.robot, &stated)))
}

/// Poses of the views where those are a frame late or early: of the next or last view in time, and of the next or last frame of
/// a body that stands where frames were taken.
fn late(robot: &dyn Robot, stated: &[Isometry3<f64>]) -> Vec<Late> {
    let at = |station: &Station| robot.camera_at(&Place::Station(station.name.clone()), None).ok();
    let frames: Vec<Isometry3<f64>> = robot.stations().unwrap_or_default().iter().filter_map(at).collect();
    let near = |pose: &Isometry3<f64>| {
        let away_m = |n: &usize| (frames[*n].translation.vector - pose.translation.vector).norm();
        (0..frames.len()).min_by(|a, b| away_m(a).total_cmp(&away_m(b)))
    };
    let by = |frame: usize, by: i64| frame.checked_add_signed(by as isize);
    let in_time = |frames: i64| {
        let pose = |n: usize| by(n, frames).and_then(|n| stated.get(n).copied());
        (frames, (0..stated.len()).map(pose).collect())
    };
    let in_order = |lag: i64| {
        let pose = |pose: &Isometry3<f64>| by(near(pose)?, lag).and_then(|n| frames.get(n).copied());
        (lag, stated.iter().map(pose).collect())
    };
    [1, -1].into_iter().flat_map(|frames| [in_time(frames), in_order(frames)]).collect()
}

/// Contradiction among views, if inconsistent ones are as many as consistent ones.
pub(super) fn among(fits: &[ViewFit]) -> Option<Contradiction> {
    let agreeing = fits.iter().filter(|fit| fit.used).count();
    let at_odds = fits.iter().filter(|fit| fit.is_at_odds).count();
    (agreeing + at_odds >= FEWEST && at_odds >= agreeing).then_some(Contradiction::Apart)
}

/// Discards a surface's contradictory looks and restores the belief from before them.
pub(super) fn prove_nothing(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    on: usize,
    contradiction: Contradiction,
    notes: &mut Vec<Note>,
) -> Result<(), WorldError> {
    let (symbol, name) = (mind.known.surfaces[on].symbol.clone(), mind.known.surfaces[on].name.clone());
    let region = &mut mind.regions[on];
    region.contradiction = Some(contradiction);
    region.taken_in.clear();
    mind.known.spaces[on] = Arc::default();
    let belief = Arc::make_mut(&mut mind.known.belief);
    belief.tracks.retain(|track| track.on != symbol);
    belief.tracks.extend(region.expected.clone().unwrap_or_default());
    belief.tracks.sort_by_key(|track| track.id);
    put(eyes.record, "belief", eyes.robot.now_ns(), &*mind.known.belief)?;
    let because = contradiction.told(&name);
    let contradiction = Some(contradiction);
    notes.push(Note::Nothing { because, advice: String::new(), is_left_out: false, contradiction });
    Ok(())
}
