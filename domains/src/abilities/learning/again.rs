//! Recognition of learned objects on a surface, in any domain: candidates from single views are
//! verified against all views, and the verified ones explain the tracked objects.

use std::collections::BTreeMap;
use std::sync::Arc;

use descry_memory::learned::LearnedThing;
use descry_perception::learning::{Glance, Guess, Judged, KnowOptions};
use descry_perception::merge::Merged;
use descry_perception::nalgebra::{Isometry3, Point3, Vector3};
use descry_perception::recognise::Percept;
use descry_perception::{Cloud, Neighbours, View};

use super::news::{Models, News};
use crate::mind::Mind;
use crate::states::state;
use crate::surface::KnownSurface;

/// Maximum range of depth returns used for recognition, metres.
const RANGE_M: f64 = 3.0;
/// Number of newest camera poses from which the merged cloud is examined for further candidates.
const TOGETHER: usize = 3;
/// Maximum number of candidates that are verified against all views, the most confident first.
const GUESSES: usize = 12;
/// Differences in position (metres) and orientation (radians) below which two candidates of one model
/// are the same.
const SAME: (f64, f64) = (0.03, 0.35);
/// Minimum confidence of a reported match.
const LEAST: f64 = 0.05;
/// Distance from a learned model's surface within which points belong to the object, metres; half of it
/// allows for the error of view alignment.
const OF_IT_M: f32 = 0.015;
/// Minimum share of an object's points that a learned model must explain to name the object.
const SHARE: f64 = 0.6;
/// Distance beyond a surface's outline within which an object's centre may lie, metres.
const BESIDE_M: f64 = 0.03;
/// Heights above a surface between which an object's centre may lie, metres.
const ABOVE_M: (f64, f64) = (-0.02, 0.6);
/// Prior probability that some object is the sought learned thing.
const PRIOR: f64 = 0.3;
/// Probability that one view of a learned object does not recognise it: 8 of 20 views in twelve searches
/// of `tests/learning.py`.
const MISSED: f64 = 0.4;
/// Minimum share of sides seen for a learned model to count as complete; below it, the object may be
/// larger than the model.
const HALF: f64 = 0.5;
/// Margin by which an object must be longer than a learned one to be another object, metres.
const LONGER_M: f64 = 0.03;
/// Share of a learned object's length below which a well-seen object, with all neighbours that may be
/// parts of it, is another object.
const SHORTER: f64 = 0.6;
/// Gap within which a neighbour may be a part of the same object, metres.
const BESIDE_IT_M: f64 = 0.04;
/// Remaining probability that an object of another length is the learned one.
pub const NOT_IT: f64 = 0.002;

/// Cache of recognition results of single views, by timestamp of the view in nanoseconds.
#[derive(Clone, Default)]
struct Glances {
    by_time: BTreeMap<i64, Arc<Glance>>,
    /// Number of scene disturbances when the cached results were computed; a later disturbance
    /// invalidates them.
    disturbed: usize,
}

state!(Glances);

/// Clears cached recognition results, because the set of learned objects has changed.
pub(super) fn forget(mind: &mut Mind) {
    mind.known.states.get_mut::<Glances>().by_time.clear();
}

/// Takes the recognition results out of the cache; no results if the scene was disturbed since they were
/// computed.
fn glances(mind: &mut Mind) -> BTreeMap<i64, Arc<Glance>> {
    let disturbed = mind.disturbed;
    let kept: &mut Glances = mind.known.states.get_mut();
    let held = std::mem::take(&mut kept.by_time);
    let still_hold = std::mem::replace(&mut kept.disturbed, disturbed) == disturbed;
    if still_hold { held } else { BTreeMap::new() }
}

/// Recognised learned object.
pub struct Found {
    /// Index in [`News::things`].
    pub thing: usize,
    /// Pose and confidence of the match.
    pub judged: Judged,
    /// Model surface at that pose.
    pub cloud: Cloud,
    tree: Neighbours,
}

impl Found {
    /// Share of the given points (world frame) that lie on the object, 0 to 1.
    pub fn share_of(&self, points: &[Point3<f32>]) -> f64 {
        let near = |p: &&Point3<f32>| self.tree.nearest(p, OF_IT_M).is_some();
        points.iter().filter(near).count() as f64 / points.len().max(1) as f64
    }
}

