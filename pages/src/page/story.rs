//! Content of a run's page, gathered from its record.

use std::collections::BTreeMap;
use std::sync::Arc;

use descry_memory::belief::Belief;
use descry_memory::{Document, Query, Record};
use descry_perception::nalgebra::{Isometry3, Point3};
use descry_planner::Step;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::points::{self, Near, Packed};
use descry_agent::body::tape;
use descry_agent::exit::CommandError;
use descry_agent::report::{Event, Report};
use descry_agent::run::Beginning;
use descry_agent::written::call_of;
use descry_domains::saying::Saying;
use descry_explain::wording::capital;

/// Margin of a surface's dense box around the outline, metres.
const BESIDE_M: f64 = 0.15;
/// Margin of the box below the surface, metres.
const BELOW_M: f64 = 0.05;
/// Margin of the box above the surface, metres.
const ABOVE_M: f64 = 0.6;

/// Content of a run's page. Times are seconds since the run began, on the body's clock; positions are in the
/// map frame, metres.
#[derive(Debug, Serialize)]
pub struct Story {
    /// Goal in the user's words.
    pub goal: String,
    pddl: String,
    /// Goal in the domain's wording; `None` if that is the PDDL text.
    wanted: Option<String>,
    report: Option<Report>,
    begun_unix_s: Option<u64>,
    ends_s: f64,
    map: Map,
    /// Radius of the body, metres.
    body_radius_m: f64,
    moments: Vec<Moment>,
    plans: Vec<Planned>,
    deeds: Vec<Deed>,
    looks: Vec<Look>,
    stands: Vec<Stand>,
    beliefs: Vec<Believed>,
    known: Vec<Known>,
    /// Numbers in the goal, each with its values over time.
    sought: Vec<Sought>,
    lost: Vec<String>,
}

/// Parts of the body's description that the page draws.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Map {
    description: Value,
    surfaces: Vec<Area>,
    rooms: Vec<Area>,
    doors: Vec<Value>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Area {
    name: String,
    outline_m: Vec<[f64; 2]>,
    #[serde(default)]
    height_m: f64,
}

/// Message of the narration.
#[derive(Debug, Serialize)]
struct Moment {
    at_s: f64,
    /// Kind: `goal`, `plan`, `keep`, `do`, `failed` or `see`.
    what: &'static str,
    /// Heading; empty if the message continues the previous one.
    head: String,
    text: String,
}

/// Plan, with the time and the reason of its making.
#[derive(Debug, Serialize)]
struct Planned {
    at_s: f64,
    round: usize,
    because: String,
    steps: Vec<PlanStep>,
}

/// Step of a plan.
#[derive(Debug, Serialize)]
struct PlanStep {
    /// Action with its arguments, in PDDL.
    call: String,
    /// Action in the domain's wording.
    said: String,
    from_s: f64,
    lasts_s: f64,
}

/// Step that was executed or attempted.
#[derive(Debug, Serialize)]
struct Deed {
    call: String,
    /// Arguments of the action.
    arguments: Vec<String>,
    from_s: f64,
    to_s: f64,
    failed: Option<String>,
}

/// Observation: camera pose and measured points.
#[derive(Debug, Clone, Serialize)]
struct Look {
    /// Key of the observation; changes with the camera pose.
    key: String,
    at_s: f64,
    eye_m: [f64; 3],
    /// Corners of the image at a depth of two metres, map frame, metres; empty if the camera is unknown.
    corners_m: Vec<[f64; 3]>,
    on: Value,
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<Arc<Packed>>,
}

/// Observations of a run by key, kept from one story to the next.
#[derive(Debug, Default)]
pub struct Looks(BTreeMap<String, Look>);

impl Looks {
    /// Points of an observation, by its key; `None` if the key is unknown.
    pub fn points(&self, key: &str) -> Option<Arc<Packed>> {
        self.0.get(key)?.points.clone()
    }
}

/// Pose of the body at a time.
#[derive(Debug, Serialize)]
struct Stand {
    at_s: f64,
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
}

/// Belief after an observation.
#[derive(Debug, Serialize)]
struct Believed {
    at_s: f64,
    objects: Vec<Object>,
    /// Highest probability of each known object among all believed objects.
    best: BTreeMap<String, f64>,
}

