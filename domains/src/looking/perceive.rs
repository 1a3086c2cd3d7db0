//! Perception of a view: recorded, read back with the surface's other views by timestamp, merged,
//! recognised, and added to the belief.

use std::sync::Arc;

use descry_memory::belief::{Sighted, Track};
use descry_memory::space::Space;
use descry_memory::viewer::{self, Labelled};
use descry_memory::{Draft, Meta, Record, RecordId, Sighting};
use descry_perception::View;
use descry_perception::hull::Hull;
use descry_perception::merge::{MergeOptions, Merged, ViewFit};
use descry_perception::nalgebra::{Isometry3, Point3, Translation3, Vector3};
use descry_perception::noise::axial_sigma_m;
use descry_perception::plane::Plane;
use descry_perception::recognise::Percept;
use descry_perception::segment::{Scene, segment_on};
use descry_perception::surface::{Surface, SurfaceOptions, find_surface};
use descry_perception::visibility::{DepthMap, Seen, Visibility};
use descry_robots::Description;
use serde_json::json;

use crate::english;
use crate::error::WorldError;
use crate::eyes::{self, Eyes};
use crate::known::Thing;
use crate::looking::change::Change;
pub use crate::looking::merging::options;
use crate::looking::merging::{self, options_at};
use crate::looking::vanished::{self, keep_unrefuted, set_aside_unseen, taken_away};
use crate::looking::{consistent, discover, placing};
use crate::mind::{Laid, Mind, RecordedView, Region};
use crate::note::{BeliefChange, LeftOut, Note};
use crate::situation::Situation;
use crate::surface::KnownSurface;

/// Distance within which a remembered object is the one seen again, metres.
const SAME_M: f64 = 0.10;
/// Multi-view perception of one surface (Niemueller et al., section V): restores its views by
/// timestamp, merges, recognises, and updates the belief.
pub fn perceive(mind: &mut Mind, eyes: Eyes<'_>, on: usize, notes: &mut Vec<Note>) -> Result<(), WorldError> {
    let _span = tracing::info_span!("perceive", on = %mind.known.surfaces[on].symbol).entered();
    consistent::keep_expected(mind, on);
    let (options, seeking) = options_at(eyes.robot, &mind.known.surfaces[on]);
    place_looks(mind, eyes, on, (&options, &seeking.surface))?;
    if !keep_placed(&mut mind.regions[on].looks) {
        let because = format!("the {} cannot be made out in this view", mind.known.surfaces[on].name);
        notes.push(Note::Nothing { because, advice: String::new(), is_left_out: true, contradiction: None });
        return Ok(());
    }
    let views = restore(mind, eyes, on)?;
    if let Some(contradiction) = consistent::with_map(mind, eyes, on, &views) {
        return consistent::prove_nothing(mind, eyes, on, contradiction, notes);
    }
    let (merged, surface, others) = match made_out(mind, on, &views, (&options, &seeking.surface)) {
        Ok(seen) => seen,
        Err(because) => {
            // What to set otherwise is for who programs it.
            let (because, advice) = because.split_once(": ").unwrap_or((&because, ""));
            mind.regions[on].nothing = Some(because.to_string());
            let (because, advice) = (because.to_string(), advice.to_string());
            notes.push(Note::Nothing { because, advice, is_left_out: false, contradiction: None });
            return Ok(());
        }
    };
    mind.regions[on].nothing = None;
    if let Some(apart) = consistent::among(&merged.fits) {
        return consistent::prove_nothing(mind, eyes, on, apart, notes);
    }
    mind.regions[on].contradiction = None;
    let agreeing = merged.fits.iter().filter(|fit| fit.used).count();
    mind.regions[on].disputed = merged.fits.len() >= 2 * agreeing;
    let (merged, surface, placed) =
        placing::lay_on_map(eyes.robot.description(), &mind.known.surfaces[on], merged, surface);
    let before = confidences(mind, eyes);
    mind.known.surfaces[on].placed = placed;
    let last = mind.regions[on].looks.last().map(|look| look.stamp_ns);
    if without_astray(mind, eyes.robot.description(), on, (&views, &merged)) {
        if mind.regions[on].looks.last().map(|look| look.stamp_ns) == last {
            return perceive(mind, eyes, on, notes);
        }
        let because = format!("this view does not fit the others of the {}", mind.known.surfaces[on].name);
        notes.push(Note::Nothing { because, advice: String::new(), is_left_out: true, contradiction: None });
        return Ok(());
    }
    let merged = merging::without_walls(&mind.known.surfaces[on], merged);
    take_in(mind, on, &views, &merged);
    let since_ns = mind.known.stands_since_ns;
    mind.known.errs_by = errs_by(&mind.regions[on], &views, &merged, since_ns).or(mind.known.errs_by);
    let newest = newest(&views, &merged);
    let scene = segment_on(&merged.cloud, &merged.visibility, surface, &seeking);
    let mut percepts = eyes.recogniser.recognise(&scene, &merged.visibility, eyes.objects);
    let known = &mind.known.surfaces[on];
    percepts.retain(|p| !known.whole || known.covers(&p.position_m, OVER_M));
    let percepts =
        eyes.again.iter().fold(percepts, |percepts, again| again(mind, on, (&views, &merged), percepts));
    if !mind.known.surfaces[on].whole {
        discover::join(mind, on, &scene.surface);
    }
    note_surface(&mut mind.known.surfaces[on], &scene);
    let gone_before = mind.known.belief.gone.len();
    notes.push(believe(mind, eyes, on, (&merged, newest.as_ref()), &percepts, &before)?);
    for new in discover::adopt(mind, on, others, notes) {
        perceive(mind, eyes, new, notes)?;
    }
    match newest.and_then(|newest| taken_away(mind, on, gone_before, &newest)) {
        Some(because) => {
            notes.push(Note::Changed { because });
            begin_again(mind, on);
            perceive(mind, eyes, on, notes)
        }
        None => {
            // Beside planning and driving.
            mind.regions[on].merger.go_ahead(views);
            Ok(())
        }
    }
}