/// Views with their camera poses, and the up direction if known.
type Shown<'a> = (&'a [(&'a View, Isometry3<f64>)], Option<Vector3<f64>>);

/// Candidate with the pose of its model in the world.
type Placed = (Guess, Isometry3<f64>);

/// Learned objects recognised in the views, most confident first, without overlaps. Candidates come from
/// single views and from `suggested`; only those whose position satisfies `holds` are verified.
pub(super) fn find(
    mind: &mut Mind,
    (views, up): Shown<'_>,
    suggested: Vec<Placed>,
    holds: impl Fn(&Point3<f64>) -> bool,
) -> Vec<Found> {
    let Some(models) = mind.known.news().models.clone() else { return Vec::new() };
    let mut glances = glances(mind);
    let options = options(up);
    let looks: Vec<(Arc<Glance>, Isometry3<f64>)> = views
        .iter()
        .filter_map(|(view, pose)| {
            if let Some(known) = glances.get(&view.stamp_ns) {
                return Some((Arc::clone(known), *pose));
            }
            let glance = Arc::new(models.known.glance(view, &options).ok()?);
            glances.insert(view.stamp_ns, Arc::clone(&glance));
            Some((glance, *pose))
        })
        .collect();
    mind.known.states.get_mut::<Glances>().by_time = glances;
    let news = mind.known.news();
    let looks: Vec<(&Glance, Isometry3<f64>)> = looks.iter().map(|(g, pose)| (&**g, *pose)).collect();
    let mut guesses: Vec<Placed> = Vec::new();
    let mut all: Vec<Placed> = looks.iter().flat_map(|(glance, pose)| placed(glance, pose)).collect();
    all.extend(suggested);
    all.sort_by(|a, b| b.0.confidence.total_cmp(&a.0.confidence));
    for (guess, at) in all {
        let is_one = |other: &Placed| other.0.model == guess.model && is_same(&other.1, &at);
        let middle = Point3::from(at.translation.vector);
        if guesses.len() < GUESSES && holds(&middle) && !guesses.iter().any(is_one) {
            guesses.push((guess, at));
        }
    }
    let judged = guesses.iter().filter_map(|(guess, at)| {
        let judged = models.known.judge(guess, at, &looks, &options).ok()??;
        found(news, &models, guess.model, judged)
    });
    let mut judged: Vec<Found> = judged.filter(|f| f.judged.confidence >= LEAST).collect();
    judged.sort_by(|a, b| b.judged.confidence.total_cmp(&a.judged.confidence));
    let mut apart: Vec<Found> = Vec::new();
    for f in judged {
        // Two of the same kind of thing may stand there; in one place there is one.
        if apart.iter().all(|other| other.share_of(&f.cloud.points) < 0.3) {
            apart.push(f);
        }
    }
    apart
}

/// Recognition options for an up direction in the world. Models have z up; for an unknown or tilted up
/// direction, any orientation is tried.
fn options(up: Option<Vector3<f64>>) -> KnowOptions {
    /// Largest angle from z at which the up direction is that of the models, radians.
    const LEVEL_RAD: f64 = 0.1;
    let up = up.filter(|up| up.angle(&Vector3::z()) < LEVEL_RAD).map(|_| Vector3::z_axis());
    KnowOptions { range_m: RANGE_M, up, ..KnowOptions::default() }
}

fn placed(glance: &Glance, world_from_camera: &Isometry3<f64>) -> Vec<Placed> {
    glance.guesses.iter().map(|guess| (*guess, world_from_camera * guess.camera_from_model)).collect()
}

/// Candidates found in the merged cloud as seen from the newest cameras: less noisy than a single view.
fn together(
    models: &Models,
    surface: &KnownSurface,
    views: &[(&View, Isometry3<f64>)],
    merged: &Cloud,
) -> Vec<Placed> {
    let Some(normals) = &merged.normals else { return Vec::new() };
    let Some(corner) = surface.outline.first() else { return Vec::new() };
    let is_near = |p: &Point3<f64>| {
        let above_m = surface.up.dot(&(p - corner));
        surface.covers(p, BESIDE_M) && (ABOVE_M.0..ABOVE_M.1).contains(&above_m)
    };
    let seen = |(view, pose): &(&View, Isometry3<f64>)| {
        let eye = Point3::from(pose.translation.vector);
        let faces = |&i: &u32| {
            let (p, n) = (merged.points[i as usize].cast::<f64>(), normals[i as usize].cast::<f64>());
            is_near(&p) && n.dot(&(eye - p)) > 0.0
        };
        let facing: Vec<u32> = (0..merged.len() as u32).filter(faces).collect();
        let cloud = merged.select(&facing).transformed(&pose.inverse());
        let together = View { cloud, world_from_camera: *pose, ..View::clone(view) };
        models
            .known
            .glance(&together, &options(Some(surface.up)))
            .map_or_else(|_| Vec::new(), |g| placed(&g, pose))
    };
    views.iter().rev().take(TOGETHER).flat_map(seen).collect()
}

fn found(news: &News, models: &Models, model: usize, judged: Judged) -> Option<Found> {
    let thing = *models.things.get(model)?;
    let cloud = news.things.get(thing)?.cloud.transformed(&judged.world_from_model);
    let tree = Neighbours::new(&cloud.points).ok()?;
    Some(Found { thing, judged, cloud, tree })
}

fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    (a.translation.vector - b.translation.vector).norm() < SAME.0 && a.rotation.angle_to(&b.rotation) < SAME.1
}

/// True if an object with this centre may stand on the surface.
pub(super) fn stands_on(surface: &KnownSurface, middle: &Point3<f64>) -> bool {
    let above_m = surface.outline.first().map_or(0.0, |p| surface.up.dot(&(middle - p)));
    surface.covers(middle, BESIDE_M) && (ABOVE_M.0..ABOVE_M.1).contains(&above_m)
}

/// Assigns learned objects to the percepts on a surface; percepts of one object are merged. Indices of
/// the percepts refer to the points of `merged`.
pub(super) fn explain(
    mind: &mut Mind,
    on: usize,
    (views, merged): (&[View], &Merged),
    percepts: Vec<Percept>,
) -> Vec<Percept> {
    let Some(models) = mind.known.news().models.clone() else { return percepts };
    let placed = views.iter().zip(&merged.fits).filter(|(_, fit)| fit.used);
    let views: Vec<(&View, Isometry3<f64>)> =
        placed.map(|(view, fit)| (view, fit.world_from_camera)).collect();
    let surface = &mind.known.surfaces[on].clone();
    let merged = &merged.cloud;
    let suggested = together(&models, surface, &views, merged);
    let found = find(mind, (&views, Some(surface.up)), suggested, |middle| stands_on(surface, middle));
    let news = mind.known.news();
    let shares: Vec<Vec<f64>> = percepts
        .iter()
        .map(|p| {
            let own: Vec<Point3<f32>> =
                p.indices.iter().step_by(3).map(|&i| merged.points[i as usize]).collect();
            found.iter().map(|f| f.share_of(&own)).collect()
        })
        .collect();
    let mut explained: Vec<Percept> = Vec::new();
    let mut taken: Vec<bool> = vec![false; percepts.len()];
    for (n, f) in found.iter().enumerate() {
        let mut own: Vec<usize> =
            (0..percepts.len()).filter(|&k| shares[k][n] >= SHARE && !taken[k]).collect();
        own.sort_by_key(|&k| std::cmp::Reverse(percepts[k].points));
        let Some(&first) = own.first() else { continue };
        own.iter().for_each(|&k| taken[k] = true);
        let mut whole = percepts[first].clone();
        for &k in &own[1..] {
            whole.points += percepts[k].points;
            whole.indices.extend(&percepts[k].indices);
        }
        whole.indices.sort_unstable();
        place(&mut whole, f, surface);
        name(&mut whole, news, Ok(f));
        explained.push(whole);
    }
    let rest: Vec<Percept> =
        percepts.into_iter().zip(taken).filter(|(_, taken)| !taken).map(|(p, _)| p).collect();
    let sizes: Vec<f64> = rest.iter().map(|p| together_m(p, &rest)).collect();
    explained.extend(rest.into_iter().zip(sizes).map(|(mut p, longest_m)| {
        name(&mut p, news, Err(longest_m));
        p
    }));
    explained
}

/// Maximum extent of a percept together with near neighbours that may belong to the same object, metres.
fn together_m(percept: &Percept, all: &[Percept]) -> f64 {
    let reach = |p: &Percept| 0.5 * p.size_m[0].hypot(p.size_m[1]);
    let near = |p: &&Percept| {
        (p.position_m - percept.position_m).xy().norm() < reach(p) + reach(percept) + BESIDE_IT_M
    };
    let far = |p: &Percept| (p.position_m - percept.position_m).xy().norm() + reach(p);
    let wide_m = all.iter().filter(near).map(far).fold(reach(percept), f64::max) + reach(percept);
    let high_m = all.iter().filter(near).map(|p| p.size_m[2]).fold(percept.size_m[2], f64::max);
    wide_m.hypot(high_m)
}

/// Sets a percept's horizontal position and its size from the recognised model; its height above the
/// floor stays.
fn place(percept: &mut Percept, found: &Found, surface: &KnownSurface) {
    let middle = Point3::from(found.judged.world_from_model.translation.vector);
    let up_m = surface.up.dot(&(middle - percept.position_m));
    percept.position_m = middle - surface.up * up_m;
    if let Some((low, high)) = found.cloud.bounds() {
        let size = (high - low).cast::<f64>();
        percept.size_m = [size.x.max(size.y), size.x.min(size.y), size.z];
    }
}

/// Sets the name probabilities of a percept. `found` is the recognised object, or as `Err` the extent of
/// the percept with its neighbours, metres, by which recognition may have missed an object.
pub fn name(percept: &mut Percept, news: &News, found: Result<&Found, f64>) {
    let mut of_things: Vec<(String, f64)> = Vec::new();
    let is = found.ok().map(|f| (f.thing, f.judged.confidence.clamp(0.0, 0.999)));
    let left = 1.0 - is.map_or(0.0, |(_, p)| p);
    for (n, thing) in news.things.iter().enumerate() {
        let p = match is {
            Some((it, p)) if it == n => p,
            _ => left * missed(percept, thing, found.err()),
        };
        of_things.push((thing.name.clone(), p));
    }
    let sum: f64 = of_things.iter().map(|(_, p)| p).sum();
    let scale = if sum > 0.999 { 0.999 / sum } else { 1.0 };
    of_things.iter_mut().for_each(|(_, p)| *p *= scale);
    let rest = 1.0 - sum * scale;
    percept.probabilities.iter_mut().chain(&mut percept.kinds).for_each(|(_, p)| *p *= rest);
    percept.unknown *= rest;
    percept.kinds.extend(of_things.iter().cloned());
    percept.probabilities.extend(of_things);
    let best = percept.probabilities.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((name, _)) = best.filter(|(_, p)| *p > percept.unknown).cloned() {
        if news.things.iter().any(|t| t.name == name) {
            percept.kind = Some(name.clone());
        }
        percept.label = Some(name);
    } else {
        (percept.label, percept.kind) = (None, None);
    }
}

/// Probability that recognition missed the learned object in this percept, whose extent with neighbours
/// is at most `together_m` metres. Views of sides that were never learned carry no evidence, and an
/// incompletely learned object may be larger than its model.
pub fn missed(percept: &Percept, thing: &LearnedThing, together_m: Option<f64>) -> f64 {
    let (low, high) = thing.cloud.bounds().unwrap_or_default();
    let longest_m = f64::from((high - low).norm());
    let [w, d, h] = percept.size_m;
    let is_longer = w.hypot(d).hypot(h) > longest_m + LONGER_M && thing.sides >= HALF;
    let is_shorter = together_m.is_some_and(|m| m < SHORTER * longest_m) && percept.seen_fraction > 0.5;
    if is_longer || is_shorter {
        return NOT_IT;
    }
    let not_told = MISSED.max(1.0 - thing.sides).powi(percept.evidence.views as i32);
    PRIOR * not_told / (PRIOR * not_told + 1.0 - PRIOR)
}
