//! World-model updates from a visit, from a view of a novel object, and from its model.

use std::sync::Arc;

use descry_memory::RecordId;
use descry_memory::learned::{LearnedThing, Place as Seen};
use descry_perception::learning::{
    Appeared, LearnOptions, LearnedModel, MetaRoom, NoticeOptions, Visit, united,
};
use descry_perception::nalgebra::{Isometry3, Point3, Vector3, center};
use descry_perception::visibility::{DepthMap, Seen as Sight};
use descry_perception::{Cloud, View};
use descry_robots::{Description, Sensed};
use descry_skills::Modelled;

use super::again::{self, Found};
use super::news::{DIRECTIONS, Fate, Models, Novelty};
use super::stands;
use crate::abilities::learning::news::{Difference, NoveltyView};
use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::looking::{placing, recording};
use crate::mind::Mind;
use crate::note::Note;
use crate::surface::KnownSurface;

/// Search radius for the localisation error between two visits, metres: localisation errs by centimetres and
/// by degrees, which at a distance of two metres are centimetres, too.
const SEARCH_M: f32 = 0.15;
/// Minimum share of differing points for which a visit is rejected, because the body is not where it
/// believes to be.
const STRANGE: f64 = 0.3;
/// Maximum height of an object's lowest point above or below the surface that it stands on, metres.
const ON_M: f64 = 0.06;
/// Maximum distance of an object's centre beyond the outline of its surface, metres.
const BESIDE_M: f64 = 0.05;
/// Second-longest side of a change, metres, below which the change is only an edge that was measured
/// differently.
const SLIVER_M: f64 = 0.04;
/// Second-longest side of an elongated change, metres, below which the change is a table edge or a leg.
const EDGE_M: f64 = 0.08;
/// Minimum ratio of the longest side to the second-longest of such an elongated change.
const LONG: f64 = 6.0;
/// Distance beyond a novel object's radius within which an appeared part belongs to the object,
/// metres.
const OF_IT_M: f64 = 0.1;
/// Maximum gap below a piece that hangs over a new object and still counts as part of it, metres; a
/// camera from above cannot see into the gap.
const OVER_IT_M: f32 = 0.1;
/// Distance below which two detections are the same object, metres.
const SAME_M: f64 = 0.12;
/// Minimum confidence of a match to identify an object with a learned one.
const SURE: f64 = 0.8;
/// Minimum share of an object's points that the matching learned object explains.
const EXPLAINED: f64 = 0.5;
/// Minimum share of seen sides for a learned object to be complete; a less complete one is viewed from
/// all around when met again.
const KNOWN_ROUND: f64 = 0.8;
/// Ratio between the model's size and the detected one above which, with [`GROWN_M`] added, the model
/// includes something that the object stands on or beside.
const GROWN: f64 = 2.0;
/// Margin on the sides of a model in that comparison, metres.
const GROWN_M: f64 = 0.1;
/// Minimum share of the observed points of an object that a view looked through for the object to count
/// as gone.
const THROUGH: f64 = 0.6;
/// Minimum number of points of an object that a view must observe, solid or looked through, to decide
/// that.
const LOOKED_AT: u32 = 50;
/// Distance behind a point from which a depth reading counts as looking through it, metres.
const BEYOND_M: f64 = 0.03;

/// Records a view used for learning, and reads it back by its timestamp.
fn remember(mind: &mut Mind, eyes: Eyes<'_>, sensed: &Sensed) -> Result<View, WorldError> {
    let id = recording::view(mind, eyes, &[], sensed)?;
    let news = mind.known.news_mut();
    news.records.push(id);
    let records: &[RecordId] = &news.records;
    eyes.record.hold(records, "news")?;
    Ok(eyes.record.view_at(sensed.stamp_ns, &eyes.robot.description().frames.map)?)
}

