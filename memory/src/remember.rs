//! Belief that is kept between runs: the last sighting of each object and its time. A later run starts from
//! it, discounted by age.

#[doc(hidden)]
pub mod joined;

use std::collections::BTreeMap;

use descry_perception::laser::KnownShape;
use descry_perception::mapping::{Level, Survey};
use descry_perception::nalgebra::{Isometry2, Point2};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::Meta;
use crate::belief::{Belief, Track};
use crate::document::Draft;
use crate::error::Error;
use crate::learned::{LearnedThing, Visited};
use crate::record::Record;

/// Kind of the document that holds what is kept between runs.
const KIND: &str = "remembered";
/// Half-life of the probability that an object is still at its last known place, seconds: a day.
pub const HALF_LIFE_S: f64 = 86_400.0;
/// Maximum number of vanished objects that are kept; the oldest are forgotten first.
pub const MOST_GONE: usize = 500;

/// Last sighting of an object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recollection {
    /// Time of the sighting, seconds since 1970.
    pub seen_unix_s: f64,
    /// Belief about the object at that time.
    pub track: Track,
}

/// Map that a body has built itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Surveyed {
    /// Voxel map, extended by later runs.
    pub survey: Survey,
    /// Poses of the body at the views, corrected by registering the views.
    pub stood: Vec<Isometry2<f64>>,
    /// Poses of the body at the same views as estimated by the body, in its own map.
    pub believed: Vec<Isometry2<f64>>,
    /// Horizontal support surfaces with their given names.
    pub surfaces: Vec<(String, Level)>,
    /// Straight segments along which the body has driven, in its own map, metres.
    #[serde(default)]
    pub driven: Vec<[Point2<f64>; 2]>,
    /// Places, in the body's own map, metres, where the body does not fit although the map shows free space.
    #[serde(default)]
    pub barred: Vec<Point2<f64>>,
}

/// Everything that earlier runs keep for later ones.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Remembered {
    /// Objects that were present when their surface was last viewed.
    pub present: Vec<Recollection>,
    /// Objects that had vanished when their place was viewed again, oldest first.
    pub gone: Vec<Recollection>,
    /// Symbols of the surfaces that were viewed; incomplete for older stores.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub looked_at: Vec<String>,
    /// Learned shapes, oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<KnownShape>,
    /// Map that the body built, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surveyed: Option<Surveyed>,
    /// Static structure of visited places.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub visited: Vec<Visited>,
    /// Learned objects, oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub things: Vec<LearnedThing>,
    /// Data that other abilities keep between runs, by ability name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub besides: BTreeMap<String, Value>,
}

impl Remembered {
    /// Data that an ability keeps between runs; `None` if it kept none, or kept it in another form.
    pub fn besides<T: DeserializeOwned>(&self, ability: &str) -> Option<T> {
        serde_json::from_value(self.besides.get(ability)?.clone()).ok()
    }

    /// Reads what earlier runs kept in a store; empty for a new store.
    ///
    /// # Errors
    /// [`Error`] if it cannot be read.
    pub fn recall(store: &Record) -> Result<Self, Error> {
        let Some(document) = store.newest(KIND)? else { return Ok(Self::default()) };
        serde_json::from_value(document.body).map_err(|e| Error::Input {
            what: format!("what is remembered there cannot be read: {e}"),
            mend: "name another store".into(),
        })
    }

    /// Writes what is kept between runs to a store; `now_unix_s` is the current time, seconds since 1970.
    ///
    /// # Errors
    /// [`Error`] if it cannot be written.
    pub fn keep(&self, store: &Record, now_unix_s: f64) -> Result<(), Error> {
        let body = serde_json::to_value(self).map_err(|e| Error::Input {
            what: format!("what is to be remembered cannot be written: {e}"),
            mend: "this is a fault of descry".into(),
        })?;
        let meta = Meta { body, ..Meta::default() };
        store.put(Draft { meta, ..Draft::new(KIND, (now_unix_s * 1e9) as i64) })?;
        store.sync()
    }