/// Knowledge after an observation, as text: certainty, reasons for doubt, and unseen places.
#[derive(Debug, Serialize)]
struct Known {
    at_s: f64,
    text: String,
}

/// Number in the goal, with its values over time.
#[derive(Debug, Serialize)]
struct Sought {
    name: String,
    wanted: f64,
    /// Pairs of a time, seconds since the run began, and the value from then on.
    values: Vec<(f64, f64)>,
}

#[derive(Debug, Serialize)]
struct Object {
    name: Option<String>,
    probability: f64,
    position_m: [f64; 3],
    size_m: [f64; 3],
    footprint_m: Vec<[f64; 3]>,
}

/// Gathers the content of a run's page; `looks`: the observations of an earlier call, updated.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn of(record: &Record, report: Option<&Report>, looks: &mut Looks) -> Result<Story, CommandError> {
    let mut all = All { record, lost: Vec::new(), first_ns: None };
    let events = all.find("event")?;
    let heads = all.find("run")?;
    let map: Map = all.find("body")?.first().and_then(|d| part(&d.body)).unwrap_or_default();
    let beliefs = all
        .find("belief")?
        .iter()
        .filter_map(|d| Some(believed(all.s(d.stamp_ns), &part(&d.body)?)))
        .collect();
    let saying =
        Beginning::of(record).ok().flatten().map(|b| descry_explain::saying_of(&b)).unwrap_or_default();
    let said = |name: &str| heads.first().and_then(|d| d.body[name].as_str()).unwrap_or_default().to_owned();
    let pddl = said("pddl_goal");
    let (moments, plans) = told(&all, &events, &saying);
    let deeds = deeds(&all, &events);
    let known = descry_explain::after_looks(record, &pddl, &saying)?.into_iter();
    let known = known.map(|(stamp_ns, text)| Known { at_s: all.s(stamp_ns), text: capital(&text) }).collect();
    let in_time =
        |values: Vec<(i64, f64)>| values.into_iter().map(|(ns, value)| (all.s(ns), value)).collect();
    let sought = descry_explain::sought(record, &pddl, &saying)?.into_iter();
    let sought =
        sought.map(|s| Sought { name: s.name, wanted: s.wanted, values: in_time(s.values) }).collect();
    let body = tape::known(record).ok().flatten();
    let clouds = all.find("cloud")?;
    looks.tell(&mut all, &clouds, &map)?;
    let stands = stands(&all, &map, &clouds);
    let end_ns = events.iter().chain(&clouds).map(|d| d.stamp_ns).max().unwrap_or(0);
    Ok(Story {
        goal: said("goal"),
        wanted: Some(saying.say(&pddl)).filter(|wanted| *wanted != pddl),
        pddl,
        report: report.cloned(),
        begun_unix_s: heads.first().and_then(|d| d.body["started_unix_s"].as_u64()),
        ends_s: all.s(end_ns),
        map,
        body_radius_m: body.map_or(0.0, |known| known.description.radius_m()),
        moments,
        plans,
        deeds,
        looks: looks.in_time(),
        stands,
        beliefs,
        known,
        sought,
        lost: all.lost,
    })
}

impl Story {
    /// Story for readers that fetch the points of each observation separately. While the run has no report yet,
    /// unreadable parts of the record are not mentioned.
    pub fn under_way(mut self) -> Self {
        self.looks.iter_mut().for_each(|look| look.points = None);
        if self.report.is_none() {
            self.lost.clear();
        }
        self
    }
}

/// Record of the run, descriptions of its unreadable parts, and the stamp of the first document read.
struct All<'a> {
    record: &'a Record,
    lost: Vec<String>,
    first_ns: Option<i64>,
}

impl All<'_> {
    fn find(&mut self, kind: &str) -> Result<Vec<Document>, CommandError> {
        let (documents, faults) =
            self.record.find_whole(&Query::of_kind(kind)).map_err(CommandError::broken)?;
        self.lost.extend(faults.iter().map(ToString::to_string));
        if self.first_ns.is_none() {
            self.first_ns = documents.first().map(|d| d.stamp_ns);
        }
        Ok(documents)
    }

    fn s(&self, stamp_ns: i64) -> f64 {
        (stamp_ns - self.first_ns.unwrap_or(0)) as f64 * 1e-9
    }
}

fn part<T: serde::de::DeserializeOwned>(body: &Value) -> Option<T> {
    serde_json::from_value(body.clone()).ok()
}

