//! Contents of vessels as far as they are known, in this run and from run to run.

use descry_memory::belief::{Belief, Track};
use descry_memory::remember::{HALF_LIFE_S, Remembered, SAME_M};
use descry_perception::nalgebra::Point3;
use descry_perception::recognise::{ObjectModel, Shape, Top};
use serde::{Deserialize, Serialize};

use crate::known::{Known, Thing};
use crate::mind::Mind;
use crate::past::Past;
use crate::situation::Situation;
use crate::states::{States, state};

/// Key of the ability's memory.
const KEPT: &str = "pouring";

/// Range of a volume, litres; without an upper end if nothing bounds it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Litres {
    /// Minimum.
    pub least: f64,
    /// Maximum, if there is one.
    pub most: Option<f64>,
}

impl Litres {
    /// Known volume.
    pub const fn exactly(litres: f64) -> Self {
        Self { least: litres, most: Some(litres) }
    }

    /// Volume after adding a known one.
    pub fn with(self, more: f64) -> Self {
        Self { least: self.least + more, most: self.most.map(|most| most + more) }
    }
}

/// Content of one vessel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Content {
    /// Name of the vessel.
    name: String,
    litres: Litres,
    /// Beginning of the run that poured, seconds since 1970.
    since_unix_s: f64,
    /// Place where the vessel was left, map frame; `None` if it stood on no surface.
    at_m: Option<Point3<f64>>,
    /// Identifier of the vessel in the belief of this run.
    #[serde(skip)]
    track: Option<u64>,
}

/// Contents of vessels; those of all others are unknown.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Contents(Vec<Content>);

state!(Contents);

impl Contents {
    /// Contents that earlier runs left.
    pub fn recall(past: Option<&Past>, states: &mut States) {
        if let Some(kept) = past.and_then(|past| past.remembered.besides(KEPT)) {
            *states.get_mut::<Contents>() = kept;
        }
    }

    /// Assigns the contents that earlier runs left to the objects remembered at their places.
    pub fn assign(mind: &mut Mind) {
        let Known { belief, states, .. } = &mut mind.known;
        for content in &mut states.get_mut::<Contents>().0 {
            let is_it = |t: &&Track| {
                let is_there = |at: Point3<f64>| (t.position_m - at).norm() < SAME_M;
                content.at_m.is_some_and(is_there) && t.probability_of(&content.name) > 0.0
            };
            content.track = belief.tracks.iter().find(is_it).map(|t| t.id);
        }
    }

    /// Adds the contents to the persistent belief, each with the place of its vessel.
    pub fn keep(known: &Known, _: &Past, later: &mut Remembered) {
        let Contents(mut kept) = known.states.get::<Contents>().clone();
        for content in kept.iter_mut().filter(|content| content.track.is_some()) {
            content.at_m = place(&known.belief, content.track);
        }
        if let Ok(kept) = serde_json::to_value(Contents(kept)) {
            later.besides.insert(KEPT.into(), kept);
        }
    }

    /// Content of a thing; unknown if it is not the vessel of that name alone, if the vessel is not where it was
    /// left, or if so much time has passed that somebody may have used it.
    pub fn of(s: &Situation, thing: &Thing) -> Litres {
        let tracks = || s.belief.tracks.iter();
        let is_it = |content: &&Content| match thing.track {
            Some(id) => content.track == Some(id),
            None => content.name == thing.name,
        };
        let is_there = |content: &Content| {
            let mut taken = tracks().filter(|t| s.is_taken_for(thing, t));
            taken.all(|t| content.track == Some(t.id)) && tracks().any(|t| content.track == Some(t.id))
        };
        let now_unix_s = s.past.as_ref().map_or(0.0, |past| past.now_unix_s);
        let untouched = |content: &Content| 0.5_f64.powf((now_unix_s - content.since_unix_s) / HALF_LIFE_S);
        let mut all = s.states.get::<Contents>().0.iter().filter(is_it);
        let only = all.next().filter(|content| all.next().is_none() && is_there(content));
        let only = only.filter(|content| untouched(content) >= s.threshold);
        only.map_or_else(Litres::default, |content| content.litres)
    }

    /// Sets the content of a vessel.
    pub fn set(mind: &mut Mind, track: &Track, name: &str, litres: Litres) {
        let since_unix_s = mind.known.past.as_ref().map_or(0.0, |past| past.now_unix_s);
        let (name, track, at_m) = (name.to_string(), Some(track.id), None);
        let all = &mut mind.known.states.get_mut::<Contents>().0;
        all.retain(|c| c.track != track && (c.name != name || c.track.is_some()));
        if litres != Litres::default() {
            all.push(Content { name, litres, since_unix_s, at_m, track });
        }
    }
}

/// Place of an object that stands on a surface.
fn place(belief: &Belief, track: Option<u64>) -> Option<Point3<f64>> {
    let track = belief.tracks.iter().find(|t| Some(t.id) == track)?;
    (!track.on.is_empty()).then_some(track.position_m)
}

/// Greatest volume that a thing may hold by the outer measures of its models, litres; `None` if they bound
/// nothing.
pub fn capacity_l(thing: &Thing) -> Option<f64> {
    let all: Option<Vec<f64>> = thing.models.iter().map(outer_l).collect();
    all?.into_iter().reduce(f64::max)
}

/// Volume within the outer measures of an object, litres; 0 for one that is closed at the top.
fn outer_l(model: &ObjectModel) -> Option<f64> {
    let area_m2 = match (model.top, model.shape) {
        (Top::Closed, _) => 0.0,
        (_, Shape::Box) => model.width_m?.high * model.depth_m?.high,
        (_, Shape::Round) => {
            // The narrower end as a share of the wider one, for which a frustum is largest.
            let share = 1.0_f64.clamp(model.taper.low, model.taper.high);
            let share = share.min(1.0 / share);
            let radius_m = 0.5 * model.diameter_m?.high;
            std::f64::consts::PI * radius_m * radius_m * (1.0 + share + share * share) / 3.0
        }
    };
    Some(1e3 * area_m2 * model.height_m.high)
}