    /// Updates what is kept after a run: the run's belief about the surfaces that it viewed, and the earlier
    /// content for all others.
    pub fn after(self, belief: &Belief, looked_at: &[String], now_unix_s: f64) -> Self {
        let is_here = |r: &Recollection| looked_at.contains(&r.track.on);
        let (before, elsewhere): (Vec<_>, Vec<_>) = self.present.into_iter().partition(is_here);
        let still = |old: &Track| {
            belief.tracks.iter().any(|t| t.on == old.on && (t.position_m - old.position_m).norm() < SAME_M)
        };
        let mut gone = self.gone;
        gone.extend(before.into_iter().filter(|r| !still(&r.track)));
        gone.drain(..gone.len().saturating_sub(MOST_GONE));
        let now = belief.tracks.iter().filter(|t| looked_at.contains(&t.on));
        let seen = now.map(|track| Recollection { seen_unix_s: now_unix_s, track: track.clone() });
        let present = elsewhere.into_iter().chain(seen).collect();
        let mut all = self.looked_at;
        all.extend(looked_at.iter().cloned());
        all.sort_unstable();
        all.dedup();
        Self { present, gone, looked_at: all, ..self }
    }

    /// True if a surface was ever viewed, or an object was seen on it.
    pub fn has_looked_at(&self, surface: &str) -> bool {
        let mut seen = self.present.iter().chain(&self.gone);
        self.looked_at.iter().any(|s| s == surface) || seen.any(|r| r.track.on == surface)
    }

    /// Renames a learned object, also in the probabilities of all tracks.
    pub fn rename(&mut self, old: &str, new: &str) {
        self.call(|name| (name == old).then(|| new.to_owned()));
    }

    /// Renames all learned objects for which `other` gives a name.
    fn call(&mut self, other: impl Fn(&str) -> Option<String>) {
        let rename = |name: &mut String| {
            if let Some(new) = other(name) {
                *name = new;
            }
        };
        self.things.iter_mut().for_each(|thing| rename(&mut thing.name));
        for r in self.present.iter_mut().chain(&mut self.gone) {
            let track = &mut r.track;
            track.probabilities.iter_mut().chain(&mut track.kinds).for_each(|(name, _)| rename(name));
        }
    }

    /// Tracks of the present objects, discounted by age: probabilities decay and stay at or below `most`, so
    /// nothing is certain without a new view.
    pub fn aged(&self, now_unix_s: f64, most: f64) -> Vec<Track> {
        let aged = |r: &Recollection| {
            let worn = 0.5_f64.powf((now_unix_s - r.seen_unix_s).max(0.0) / HALF_LIFE_S);
            let wear = |list: &[(String, f64)]| {
                list.iter().map(|(name, p)| (name.clone(), (p * worn).min(most))).collect::<Vec<_>>()
            };
            let probabilities = wear(&r.track.probabilities);
            let known: f64 = probabilities.iter().map(|(_, p)| p).sum();
            Track {
                kinds: wear(&r.track.kinds),
                unknown: (1.0 - known).max(0.0),
                probabilities,
                viewpoints_m: Vec::new(),
                seen_fraction: 0.0,
                cites: Vec::new(),
                ..r.track.clone()
            }
        };
        self.present.iter().map(aged).collect()
    }

    /// Last sighting of a known object or a kind by name; true if the object was present at the last view of
    /// its place, false if it had vanished. `None` if never seen.
    pub fn last_seen(&self, name: &str) -> Option<(&Recollection, bool)> {
        let is = |r: &&Recollection| r.track.probability_of(name) > 0.5;
        let newest = |list: &'_ [Recollection]| -> Option<usize> {
            (0..list.len())
                .filter(|&n| is(&&list[n]))
                .max_by(|&a, &b| list[a].seen_unix_s.total_cmp(&list[b].seen_unix_s))
        };
        let there = newest(&self.present).map(|n| (&self.present[n], true));
        there.or_else(|| newest(&self.gone).map(|n| (&self.gone[n], false)))
    }
}

/// Maximum distance between an old and a new position that count as the same object, metres.
pub const SAME_M: f64 = 0.10;