fn told(all: &All<'_>, events: &[Document], saying: &Saying) -> (Vec<Moment>, Vec<Planned>) {
    let mut moments = Vec::new();
    let mut plans = Vec::new();
    for document in events {
        let at_s = all.s(document.stamp_ns);
        let Some(event) = part::<Event>(&document.body) else { continue };
        let (head, text) = event.parts(saying);
        let what = match event {
            Event::Goal { .. } => "goal",
            Event::Planned { round, because, reason, steps, .. } => {
                let because = reason.map_or(because, |reason| reason.told(saying));
                let steps = steps.iter().map(|step| planned(step, at_s, saying)).collect();
                plans.push(Planned { at_s, round, because, steps });
                "plan"
            }
            Event::Kept { .. } => "keep",
            Event::Acting { .. } | Event::Acted { .. } => "do",
            Event::Failed { .. } => "failed",
            Event::Noted(_) => "see",
        };
        moments.push(Moment { at_s, what, head, text });
    }
    (moments, plans)
}

/// Converts a step of a plan made at `at_s`, seconds since the run began.
fn planned(step: &Step, at_s: f64, saying: &Saying) -> PlanStep {
    let call = call_of(step).to_string();
    let said = saying.say(&call);
    PlanStep { call, said, from_s: at_s + step.start_s.unwrap_or(0.0), lasts_s: step.duration_s }
}

/// Steps that were begun, each with its end and, if it failed, the reason. A step ends with the next plan or step.
fn deeds(all: &All<'_>, events: &[Document]) -> Vec<Deed> {
    let events: Vec<(f64, Event)> =
        events.iter().filter_map(|d| Some((all.s(d.stamp_ns), part(&d.body)?))).collect();
    let mut deeds = Vec::new();
    for (n, (from_s, event)) in events.iter().enumerate() {
        let Event::Acting { call, .. } = event else { continue };
        let later = &events[n + 1..];
        let is_other = |event: &Event| {
            matches!(event, Event::Planned { .. } | Event::Kept { .. } | Event::Acting { .. })
        };
        let until = later.iter().position(|(_, event)| is_other(event)).unwrap_or(later.len());
        let failed = later[..until].iter().find_map(|(_, event)| match event {
            Event::Failed { call: of, because, .. } if of == call => Some(because.clone()),
            _ => None,
        });
        let to_s = later[..until].iter().chain(later.get(until)).map(|(s, _)| *s).fold(*from_s, f64::max);
        deeds.push(Deed {
            call: call.to_string(),
            arguments: call.arguments.clone(),
            from_s: *from_s,
            to_s,
            failed,
        });
    }
    deeds
}

/// Camera pose of each observation in the last merge that used it, by the record ID of its cloud.
fn placed(all: &mut All<'_>) -> Result<BTreeMap<u64, Isometry3<f64>>, CommandError> {
    let mut placed = BTreeMap::new();
    for document in all.find("percepts")? {
        let views: Vec<u64> = part(&document.body["views"]).unwrap_or_default();
        let fits = document.body["fits"].as_array().cloned().unwrap_or_default();
        let used = views.iter().zip(&fits).filter(|(_, fit)| fit["used"] == true);
        placed.extend(used.filter_map(|(view, fit)| Some((*view, part(&fit["world_from_camera"])?))));
    }
    Ok(placed)
}

impl Looks {
    /// Updates the observations from the record's clouds; those with an unchanged pose are kept.
    fn tell(&mut self, all: &mut All<'_>, clouds: &[Document], map: &Map) -> Result<(), CommandError> {
        let placed = placed(all)?;
        let frame = map.description["frames"]["map"].as_str().unwrap_or("map").to_owned();
        let near: Vec<Near> = map.surfaces.iter().map(near).collect();
        let most = points::most(clouds.len());
        let mut told = BTreeMap::new();
        for document in clouds {
            let pose = all.record.pose_of(document, &frame);
            let placed = placed.get(&document.id.0).copied().map_or(pose, Ok);
            let look = placed.and_then(|map_from_camera| {
                let key = key(document, &map_from_camera);
                match self.0.remove(&key) {
                    Some(look) => Ok(look),
                    None => look(all, document, (key, map_from_camera), &near, most),
                }
            });
            match look {
                Ok(look) => drop(told.insert(look.key.clone(), look)),
                Err(e) => all.lost.push(e.to_string()),
            }
        }
        self.0 = told;
        Ok(())
    }