/// Merged views of a surface, the surface found in them, and newly found surfaces; else the reason
/// for failure.
fn made_out(
    mind: &mut Mind,
    on: usize,
    views: &[View],
    (options, seeking): (&MergeOptions, &SurfaceOptions),
) -> Result<(Merged, Surface, Vec<Surface>), String> {
    let merged = merging::merged(mind, on, views, options).map_err(|nothing| nothing.to_string())?;
    let surfaces = &mind.known.surfaces;
    let found = match surfaces[on].whole {
        true => find_surface(&merged.cloud, &merged.visibility, seeking).map(|s| (s, Vec::new())),
        false => discover::look(&merged, seeking, surfaces, on),
    };
    found.map(|(surface, others)| (merged, surface, others)).map_err(|nothing| nothing.to_string())
}

/// Handles objects moved while unobserved: only the newest view of the surface stays valid, and views
/// from its other viewpoints may be repeated.
fn begin_again(mind: &mut Mind, on: usize) {
    let region = &mut mind.regions[on];
    let last = region.looks.len().saturating_sub(1);
    region.looks.drain(..last);
    mind.disturbed += 1;
    let surface = mind.known.surfaces[on].symbol.clone();
    mind.forget_looks(Some(&surface));
    let here = mind.known.candidates[mind.known.at].symbol.clone();
    mind.words.set("observed", vec![here, surface], Some(1.0));
    mind.attend();
}