/// Handles a visit: detects novel and vanished objects.
pub(super) fn visit(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    waypoint: &str,
    sensed: &Sensed,
) -> Result<Note, WorldError> {
    let view = remember(mind, eyes, sensed)?;
    let at = mind.known.news().places.iter().position(|p| p.waypoint == waypoint);
    let at = at.ok_or_else(|| WorldError::Bug(format!("`{waypoint}` is no place to visit")))?;
    let place = mind.known.news().places[at].clone();
    let options = NoticeOptions { search_m: SEARCH_M, ..NoticeOptions::default() };
    let strange = |e: descry_perception::learning::LearningError| WorldError::Bug(format!("a visit: {e}"));
    let surface = mind.known.surfaces.iter().find(|s| s.symbol == place.on);
    let localised = view.world_from_camera;
    let views = [match surface {
        Some(surface) => placing::laid(eyes, surface, view),
        None => view,
    }];
    let views_pose = views[0].world_from_camera;
    let mut told = Told { waypoint: waypoint.into(), ..Told::default() };
    let compared = match &place.room {
        None => {
            let room = MetaRoom::new(&views, options).map_err(strange)?;
            Some((room, None))
        }
        Some(before) => {
            let mut room = MetaRoom { options, ..MetaRoom::clone(before) };
            let visit = room.visit(&views).map_err(strange)?;
            told.pose = visit.poses.first().copied();
            told.strange = misfit(eyes.robot.description(), &localised, &visit, &views[0]);
            told.strange.is_none().then_some((room, Some(visit)))
        }
    };
    let place = &mut mind.known.news_mut().places[at];
    place.is_visited = true;
    place.strange.clone_from(&told.strange);
    let on = place.on.clone();
    if let Some((room, visit)) = compared {
        told.visits = room.visits;
        place.room = Some(Arc::new(room));
        if let Some(visit) = visit {
            take_in(mind, eyes, &on, waypoint, (&views[0], visit), &mut told);
        }
    }
    let off = told.pose.unwrap_or(views_pose).inverse() * localised;
    Ok(told.note(&off))
}

/// Reason why a visit cannot be compared with earlier ones, if any: alignment moved it beyond the
/// localisation error (the alignment is wrong or the body is lost, and all static structure would
/// look new), or no alignment was found.
pub fn misfit(body: &Description, localised: &Isometry3<f64>, visit: &Visit, view: &View) -> Option<String> {
    /// Minimum assumed alignment error of a visit, metres and radians: half of the tolerance of the
    /// comparison.
    const LAID: (f64, f64) = (0.005, 0.005);
    let [sigma_m, sigma_rad] = [body.pose_sigma_m.max(LAID.0), body.pose_sigma_rad.max(LAID.1)];
    let body = &Description { pose_sigma_m: sigma_m, pose_sigma_rad: sigma_rad, ..body.clone() };
    let astray = visit.poses.first().filter(|laid| placing::is_astray(body, localised, laid));
    if astray.is_some() {
        return Some("it would fit what was there only farther off than localisation errs".into());
    }
    let off = differing(visit, view);
    (off >= STRANGE).then(|| format!("{:.0} % of what is seen differs from what was there", 1e2 * off))
}

/// Share of the points of a view that appeared since earlier visits, 0 to 1.
fn differing(visit: &Visit, view: &View) -> f64 {
    let came: usize = visit.appeared.iter().map(|a| a.mask.iter().filter(|m| **m).count()).sum();
    came as f64 / view.cloud.count_finite().max(1) as f64
}

/// Report of a visit, as it is collected.
#[derive(Default)]
struct Told {
    waypoint: String,
    visits: usize,
    /// Camera pose, aligned with earlier visits.
    pose: Option<Isometry3<f64>>,
    strange: Option<String>,
    came: Vec<String>,
    gone: Vec<String>,
}

impl Told {
    fn note(self, off: &Isometry3<f64>) -> Note {
        let Told { waypoint, visits, strange, came, gone, .. } = self;
        let (moved_m, turned_rad) = (off.translation.vector.norm(), off.rotation.angle());
        Note::Visited { waypoint, visits, moved_m, turned_rad, strange, came, gone }
    }
}

