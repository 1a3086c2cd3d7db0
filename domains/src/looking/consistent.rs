//! Consistency of a surface's views with the map and with each other: views of a miscalibrated
//! camera or a mislocalised body prove nothing.

use std::sync::Arc;

use descry_perception::View;
use descry_perception::consistency::{Fault, Inconsistency, MapSurface, judge};
use descry_perception::merge::ViewFit;
use descry_perception::nalgebra::Isometry3;

use crate::error::WorldError;
use crate::eyes::{Eyes, put};
use crate::looking::contradiction::Contradiction;
use crate::mind::{Mind, Region};
use crate::note::Note;
use crate::surface::KnownSurface;
use crate::symbol::symbol;

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
    let lie = judged(eyes, &mind.known.surfaces[on], &mind.regions[on], views);
    let (contradiction, displaced_m) = match lie {
        Some(Inconsistency { fault: Fault::Displaced(..), spread_m, .. }) => (None, spread_m),
        Some(lie) => (Some(Contradiction::Fault(lie.fault)), 0.0),
        None => (None, 0.0),
    };
    mind.known.surfaces[on].displaced_m = displaced_m;
    contradiction
}

/// The likely fault of camera or poses, by the looks at a surface of the map.
fn judged(eyes: Eyes<'_>, known: &KnownSurface, region: &Region, views: &[View]) -> Option<Inconsistency> {
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
    let last = stated.len().saturating_sub(1);
    let shifted = |by: isize| -> Vec<Isometry3<f64>> {
        (0..=last).filter_map(|n| stated.get(n.saturating_add_signed(by).min(last)).copied()).collect()
    };
    judge(&looks, &map, asked, &[(1, shifted(1)), (-1, shifted(-1))]).filter(Inconsistency::is_likely)
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
