//! Perception of a mapping view: recorded, read back by its timestamp, registered to earlier views, and
//! added to the map.

use std::sync::Arc;

use descry_memory::{Draft, Image, Meta};
use descry_perception::mapping::{PairFit, Station};
use descry_perception::nalgebra::Isometry2;
use descry_robots::{Place, Robot, Sensed};
use serde_json::json;

use super::chart::{BODY_M, Chart, far_m, rectify};
use super::picture;
use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::looking::candidates::ring;
use crate::looking::recording;
use crate::mind::{Mind, Region};
use crate::note::Note;
use crate::own_map::OwnMap;
use crate::viewpoint::Candidate;

/// Record kind of the map.
const MAP: &str = "map";
/// Displacement of an extended surface's centre above which its ring of viewpoints is renewed,
/// metres.
const MOVED_M: f64 = 0.15;

/// Processes a mapping view; on return, the view and the updated map are recorded.
pub(super) fn take(mind: &mut Mind, eyes: Eyes<'_>, from: &str, sensed: &Sensed) -> Result<Note, WorldError> {
    let body = eyes.robot.description();
    let id = recording::view(mind, eyes, &[], sensed)?;
    let view = eyes.record.view_at(sensed.stamp_ns, &body.frames.map)?;
    let camera = body.camera.as_ref().ok_or_else(|| WorldError::Bug("a look without a camera".into()))?;
    let strange = |e: String| WorldError::Bug(format!("a look that maps: {e}"));
    let station = Station::of(&view).map_err(|e| strange(e.to_string()))?;
    let height_m = view.world_from_camera.translation.z;
    let (fit, believed) = mind
        .known
        .change_chart(|chart| {
            chart.records.push(id);
            let believed = chart.map_from_chart.inv_mul(&station.odom_from_level);
            let survey = chart.survey()?;
            let fit =
                survey.locate(&station, &believed, &rectify(body, camera)).map_err(|e| e.to_string())?;
            let at = fit.before_from_after;
            survey.add(&station, &at, height_m, far_m(camera), &BODY_M).map_err(|e| e.to_string())?;
            chart.stood.push(at);
            chart.believed.push(station.odom_from_level);
            chart.read(body);
            Ok((fit, believed))
        })
        .map_err(strange)?;
    meet_surfaces(mind, eyes.robot);
    look_out(mind, eyes.robot, from);
    keep(mind, eyes, sensed.stamp_ns)?;
    Ok(note(mind.known.chart(), &fit, &believed))
}

/// Registers the map's surfaces, with viewpoints around them if anything is sought.
fn meet_surfaces(mind: &mut Mind, robot: &dyn Robot) {
    for fresh in mind.known.chart().surfaces() {
        let known = mind.known.surfaces.iter().position(|s| s.symbol == fresh.symbol);
        let moved = match known {
            Some(n) if mind.regions[n].taken > 0 => continue,
            Some(n) => {
                let before = std::mem::replace(&mut mind.known.surfaces[n], fresh.clone());
                let off = before.centre().zip(fresh.centre()).map(|(a, b)| (a - b).norm());
                off.is_none_or(|off_m| off_m > MOVED_M)
            }
            None => {
                mind.known.surfaces.push(fresh.clone());
                mind.known.spaces.push(Arc::default());
                mind.regions.push(Region::default());
                true
            }
        };
        let is_sought = !(mind.known.things.is_empty() && mind.known.kinds.is_empty());
        if let Some(centre) = fresh.centre().filter(|_| moved && is_sought) {
            let of = format!("{}-", fresh.symbol);
            let here = mind.known.candidates[mind.known.at].place.clone();
            let found = ring(robot, &*mind.known.own_map, &here, &centre, &mind.known.chart().poses);
            let around = found.into_iter().map(|(k, place)| Candidate { symbol: format!("{of}{k}"), place });
            let around: Vec<Candidate> = around.collect();
            replace(mind, |symbol| symbol.starts_with(&of), around);
        }
    }
}

/// Replaces the exploration poses by newly found ones.
pub(super) fn look_out(mind: &mut Mind, robot: &dyn Robot, from: &str) {
    let Place::Pose(here) = mind.known.candidates[mind.known.at].place else { return };
    let here = Isometry2::new(here.point().coords, here.yaw_rad);
    let given_up = |symbol: &str| {
        symbol == from || mind.words.instances("out-of-reach").any(|a| a.first().is_some_and(|s| s == symbol))
    };
    mind.known.change_chart(|chart| chart.look_out(&here, robot.description(), given_up));
    let open: Vec<Candidate> = mind.known.chart().poses().collect();
    replace(mind, |symbol| symbol.starts_with("view-"), open);
}

/// Replaces the poses whose symbols satisfy `of`; those of the body's current place and of its last view
/// stay.
fn replace(mind: &mut Mind, of: impl Fn(&str) -> bool, by: Vec<Candidate>) {
    let known = &mut mind.known;
    let [at, looked_from] = [known.at, known.looked_from].map(|n| known.candidates[n].clone());
    known.candidates.retain(|c| !of(&c.symbol) || *c == at || *c == looked_from);
    let fresh: Vec<Candidate> =
        by.into_iter().filter(|c| known.candidates.iter().all(|k| k.symbol != c.symbol)).collect();
    known.candidates.extend(fresh);
    let find = |c: &Candidate| known.candidates.iter().position(|k| k == c).unwrap_or(0);
    (known.at, known.looked_from) = (find(&at), find(&looked_from));
    mind.attend();
}

/// Records the map and its picture.
fn keep(mind: &mut Mind, eyes: Eyes<'_>, stamp_ns: i64) -> Result<(), WorldError> {
    let chart = mind.known.chart();
    let Some(map) = &chart.map else { return Ok(()) };
    let body = json!({
        "rests_on": chart.records,
        "map_from_chart": chart.map_from_chart,
        "stood": chart.stood,
        "surfaces": chart.surfaces,
        "map": **map,
    });
    let meta = Meta { body, ..Meta::default() };
    let id = eyes.record.put(Draft { meta, ..Draft::new(MAP, stamp_ns) })?;
    let data = picture::png(chart, map).map_err(|e| WorldError::Bug(format!("a picture of the map: {e}")))?;
    let image = Image::Compressed { format: "png", data: &data };
    let drawn = eyes.record.put_image(stamp_ns, MAP, image, Meta::default())?;
    let mut held = chart.records.clone();
    held.extend([id, drawn]);
    Ok(eyes.record.hold(&held, MAP)?)
}

fn note(chart: &Chart, fit: &PairFit, believed: &Isometry2<f64>) -> Note {
    let off = believed.inv_mul(&fit.before_from_after);
    let (walls, cylinders) = chart.map.as_ref().map_or((&[][..], 0), |m| (&m.walls, m.cylinders.len()));
    let length = |w: &descry_perception::mapping::Wall| w.stretches_m.iter().map(|(a, b)| b - a).sum::<f64>();
    Note::Charted {
        walls: walls.len(),
        cylinders,
        walls_m: walls.iter().map(length).sum(),
        open_m2: chart.open_m2(),
        unseen_m2: chart.unseen_m2(),
        surfaces: chart
            .surfaces
            .iter()
            .map(|(name, level)| format!("{name}: {:.2} m², {:.2} m high", level.area_m2, level.height_m))
            .collect(),
        moved_m: off.translation.vector.norm(),
        turned_rad: off.rotation.angle(),
    }
}