/// Updates the state from a comparison with earlier visits: recognised learned objects are located;
/// other objects that appeared on a surface are novel.
fn take_in(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    on: &str,
    waypoint: &str,
    (view, visit): (&View, Visit),
    told: &mut Told,
) {
    let pose = visit.poses.first().copied().unwrap_or(view.world_from_camera);
    let view = Arc::new(View { world_from_camera: pose, ..view.clone() });
    let seen = view.cloud.finite().transformed(&pose);
    let up = eyes.robot.description().up;
    let shown = [(&*view, pose)];
    let mut found = again::find(mind, (&shown[..], up), Vec::new(), |_| true);
    found.retain(|f| f.judged.confidence >= SURE);
    for appeared in &whole(&mind.known.surfaces, visit.appeared) {
        let surface = mind.known.surfaces.iter().find(|s| is_on(s, &appeared.cloud)).cloned();
        let Some(surface) = surface else {
            let (at, size_m) = extent(&appeared.cloud);
            let is_of = |n: &Novelty| (n.centre - at).xy().norm() < n.radius_m() + OF_IT_M;
            if !appeared.apart || mind.known.news().novelties.iter().any(is_of) {
                continue;
            }
            told.came.push(format!("something on no surface, {}", size(&size_m, &at)));
            change(mind, Difference::Beside { at, size_m });
            continue;
        };
        let known = found.iter().find(|f| f.share_of(&appeared.cloud.points) >= EXPLAINED);
        let look = (&view, appeared);
        match known {
            Some(f) => {
                told.came.push(known_again(mind, &surface, f));
                let thing = &mind.known.news().things[f.thing];
                if thing.sides < KNOWN_ROUND {
                    let (name, sides) = (thing.name.clone(), 1e2 * thing.sides);
                    let symbol =
                        new(mind, eyes, &surface.symbol, waypoint, look, &seen.points, Some(f.thing));
                    let again = |symbol| {
                        format!("{symbol}: {name} again, to see more than {sides:.0} % of its sides")
                    };
                    told.came.extend(symbol.map(again));
                }
            }
            None if is_known_there(mind, &appeared.cloud) => {}
            None => {
                let (at, size_m) = extent(&appeared.cloud);
                let symbol = new(mind, eyes, &surface.symbol, waypoint, look, &seen.points, None);
                let said = |symbol| format!("{symbol}: something new, {}", size(&size_m, &at));
                told.came.extend(symbol.map(said));
            }
        }
    }
    for gone in visit.gone.iter().filter(|gone| !is_sliver(gone)) {
        let (at, size_m) = extent(gone);
        told.gone.push(size(&size_m, &at));
        change(mind, Difference::Gone { at, size_m });
    }
    if let Some(map) = DepthMap::from_view(&view, &pose) {
        told.gone.extend(left(mind, on, &map));
    }
}

/// Appeared objects, those on a surface first. An object whose top occludes its middle, such as a
/// lamp, appears in pieces; a piece on no surface is merged with the object beneath.
fn whole(surfaces: &[KnownSurface], appeared: Vec<Appeared>) -> Vec<Appeared> {
    let came = appeared.into_iter().filter(|a| !is_sliver(&a.cloud));
    let (mut all, aloft): (Vec<Appeared>, Vec<Appeared>) =
        came.partition(|a| surfaces.iter().any(|s| is_on(s, &a.cloud)));
    let standing = all.len();
    for piece in aloft {
        let is_under = |a: &&mut Appeared| a.view == piece.view && is_over(&piece.cloud, &a.cloud);
        match all[..standing].iter_mut().find(is_under) {
            Some(below) => {
                below.cloud.append(&piece.cloud);
                below.mask.iter_mut().zip(&piece.mask).for_each(|(pixel, of_piece)| *pixel |= of_piece);
            }
            None => all.push(piece),
        }
    }
    all
}

/// True if a piece hangs over another: from above, one covers the centre of the other, with a small gap
/// between them.
pub fn is_over(piece: &Cloud, below: &Cloud) -> bool {
    let (Some(above), Some(under)) = (piece.bounds(), below.bounds()) else { return false };
    let holds = |(low, high): (Point3<f32>, Point3<f32>), (l, h): (Point3<f32>, Point3<f32>)| {
        let middle = center(&l, &h);
        (0..2).all(|k| (low[k]..=high[k]).contains(&middle[k]))
    };
    (holds(above, under) || holds(under, above)) && above.0.z > under.0.z && above.0.z - under.1.z < OVER_IT_M
}

fn extent(cloud: &Cloud) -> (Point3<f64>, [f64; 3]) {
    let (low, high) = cloud.bounds().unwrap_or_default();
    (center(&low, &high).cast(), (high - low).cast().into())
}

fn is_sliver(cloud: &Cloud) -> bool {
    let (_, mut size_m) = extent(cloud);
    size_m.sort_by(f64::total_cmp);
    size_m[1] < SLIVER_M || size_m[1] < EDGE_M && size_m[2] > LONG * size_m[1]
}

/// Text of a size (`[w, d, h]`, metres, shown in centimetres) and a position (map frame, metres).
pub(super) fn size([w, d, h]: &[f64; 3], at: &Point3<f64>) -> String {
    let [w, d, h] = [w, d, h].map(|m| 1e2 * m);
    format!("{w:.0} x {d:.0} x {h:.0} cm at ({:.2}, {:.2}, {:.2}) m", at.x, at.y, at.z)
}