/// Aligns each new view of a mapped surface with the surface's outline individually. Views of a long
/// surface from its two ends share little; the edges in each view locate it.
fn place_looks(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    on: usize,
    options: (&MergeOptions, &SurfaceOptions),
) -> Result<(), WorldError> {
    let known = &mind.known.surfaces[on];
    if !known.whole {
        return Ok(());
    }
    let description = eyes.robot.description();
    let looks = &mut mind.regions[on].looks;
    for look in looks.iter_mut().filter(|look| look.laid == Laid::AsLocalised) {
        let view = eyes.record.view_at(look.stamp_ns, &description.frames.map)?;
        look.laid = placing::of_view(description, known, view, options);
    }
    Ok(())
}

/// Drops views in which the surface was not found, if their depth noise is much larger than that of the
/// best view in which it was found: they blur the others. False if the newest view is dropped.
fn keep_placed(looks: &mut Vec<RecordedView>) -> bool {
    let newest = looks.last().map(|look| look.stamp_ns);
    let sigma_m = |look: &RecordedView| axial_sigma_m(look.away_m, 0.0).unwrap_or_default();
    let placed = looks.iter().filter(|look| matches!(look.laid, Laid::By(_))).map(sigma_m);
    if let Some(least_m) = placed.reduce(f64::min) {
        looks.retain(|look| look.laid != Laid::Nowhere || sigma_m(look) < BLURRED * least_m);
    }
    looks.last().map(|look| look.stamp_ns) == newest
}

/// Margin around a surface within which the centre of an object on it must lie, metres; an object
/// farther out stands beside the surface.
const OVER_M: f64 = 0.06;
/// Ratio of depth noise above which a view blurs a better one.
const BLURRED: f64 = 2.0;

/// Drops each view of a mapped surface that alignment with outline and other views moved beyond the
/// localisation error. False if nothing was dropped, or nothing would remain.
fn without_astray(
    mind: &mut Mind,
    body: &Description,
    on: usize,
    (views, merged): (&[View], &Merged),
) -> bool {
    let looks = &mut mind.regions[on].looks;
    if !mind.known.surfaces[on].whole {
        return false;
    }
    let has_strayed = |(look, (view, fit)): (&RecordedView, (&View, &ViewFit))| {
        fit.used && placing::is_astray(body, &look.localised(view), &fit.world_from_camera)
    };
    let placed = views.iter().zip(&merged.fits);
    let astray: Vec<bool> = looks.iter().zip(placed).map(has_strayed).collect();
    if !astray.contains(&true) || !astray.contains(&false) {
        return false;
    }
    let mut astray = astray.into_iter();
    looks.retain(|_| !astray.next().unwrap_or(false));
    true
}

/// Localisation error `map_from_localised` from the registration of the newest view; `None` if
/// unregistered, or taken before the body came to its present pose.
fn errs_by(region: &Region, views: &[View], merged: &Merged, since_ns: i64) -> Option<Isometry3<f64>> {
    let (look, view) = region.looks.last().zip(views.last()).filter(|(look, _)| look.stamp_ns >= since_ns)?;
    let fit = merged.fits.last().filter(|fit| fit.used)?;
    Some(fit.world_from_camera * look.localised(view).inverse())
}

/// Reads the views of a surface from the record by timestamp, with their transforms; observations
/// of places changed since are removed.
fn restore(mind: &Mind, eyes: Eyes<'_>, on: usize) -> Result<Vec<View>, WorldError> {
    let map = &eyes.robot.description().frames.map;
    let region = &mind.regions[on];
    let restored = |look: &RecordedView| -> Result<View, WorldError> {
        let mut view = eyes.record.view_at(look.stamp_ns, map)?;
        if let Laid::By(map_from_localised) = look.laid {
            view.world_from_camera = map_from_localised * view.world_from_camera;
        }
        let since = region.changes.iter().filter(|c| c.stamp_ns >= look.stamp_ns);
        since.for_each(|change| change.blank(&mut view));
        Ok(view)
    };
    region.looks.iter().map(restored).collect()
}

