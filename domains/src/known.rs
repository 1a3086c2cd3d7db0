//! World model, kept from round to round.

use std::collections::BTreeSet;
use std::sync::Arc;

use descry_memory::belief::{Belief, Track};
use descry_memory::space::Space;
use descry_perception::nalgebra::Isometry3;
use descry_perception::recognise::ObjectModel;
use descry_robots::Robot;

use crate::geometry::Geometry;
use crate::load::Domain;
use crate::own_map::OwnMap;
use crate::past::Past;
use crate::states::States;
use crate::surface::KnownSurface;
use crate::symbol::symbol;
use crate::viewpoint::Candidate;

/// Something that is looked for: a known object, or a kind of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Thing {
    /// Its PDDL symbol.
    pub symbol: String,
    /// The name by which percepts know it.
    pub name: String,
    /// The models that it may be.
    pub models: Vec<ObjectModel>,
    /// The surfaces that it is asked about; none: wherever it is.
    pub on: Option<Vec<usize>>,
    /// The number of the one object that is meant, where it is one that has been seen.
    pub track: Option<u64>,
}

impl Thing {
    /// The probability that an object is it, where it is asked about.
    pub fn probability(&self, track: &Track, surfaces: &[KnownSurface]) -> f64 {
        let meant = self.track.is_none_or(|id| id == track.id);
        let asked = self.on.as_ref().is_none_or(|on| on.iter().any(|&n| surfaces[n].symbol == track.on));
        if meant && asked { track.probability_of(&self.name) } else { 0.0 }
    }

    /// True if it may be on a surface, as far as it is asked about.
    pub fn may_be_on(&self, surface: usize) -> bool {
        self.track.is_none() && self.on.as_ref().is_none_or(|on| on.contains(&surface))
    }
}

/// A door, as far as it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownDoor {
    /// Its PDDL symbol.
    pub symbol: String,
    /// The door as the map has it.
    pub door: descry_robots::Door,
}

/// The object in the hand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Held {
    /// The number of the track that it was.
    pub track: u64,
}

/// World model at the beginning of a round.
#[derive(Clone)]
pub struct Known {
    /// The body, which is only asked.
    pub robot: Arc<dyn Robot>,
    /// Belief state about objects.
    pub belief: Arc<Belief>,
    /// Everything to stand things on.
    pub surfaces: Vec<KnownSurface>,
    /// Free, occupied and unobserved space around each surface.
    pub spaces: Vec<Arc<Space>>,
    /// Poses to look from.
    pub candidates: Vec<Candidate>,
    /// The one at which the body stands.
    pub at: usize,
    /// The one from which the last look was taken; in the beginning where the body stood.
    pub looked_from: usize,
    /// Since when the body stands where it does.
    pub stands_since_ns: i64,
    /// Localisation error there, as the last look from there shows it: `map_from_localised`. None before one.
    pub errs_by: Option<Isometry3<f64>>,
    /// Requested objects.
    pub things: Vec<Thing>,
    /// Kinds of which all members are requested.
    pub kinds: Vec<Thing>,
    /// The surfaces of which it is asked what stands there.
    pub asked: Vec<usize>,
    /// Confidence that is required, 0 to 1.
    pub threshold: f64,
    /// Seconds until the deadline, if there is one.
    pub time_left_s: Option<f64>,
    /// Looks that have been taken: candidate and surface.
    pub observed: BTreeSet<(usize, usize)>,
    /// Candidates that have been given up.
    pub out_of_reach: BTreeSet<usize>,
    /// Objects, by the number of their track, that a push from a candidate has failed to move.
    pub stuck: BTreeSet<(u64, usize)>,
    /// Pushes that may still be tried.
    pub pushes_left: usize,
    /// Doors that the map knows.
    pub doors: Vec<KnownDoor>,
    /// Those that are believed to be shut, by number.
    pub shut: BTreeSet<usize>,
    /// The object in the hand.
    pub held: Option<Held>,
    /// Persistent belief from earlier runs.
    pub past: Option<Past>,
    /// The map that the body has made itself.
    pub own_map: Arc<dyn OwnMap>,
    /// State of each ability.
    pub states: States,
    /// Prior weight of each thing, then each kind, then anything on each surface, relative to another
    /// surface.
    pub expected: Vec<Vec<f64>>,
    /// Geometry of the map, kept from round to round.
    pub geometry: Arc<Geometry>,
}

impl Known {
    /// The body has moved, until now: how localisation errs where it stands is to be seen.
    pub fn has_moved(&mut self) {
        (self.stands_since_ns, self.errs_by) = (self.robot.now_ns(), None);
    }
}

/// True if two known objects have one shape and size: only their names distinguish them.
pub(crate) fn is_alike(one: &ObjectModel, other: &ObjectModel) -> bool {
    let named = ObjectModel {
        name: one.name.clone(),
        kind: one.kind.clone(),
        phrases: one.phrases.clone(),
        ..other.clone()
    };
    named == *one
}

/// A thing that a goal asks for, from the models of the domain: one of the known objects, or a kind of them.
pub fn thing(domain: &Domain, wanted: &str) -> Thing {
    let single = domain.objects.iter().find(|o| symbol(&o.name) == wanted);
    let models: Vec<ObjectModel> = match single {
        Some(model) => vec![model.clone()],
        None => domain.objects.iter().filter(|o| symbol(&o.kind) == wanted).cloned().collect(),
    };
    let name = single.map(|m| m.name.clone()).or_else(|| models.first().map(|m| m.kind.clone()));
    Thing { symbol: wanted.into(), name: name.unwrap_or_default(), models, on: None, track: None }
}