/// True if an appeared object stands on a surface.
fn is_on(surface: &KnownSurface, cloud: &Cloud) -> bool {
    let Some(corner) = surface.outline.first() else { return false };
    let (middle, _) = extent(cloud);
    let height = |p: &Point3<f32>| surface.up.dot(&(p.cast::<f64>() - corner));
    let lowest = cloud.points.iter().map(height).fold(f64::INFINITY, f64::min);
    surface.covers(&middle, BESIDE_M) && lowest.abs() < ON_M.max(0.25 * height(&middle.cast()).abs())
}

/// Adds a change unless it is already listed.
fn change(mind: &mut Mind, change: Difference) {
    let at = |c: &Difference| match c {
        Difference::Came { at, .. }
        | Difference::Left { at, .. }
        | Difference::Gone { at, .. }
        | Difference::Beside { at, .. } => *at,
    };
    let news = mind.known.news_mut();
    let is_one = |c: &Difference| {
        std::mem::discriminant(c) == std::mem::discriminant(&change)
            && (at(c) - at(&change)).norm() < 2.0 * SAME_M
    };
    if !news.changes.iter().any(is_one) {
        news.changes.push(change);
    }
}

/// True if a learned object was already recognised at this cloud in this run, from another waypoint.
fn is_known_there(mind: &Mind, cloud: &Cloud) -> bool {
    let now_unix_s = mind.known.past.as_ref().map_or(0.0, |p| p.now_unix_s);
    let (at, size_m) = extent(cloud);
    let near_m = SAME_M.max(0.5 * size_m[0].hypot(size_m[1]));
    mind.known.news().things.iter().any(|t| t.seen.unix_s == now_unix_s && (t.seen.at_m - at).norm() < near_m)
}

/// Records the new place of a recognised learned object and settles novelties there; returns a sentence.
fn known_again(mind: &mut Mind, surface: &KnownSurface, f: &Found) -> String {
    let at = Point3::from(f.judged.world_from_model.translation.vector);
    let now_unix_s = mind.known.past.as_ref().map_or(0.0, |p| p.now_unix_s);
    let thing = &mut mind.known.news_mut().things[f.thing];
    let before =
        std::mem::replace(&mut thing.seen, Seen { unix_s: now_unix_s, at_m: at, on: surface.symbol.clone() });
    let name = thing.name.clone();
    let p = f.judged.confidence;
    let is_it = |n: &&mut Novelty| n.fate == Fate::Open && (n.centre - at).norm() < SAME_M.max(n.radius_m());
    let noticed = mind.known.news_mut().novelties.iter_mut().filter(|n| n.taken_for.is_none()).find(is_it);
    if let Some(novelty) = noticed {
        novelty.fate = Fate::Known { name: name.clone(), confidence: p, model: None };
    }
    let is_moved = (before.at_m - at).norm() > SAME_M;
    if is_moved {
        change(mind, Difference::Came { name: name.clone(), at, before: before.at_m });
    }
    let there = if is_moved { "which stood elsewhere" } else { "as before" };
    format!("{name} ({p:.2}), {there}, at ({:.2}, {:.2}) m", at.x, at.y)
}

/// Registers an object to be viewed from all around, novel or incompletely known (`taken_for`);
/// returns the symbol if it was not registered before.
pub fn new(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    on: &str,
    waypoint: &str,
    (view, appeared): (&Arc<View>, &Appeared),
    seen: &[Point3<f32>],
    taken_for: Option<usize>,
) -> Option<String> {
    let (centre, size_m) = extent(&appeared.cloud);
    let look = NoveltyView { from: waypoint.into(), view: Arc::clone(view) };
    let news = mind.known.news_mut();
    let is_one = |n: &&mut Novelty| (n.centre - centre).norm() < SAME_M.max(n.radius_m());
    if let Some(known) = news.novelties.iter_mut().find(is_one) {
        if known.fate == Fate::Open {
            known.looks.push(look);
        }
        return None;
    }
    let symbol = format!("new-{}", news.novelties.len() + 1);
    let (stands, joined) = stands::make(mind, eyes.robot, &symbol, &centre, seen);
    mind.known.news_mut().novelties.push(Novelty {
        symbol: symbol.clone(),
        on: on.into(),
        centre,
        size_m,
        looks: vec![look],
        mask: Arc::new(appeared.mask.clone()),
        stands,
        joined,
        taken_for,
        fate: Fate::Open,
    });
    Some(symbol)
}

