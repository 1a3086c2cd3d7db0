//! Persistent belief between runs: the last sighting of each thing and its time. A later run begins
//! with it, as far as age allows.

#[doc(hidden)]
pub mod joined;

use descry_perception::laser::KnownShape;
use descry_perception::mapping::{Level, Survey};
use descry_perception::nalgebra::{Isometry2, Point2};
use serde::{Deserialize, Serialize};

use crate::Meta;
use crate::belief::{Belief, Track};
use crate::document::Draft;
use crate::error::Error;
use crate::learned::{LearnedThing, Visited};
use crate::record::Record;

/// The kind under which it is kept.
const KIND: &str = "remembered";
/// Time in which the probability that a thing still stands where it was seen falls by a half, seconds: a day.
pub const HALF_LIFE_S: f64 = 86_400.0;
/// So many things that are gone are remembered; the oldest are forgotten.
pub const MOST_GONE: usize = 500;

/// An object as it was seen last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recollection {
    /// When, seconds since 1970.
    pub seen_unix_s: f64,
    /// Belief about it at that time.
    pub track: Track,
}

/// The map that a body has made itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Surveyed {
    /// All that was seen, by cubes: what a later run adds to.
    pub survey: Survey,
    /// Viewpoints, by the content of the views.
    pub stood: Vec<Isometry2<f64>>,
    /// Stated poses of the body, in its own map.
    pub believed: Vec<Isometry2<f64>>,
    /// Level surfaces to put things on, by the names that they were given.
    pub surfaces: Vec<(String, Level)>,
    /// Straight lines that it has driven, and places where it does not fit though the map shows nothing there: in its own map.
    #[serde(default)]
    pub driven: Vec<[Point2<f64>; 2]>,
    /// See above.
    #[serde(default)]
    pub barred: Vec<Point2<f64>>,
}

/// Memory of all earlier runs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Remembered {
    /// Things as of the last look at their surface.
    pub present: Vec<Recollection>,
    /// Things that had vanished when their place was looked at again, the oldest first.
    pub gone: Vec<Recollection>,
    /// Surfaces that were looked at; of an older store, those since it is kept.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub looked_at: Vec<String>,
    /// Shapes that were learned, the oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<KnownShape>,
    /// The map, if one was made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surveyed: Option<Surveyed>,
    /// Static structure of visited places.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub visited: Vec<Visited>,
    /// Things that were learned, the oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub things: Vec<LearnedThing>,
}

impl Remembered {
    /// Memory that a store holds; empty for a new store.
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

    /// Keeps it in a store.
    ///
    /// # Errors
    /// [`Error`] if it cannot be kept.
    pub fn keep(&self, store: &Record, now_unix_s: f64) -> Result<(), Error> {
        let body = serde_json::to_value(self).map_err(|e| Error::Input {
            what: format!("what is to be remembered cannot be written: {e}"),
            mend: "this is a fault of descry".into(),
        })?;
        let meta = Meta { body, ..Meta::default() };
        store.put(Draft { meta, ..Draft::new(KIND, (now_unix_s * 1e9) as i64) })?;
        store.sync()
    }

    /// Memory after a run: its belief about the surfaces that it looked at, the earlier memory of
    /// all others.
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

    /// True if a surface was looked at: it is kept, or something was seen there.
    pub fn has_looked_at(&self, surface: &str) -> bool {
        let mut seen = self.present.iter().chain(&self.gone);
        self.looked_at.iter().any(|s| s == surface) || seen.any(|r| r.track.on == surface)
    }

    /// Gives a thing that was learned another name, wherever it was seen.
    pub fn rename(&mut self, old: &str, new: &str) {
        self.call(|name| (name == old).then(|| new.to_owned()));
    }

    /// Gives things other names, those that there are for them.
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

    /// Present belief about it: probabilities decay with time and stay below `most`, so nothing is
    /// certain without a new look.
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

    /// Last sighting of a name, and whether the thing was still there at the next look; none if
    /// never seen.
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

/// An object nearer than this to where one was is that one, metres.
pub const SAME_M: f64 = 0.10;