/// Handles a moved object: invalidates observations in the cylinder around it, and allows views of the
/// surface to be repeated.
pub fn something_moved(
    mind: &mut Mind,
    record: &Record,
    on: usize,
    change: Change,
) -> Result<(), WorldError> {
    let space = Arc::make_mut(&mut mind.known.spaces[on]);
    space.forget(&change.foot, &change.up, change.radius_m, change.height_m);
    eyes::put(record, "change", change.stamp_ns, &change)?;
    mind.regions[on].changes.push(change);
    mind.disturbed += 1;
    let surface = mind.known.surfaces[on].symbol.clone();
    mind.forget_looks(Some(&surface));
    Ok(())
}

/// Handles a finished push, with the distance in metres that the obstacle moved.
pub fn pushed(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    situation: &Situation,
    what: &str,
    moved_m: f64,
) -> Result<(), WorldError> {
    mind.pushes += 1;
    let obstacle = situation.obstacle(what).map_err(|e| WorldError::Bug(e.to_string()))?;
    let obstacle = &situation.obstacles()[obstacle];
    if moved_m < mind.known.spaces[obstacle.on].voxel_m() {
        return Ok(());
    }
    let (foot, (radius_m, height_m)) = (obstacle.at, obstacle.reach_of_push(moved_m));
    let change = Change { stamp_ns: eyes.robot.now_ns(), foot, up: obstacle.up, radius_m, height_m };
    something_moved(mind, eyes.record, obstacle.on, change)
}

/// Updates a surface from the scene: height and tilt, outline if unmapped, and doubt about being a
/// supporting surface.
fn note_surface(known: &mut KnownSurface, scene: &Scene) {
    let seen = &scene.surface;
    known.doubtful = if known.whole { None } else { seen.doubt() };
    known.up = seen.up.into_inner();
    if known.whole {
        let onto_plane = |p: &Point3<f64>| p - seen.up.into_inner() * seen.height_m(p);
        known.outline = known.outline.iter().map(onto_plane).collect();
    } else {
        known.outline.clone_from(&seen.hull);
    }
}