/// Sentences on the learned objects of a surface that the depth map looked through; they are listed as
/// gone.
fn left(mind: &mut Mind, on: &str, map: &DepthMap) -> Vec<String> {
    let is_there = |t: &&LearnedThing| t.seen.on == on;
    let of = |t: &LearnedThing| (t.name.clone(), t.seen.at_m, t.cloud.clone());
    let here: Vec<_> = mind.known.news().things.iter().filter(is_there).map(of).collect();
    let mut said = Vec::new();
    for (name, at, cloud) in here {
        let (mut through, mut looked_at) = (0_u32, 0_u32);
        for p in &cloud.points {
            match map.look(&(at + p.coords.cast::<f64>()), BEYOND_M) {
                Sight::Free => (through, looked_at) = (through + 1, looked_at + 1),
                Sight::Surface => looked_at += 1,
                Sight::Hidden | Sight::Never => {}
            }
        }
        if looked_at >= LOOKED_AT && f64::from(through) / f64::from(looked_at) > THROUGH {
            said.push(format!("{name}, which stood at ({:.2}, {:.2}) m", at.x, at.y));
            change(mind, Difference::Left { name, at });
        }
    }
    said
}

/// Handles a view of a novel object; returns a sentence.
pub(super) fn face(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    from: &str,
    what: &str,
    sensed: &Sensed,
) -> Result<String, WorldError> {
    let view = Arc::new(remember(mind, eyes, sensed)?);
    let novelty = novelty(mind, what)?;
    novelty.looks.push(NoveltyView { from: from.into(), view });
    let sides = novelty.seen().len() as f64 / DIRECTIONS as f64;
    Ok(format!("{:.0} % of its sides were seen in {} looks", 1e2 * sides, novelty.looks.len()))
}

fn novelty<'a>(mind: &'a mut Mind, what: &str) -> Result<&'a mut Novelty, WorldError> {
    let news = mind.known.news_mut();
    let found = news.novelties.iter_mut().find(|n| n.symbol == what);
    found.ok_or_else(|| WorldError::Bug(format!("`{what}` is gone")))
}

/// Extends the model of a known object by views from all around, if model and views match; returns
/// a sentence about the result.
fn improved(mind: &mut Mind, f: &Found, looks: &Novelty, model: &LearnedModel) -> String {
    let news = mind.known.news_mut();
    let thing = &mut news.things[f.thing];
    let known_from_more = f.judged.world_from_model.inverse() * model.world_from_model;
    let cube_m = LearnOptions::default().cube_m;
    let one = match united(&thing.cloud, thing.meetings, &model.cloud, &known_from_more, cube_m) {
        Ok(one) => one,
        Err(because) => return format!("its model stays as it is: {because}"),
    };
    let ((_, before_m), (_, size_m)) = (extent(&thing.cloud), extent(&one.cloud));
    if (0..3).any(|k| size_m[k] > before_m[k] + GROWN_M) {
        return "its model stays as it is: what was taken for it now is larger than it".into();
    }
    let world_from_known = model.world_from_model * one.known_from_more.inverse();
    let ahead = world_from_known * Vector3::x();
    let sides = thing.sides;
    thing.directions |= looks.directions(ahead.y.atan2(ahead.x));
    thing.sides = sides.max(f64::from(thing.directions.count_ones()) / DIRECTIONS as f64);
    thing.meetings += 1;
    let points = (thing.cloud.len(), one.cloud.len());
    thing.cloud = one.cloud;
    let said = format!(
        "its model is better by {} looks: {} points, {} before, {:.0} % of its sides seen, {:.0} % before",
        looks.looks.len(),
        points.1,
        points.0,
        1e2 * thing.sides,
        1e2 * sides
    );
    make_ready(mind);
    said
}

/// Gives up learning an object, with the reason.
fn given_up(mind: &mut Mind, what: &str, because: String) -> Result<String, WorldError> {
    let said = format!("it is not learned: {because}");
    novelty(mind, what)?.fate = Fate::GivenUp(because);
    Ok(said)
}

/// Prepares the learned objects for recognition after a change.
fn make_ready(mind: &mut Mind) {
    let news = mind.known.news_mut();
    news.models = Models::of(&news.things);
    again::forget(mind);
}