    fn in_time(&self) -> Vec<Look> {
        let mut looks: Vec<Look> = self.0.values().cloned().collect();
        looks.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        looks
    }
}

/// Key of an observation, from its cloud and its camera pose.
fn key(document: &Document, map_from_camera: &Isometry3<f64>) -> String {
    let numbers = map_from_camera.to_homogeneous();
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    format!("{}-{:08x}", document.id, crc32fast::hash(&bytes))
}

fn look(
    all: &All<'_>,
    document: &Document,
    (key, map_from_camera): (String, Isometry3<f64>),
    near: &[Near],
    most: usize,
) -> Result<Look, descry_memory::Error> {
    let (cloud, sensing) = all.record.cloud(document)?;
    let corners = sensing.intrinsics.map(|i| {
        let (w, h) = (i.width as f64, i.height as f64);
        let far = |u: f64, v: f64| Point3::new((u - i.cx) / i.fx * 2.0, (v - i.cy) / i.fy * 2.0, 2.0);
        [far(0.0, 0.0), far(w, 0.0), far(w, h), far(0.0, h)]
            .map(|p| (map_from_camera * p).coords.into())
            .to_vec()
    });
    Ok(Look {
        key,
        at_s: all.s(document.stamp_ns),
        eye_m: map_from_camera.translation.vector.into(),
        corners_m: corners.unwrap_or_default(),
        on: document.body["on"].clone(),
        points: Some(Arc::new(points::pack(&cloud, &map_from_camera, near, most))),
    })
}

/// Dense box of a surface.
fn near(surface: &Area) -> Near {
    let side = |axis: usize, of: fn(f64, f64) -> f64, from: f64| {
        surface.outline_m.iter().map(|p| p[axis]).fold(from, of)
    };
    let least = |axis| side(axis, f64::min, f64::INFINITY) - BESIDE_M;
    let greatest = |axis| side(axis, f64::max, f64::NEG_INFINITY) + BESIDE_M;
    Near {
        min_m: Point3::new(least(0), least(1), surface.height_m - BELOW_M),
        max_m: Point3::new(greatest(0), greatest(1), surface.height_m + ABOVE_M),
    }
}

/// Pose of the body at each observation.
fn stands(all: &All<'_>, map: &Map, clouds: &[Document]) -> Vec<Stand> {
    let frames = &map.description["frames"];
    let [world, base] = ["map", "base"].map(|name| frames[name].as_str().unwrap_or(name).to_owned());
    let at = |document: &Document| {
        let map_from_base = all.record.transform(&world, &base, document.stamp_ns).ok()?;
        let (p, yaw_rad) = (map_from_base.translation.vector, map_from_base.rotation.euler_angles().2);
        Some(Stand { at_s: all.s(document.stamp_ns), x_m: p.x, y_m: p.y, yaw_rad })
    };
    clouds.iter().filter_map(at).collect()
}

fn believed(at_s: f64, belief: &Belief) -> Believed {
    let mut best: BTreeMap<String, f64> = BTreeMap::new();
    for (name, p) in belief.tracks.iter().flat_map(|track| &track.probabilities) {
        let known = best.entry(name.clone()).or_default();
        *known = known.max(*p);
    }
    let object = |track: &descry_memory::belief::Track| Object {
        name: track
            .label()
            .map(str::to_owned)
            .or_else(|| kind_of(track).map(|(kind, _)| format!("a {kind}"))),
        probability: match (track.label(), kind_of(track)) {
            (Some(label), _) => track.probability_of(label),
            (None, Some((_, probability))) => probability,
            (None, None) => track.unknown,
        },
        position_m: track.position_m.coords.into(),
        size_m: track.size_m,
        footprint_m: track.footprint_m.iter().map(|p| p.coords.into()).collect(),
    };
    Believed { at_s, objects: belief.tracks.iter().map(object).collect(), best }
}

/// Most probable kind of a believed object, with its probability; `None` if unknown is more probable.
fn kind_of(track: &descry_memory::belief::Track) -> Option<(&str, f64)> {
    let kind = track.kind()?;
    let (_, probability) = track.kinds.iter().find(|(name, _)| name == kind)?;
    Some((kind, *probability))
}