fn believe(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    on: usize,
    (merged, newest): (&Merged, Option<&DepthMap>),
    percepts: &[Percept],
    before: &[f64],
) -> Result<Note, WorldError> {
    let stamp_ns = eyes.robot.now_ns();
    let surface = mind.known.surfaces[on].clone();
    let viewpoints: Vec<Vec<Point3<f64>>> =
        percepts.iter().map(|p| seen_from(p, &surface.up, &merged.visibility)).collect();
    let footprints: Vec<Vec<Point3<f64>>> =
        percepts.iter().map(|p| footprint(p, &surface.up, merged)).collect();
    let sighted: Vec<Sighted<'_>> = (0..percepts.len())
        .map(|n| Sighted { percept: &percepts[n], viewpoints_m: &viewpoints[n], footprint_m: &footprints[n] })
        .collect();
    let cites: Vec<RecordId> = mind.regions[on].looks.iter().map(|look| look.record).collect();
    let belief = Arc::make_mut(&mut mind.known.belief);
    let unseen = set_aside_unseen(belief, &surface, &merged.visibility);
    let gone_before = belief.gone.len();
    belief.update(&surface.symbol, &sighted, stamp_ns, &cites);
    let asked: Vec<&str> =
        mind.known.things.iter().chain(&mind.known.kinds).map(|t| t.name.as_str()).collect();
    keep_unrefuted(belief, gone_before, &surface, newest, &asked);
    let is_one = |old: &Track| {
        let reach_m = SAME_M.max(old.size_m[0].max(old.size_m[1]) / 2.0);
        belief.tracks.iter().any(|t| t.on == old.on && (t.position_m - old.position_m).norm() < reach_m)
    };
    let apart: Vec<Track> = unseen.into_iter().filter(|old| !is_one(old)).collect();
    belief.tracks.extend(apart);
    belief.tracks.sort_by_key(|track| track.id);
    let after = confidences(mind, eyes);
    let changed = mind.known.things.iter().zip(before.iter().copied().zip(after.iter().copied()));
    let named = |thing: &Thing| match thing.track {
        Some(_) => format!("{} ({})", thing.name, thing.symbol.replace('-', " ")),
        None => thing.name.clone(),
    };
    let changed = changed
        .map(|(thing, (before, after))| BeliefChange::Confidence { of: named(thing), before, after })
        .collect();
    let used: Vec<_> = merged.fits.iter().filter(|fit| fit.used).collect();
    let left_out = merged.fits.iter().zip(1..).filter(|(fit, _)| !fit.used);
    tracing::info!(views = used.len(), objects = percepts.len(), "views are merged and looked through");
    let note = Note::Perceived {
        on: surface.name,
        merged: used.len(),
        left_out: left_out.map(|(fit, view)| LeftOut::View { view, why: fit.why.clone() }).collect(),
        points: merged.cloud.points.len(),
        residual_m: used.iter().map(|fit| fit.residual_m).fold(0.0, f64::max),
        objects: percepts.iter().map(in_a_line).collect(),
        changed,
    };
    let seen = serde_json::to_value(percepts).map_err(|e| WorldError::Bug(e.to_string()))?;
    let (views_of_it, fits, steps) = (&cites, &merged.fits, &merged.steps);
    let seen = json!({
        "on": surface.symbol, "percepts": seen, "views": views_of_it, "fits": fits, "steps": steps,
    });
    let meta = Meta { objects: sightings(percepts), body: seen, ..Meta::default() };
    let frame = &eyes.robot.description().frames.map;
    let blobs = vec![viewer::cloud("merged", &merged.cloud)];
    let draft = Draft { meta, blobs, frame: frame.clone(), ..Draft::new("percepts", stamp_ns) };
    let percepts = eyes.record.put(draft)?;
    let boxes: Vec<Labelled> = mind.known.belief.tracks.iter().map(|t| labelled(t, &surface.up)).collect();
    let blobs = vec![viewer::boxes(stamp_ns, frame, "objects", &boxes)];
    let belief = serde_json::to_value(&*mind.known.belief).map_err(|e| WorldError::Bug(e.to_string()))?;
    let meta = Meta { body: belief, ..Meta::default() };
    let belief = eyes.record.put(Draft { meta, blobs, ..Draft::new("belief", stamp_ns) })?;
    // What the belief rests on outlasts any limit of the record.
    let held: Vec<RecordId> = mind.views_held().into_iter().chain([percepts, belief]).collect();
    eyes.record.hold(&held, "belief")?;
    Ok(note)
}

/// Object as drawn by viewers: known ones green, others grey.
fn labelled(track: &Track, up: &Vector3<f64>) -> Labelled {
    let middle = track.position_m + up * (track.size_m[2] / 2.0);
    let (name, p) = match track.label() {
        Some(label) => (label, track.probability_of(label)),
        None => ("unknown", track.unknown),
    };
    Labelled {
        id: track.id.to_string(),
        text: format!("{name} {p:.2}"),
        frame_from_box: Translation3::from(middle).into(),
        size_m: track.size_m.into(),
        colour: if track.label().is_some() { [0.2, 0.8, 0.3, 0.5] } else { [0.6, 0.6, 0.6, 0.5] },
    }
}

fn confidences(mind: &Mind, eyes: Eyes<'_>) -> Vec<f64> {
    let now = Situation::new(mind.known.clone(), eyes.thresholds);
    (0..now.things.len()).map(|what| now.confidence(what)).collect()
}

/// Percept as one line of text.
pub fn in_a_line(p: &Percept) -> String {
    let name = p.label.as_deref().unwrap_or("unknown");
    let probability = p.label.as_deref().map_or(p.unknown, |label| p.probability_of(label));
    let at = english::position(p.position_m.coords.into());
    let ([w, d, h], seen) = (p.size_m.map(|m| m * 100.0), p.seen_fraction * 100.0);
    let sure = english::percent(probability);
    format!("{name:16} {sure:>6} {at}, {w:.0}x{d:.0}x{h:.0} cm, {seen:.0} % seen")
}