/// Handles a modelling result: the object is learned, known after all, or cannot be learned; returns a
/// sentence.
pub(super) fn learned(mind: &mut Mind, what: &str, modelled: &Modelled) -> Result<String, WorldError> {
    let of = novelty(mind, what)?.clone();
    let poses = |n: usize| modelled.keyframes.get(n).map(|k| k.world_from_camera);
    let is_used = |n: usize| match &modelled.model {
        Ok(model) => model.looks.get(n).is_some_and(|u| u.left_out.is_none()),
        Err(_) => modelled.keyframes.get(n).is_some_and(|k| k.used),
    };
    let used: Vec<usize> = (0..of.looks.len()).filter(|&n| is_used(n)).collect();
    let seen = Novelty { looks: used.iter().map(|&n| of.looks[n].clone()).collect(), ..of.clone() };
    let views: Vec<(&View, Isometry3<f64>)> =
        used.iter().filter_map(|&n| Some((&*of.looks[n].view, poses(n)?))).collect();
    let near = |p: &Point3<f64>| (p - of.centre).norm() < SAME_M.max(of.radius_m());
    let surface = mind.known.surfaces.iter().find(|s| s.symbol == of.on).cloned();
    let up = surface.as_ref().map(|s| s.up);
    let before = again::find(mind, (&views[..], up), Vec::new(), near);
    if let Some((f, surface)) = before.iter().find(|f| f.judged.confidence >= SURE).zip(surface) {
        let (name, confidence) = (mind.known.news().things[f.thing].name.clone(), f.judged.confidence);
        let said = known_again(mind, &surface, f);
        let model = modelled.model.as_ref().ok().map(|model| improved(mind, f, &seen, model));
        let improved = model.as_ref().map(|model| format!("; {model}")).unwrap_or_default();
        novelty(mind, what)?.fate = Fate::Known { name, confidence, model };
        return Ok(format!("it is known: {said}{improved}"));
    }
    if let Some(thing) = of.taken_for {
        let name = &mind.known.news().things[thing].name;
        let because = format!("it was taken for {name}, which looks from around do not confirm");
        return given_up(mind, what, because);
    }
    let model = match &modelled.model {
        Ok(model) => model,
        Err(because) => return given_up(mind, what, because.clone()),
    };
    let (_, size_m) = extent(&model.cloud);
    if (0..3).any(|k| size_m[k] > GROWN * of.size_m[k] + GROWN_M) {
        let at = Point3::from(model.world_from_model.translation.vector);
        let because = format!("what was taken for it grew beyond what had come, to {}", size(&size_m, &at));
        return given_up(mind, what, because);
    }
    let left_out = (0..of.looks.len()).filter(|n| !used.contains(n)).filter_map(|n| {
        let own = modelled.keyframes.get(n).filter(|k| !k.used).map(|k| k.why.clone());
        let why = own.or_else(|| model.looks[n].left_out.clone())?;
        Some(format!("\n          look {} left out: {why}", n + 1))
    });
    let said = keep(mind, what, (&seen, of.looks.len()), model)?;
    Ok(said + &left_out.collect::<String>())
}

/// Stores the model of a novel object, from the registered views, under a new name; returns a
/// sentence.
fn keep(
    mind: &mut Mind,
    what: &str,
    (seen, looks): (&Novelty, usize),
    model: &LearnedModel,
) -> Result<String, WorldError> {
    let directions = seen.directions(0.0);
    let sides = f64::from(directions.count_ones()) / DIRECTIONS as f64;
    let now_unix_s = mind.known.past.as_ref().map_or(0.0, |p| p.now_unix_s);
    let at_m = Point3::from(model.world_from_model.translation.vector);
    let news = mind.known.news_mut();
    let name = news.free_name();
    news.things.push(LearnedThing {
        name: name.clone(),
        learned_unix_s: now_unix_s,
        cloud: model.cloud.clone(),
        sides,
        directions,
        meetings: 1,
        seen: Seen { unix_s: now_unix_s, at_m, on: seen.on.clone() },
    });
    news.learned += 1;
    make_ready(mind);
    let looks = (seen.looks.len(), looks);
    novelty(mind, what)?.fate = Fate::Learned { name: name.clone(), looks, sides };
    let (_, size_m) = extent(&model.cloud);
    Ok(format!(
        "{name} is learned from {} of {} looks: {} points, {}, {:.0} % of its sides seen",
        looks.0,
        looks.1,
        model.cloud.len(),
        size(&size_m, &at_m),
        1e2 * sides
    ))
}