/// Adds the views of a surface to its observed space; rebuilds the space if a view was dropped,
/// restored or moved.
fn take_in(mind: &mut Mind, on: usize, views: &[View], merged: &Merged) {
    let (region, space) = (&mut mind.regions[on], Arc::make_mut(&mut mind.known.spaces[on]));
    let used: Vec<(i64, &View, Isometry3<f64>)> = region
        .looks
        .iter()
        .zip(views.iter().zip(&merged.fits))
        .filter(|(_, (_, fit))| fit.used)
        .map(|(look, (view, fit))| (look.stamp_ns, view, fit.world_from_camera))
        .collect();
    let lies_there = |(stamp_ns, pose): &(i64, Isometry3<f64>)| {
        let is_it =
            |(s, _, p): &(i64, &View, Isometry3<f64>)| s == stamp_ns && is_near(p, pose, space.voxel_m());
        used.iter().any(is_it)
    };
    if !region.taken_in.iter().all(lies_there) {
        *space = Space::default();
        region.taken_in.clear();
    }
    for (stamp_ns, view, pose) in used {
        if region.taken_in.iter().any(|&(s, _)| s == stamp_ns) {
            continue;
        }
        if let Some(map) = DepthMap::from_view(view, &pose) {
            space.integrate(&map);
        }
        region.taken_in.push((stamp_ns, pose));
    }
}

/// True if a point two metres in front of the camera falls into the same voxel from two poses.
fn is_near(a: &Isometry3<f64>, b: &Isometry3<f64>, voxel_m: f64) -> bool {
    let turn_rad = a.rotation.angle_to(&b.rotation);
    (a.translation.vector - b.translation.vector).norm() + 2.0 * turn_rad < voxel_m
}

/// Depth map of the newest view at its registered pose; `None` if unregistered.
fn newest(views: &[View], merged: &Merged) -> Option<DepthMap> {
    let (fit, view) = merged.fits.last().filter(|fit| fit.used).zip(views.last())?;
    DepthMap::from_view(view, &fit.world_from_camera)
}

/// Labelled percepts as recorded sightings, with their probabilities.
fn sightings(percepts: &[Percept]) -> Vec<Sighting> {
    let of = |p: &Percept| p.label.clone().map(|label| (p.probability_of(&label), label));
    let named = percepts.iter().filter_map(of);
    named.map(|(p, object)| Sighting { object, confidence: p.clamp(0.0, 1.0) }).collect()
}

/// Convex outline of an object's points projected onto its support.
fn footprint(p: &Percept, up: &Vector3<f64>, merged: &Merged) -> Vec<Point3<f64>> {
    let below = Plane { normal: *up, offset_m: up.dot(&p.position_m.coords) };
    let points = p.indices.iter().map(|&n| &merged.cloud.points[n as usize]);
    Hull::around(below, points).map_or_else(Vec::new, |hull| hull.corners_in_space())
}

/// Positions of the cameras that saw an object, that is, measured the facing side of its body.
fn seen_from(p: &Percept, up: &Vector3<f64>, visibility: &Visibility) -> Vec<Point3<f64>> {
    let middle = p.position_m + up * (p.size_m[2] / 2.0);
    let radius = p.size_m[0].min(p.size_m[1]) / 2.0;
    let sees = |map: &&DepthMap| {
        let towards = map.viewpoint() - middle;
        let aside = towards - up * towards.dot(up);
        let side = middle + aside.try_normalize(1e-9).unwrap_or(*up) * radius;
        map.look(&side, vanished::SIDE_TOLERANCE_M) == Seen::Surface
    };
    visibility.maps.iter().filter(sees).map(DepthMap::viewpoint).collect()
}
