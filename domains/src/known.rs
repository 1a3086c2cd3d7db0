//! World model, kept from round to round.

use std::collections::BTreeSet;
use std::sync::Arc;

use descry_memory::belief::{Belief, Track};
use descry_memory::space::Space;
use descry_perception::nalgebra::Isometry3;
use descry_perception::recognise::ObjectModel;
use descry_perception::recognise::colour::coloured;
use descry_robots::Robot;

use crate::geometry::Geometry;
use crate::load::Domain;
use crate::own_map::OwnMap;
use crate::past::Past;
use crate::states::States;
use crate::surface::KnownSurface;
use crate::symbol::symbol;
use crate::viewpoint::Candidate;

/// Search target: a known object, or a kind of objects.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Thing {
    /// PDDL symbol.
    pub symbol: String,
    /// Name of the target in percepts.
    pub name: String,
    /// Models of the objects that may be the target.
    pub models: Vec<ObjectModel>,
    /// Colour of the target, where the goal asks for one; the name begins with it.
    pub colour: Option<&'static str>,
    /// Indices of the surfaces that the goal restricts the target to; `None`: anywhere.
    pub on: Option<Vec<usize>>,
    /// Identifier in the belief, if the target is one particular seen object.
    pub track: Option<u64>,
}

impl Thing {
    /// A seen object itself, whatever it is.
    pub fn seen(track: &Track) -> Self {
        let name = track.label().or_else(|| track.kind()).unwrap_or("unknown object").to_string();
        Self {
            symbol: format!("{}-{}", symbol(&name), track.id),
            name,
            track: Some(track.id),
            ..Self::default()
        }
    }

    /// Probability that a seen object is the target, wherever it stands.
    pub fn is(&self, track: &Track) -> f64 {
        match self.track {
            Some(id) if id != track.id => 0.0,
            Some(_) if self.models.is_empty() => 1.0,
            _ => track.probability_of(&self.name),
        }
    }

    /// Probability that a seen object is the target, within the requested places.
    pub fn probability(&self, track: &Track, surfaces: &[KnownSurface]) -> f64 {
        let asked = self.on.as_ref().is_none_or(|on| on.iter().any(|&n| surfaces[n].symbol == track.on));
        if asked { self.is(track) } else { 0.0 }
    }

    /// True if the target may be on a surface (index), given the requested places; false for a seen
    /// object.
    pub fn may_be_on(&self, surface: usize) -> bool {
        self.track.is_none() && self.on.as_ref().is_none_or(|on| on.contains(&surface))
    }
}

/// Door of the map, with its PDDL symbol.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownDoor {
    /// PDDL symbol.
    pub symbol: String,
    /// Door as the map has it.
    pub door: descry_robots::Door,
}

/// Object in the hand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Held {
    /// Identifier of the object in the belief.
    pub track: u64,
}

/// World model at the beginning of a round.
#[derive(Clone)]
pub struct Known {
    /// Body, which is asked for its state and for routes, but not moved here.
    pub robot: Arc<dyn Robot>,
    /// Belief state about objects.
    pub belief: Arc<Belief>,
    /// All supporting surfaces.
    pub surfaces: Vec<KnownSurface>,
    /// Free, occupied and unobserved space around each surface, by surface index.
    pub spaces: Vec<Arc<Space>>,
    /// Poses to look from.
    pub candidates: Vec<Candidate>,
    /// Index of the candidate at which the body stands.
    pub at: usize,
    /// Index of the candidate of the last view; initially that of the body.
    pub looked_from: usize,
    /// Time since which the body has been at its pose, nanoseconds.
    pub stands_since_ns: i64,
    /// Localisation error at the current pose, from the last view; `None` before a view there.
    pub errs_by: Option<Isometry3<f64>>,
    /// Requested objects.
    pub things: Vec<Thing>,
    /// Kinds of which all members are requested.
    pub kinds: Vec<Thing>,
    /// Indices of the surfaces whose objects are requested.
    pub asked: Vec<usize>,
    /// Confidence that is required, 0 to 1.
    pub threshold: f64,
    /// Time until the deadline, seconds, if there is one.
    pub time_left_s: Option<f64>,
    /// Views taken: candidate index and surface index of each.
    pub observed: BTreeSet<(usize, usize)>,
    /// Indices of the candidates given up as unreachable.
    pub out_of_reach: BTreeSet<usize>,
    /// Pushes that failed: identifier of the object, and index of the candidate.
    pub stuck: BTreeSet<(u64, usize)>,
    /// Number of pushes that may still be tried.
    pub pushes_left: usize,
    /// Doors that the map knows.
    pub doors: Vec<KnownDoor>,
    /// Indices of the doors believed shut.
    pub shut: BTreeSet<usize>,
    /// Object in the hand.
    pub held: Option<Held>,
    /// Persistent belief from earlier runs.
    pub past: Option<Past>,
    /// Map of the body's own making.
    pub own_map: Arc<dyn OwnMap>,
    /// State of each ability.
    pub states: States,
    /// Prior weight of each thing, then of each kind, on each surface (inner index), relative to other
    /// surfaces.
    pub expected: Vec<Vec<f64>>,
    /// Geometry of the map, cached from round to round.
    pub geometry: Arc<Geometry>,
}

impl Known {
    /// True if a seen object is taken for the thing: by identity if the thing is a seen object, else by
    /// probability.
    pub(crate) fn is_taken_for(&self, thing: &Thing, track: &Track) -> bool {
        match thing.track {
            Some(id) => id == track.id,
            None => track.probability_of(&thing.name) >= self.threshold,
        }
    }

    /// Seen objects that are none of the problem's things.
    pub(crate) fn strangers(&self) -> impl Iterator<Item = &Track> {
        let is_thing = |track: &Track| self.things.iter().any(|thing| self.is_taken_for(thing, track));
        self.belief.tracks.iter().filter(move |track| !is_thing(track))
    }

    /// Restarts the time at the pose and resets the localisation error, after the body has moved.
    pub fn has_moved(&mut self) {
        (self.stands_since_ns, self.errs_by) = (self.robot.now_ns(), None);
    }
}

/// True if two known objects have equal shape and size and may have the same colour: they differ in name
/// alone.
pub(crate) fn is_alike(one: &ObjectModel, other: &ObjectModel) -> bool {
    let named = ObjectModel {
        name: one.name.clone(),
        kind: one.kind.clone(),
        phrases: one.phrases.clone(),
        colours: one.colours.clone(),
        ..other.clone()
    };
    let is_any = one.colours.is_empty() || other.colours.is_empty();
    named == *one && (is_any || one.colours.iter().any(|colour| other.colours.contains(colour)))
}

/// Search target of a goal from the domain's models: a known object, or a kind of objects, either of any
/// colour or of a stated colour.
pub fn thing(domain: &Domain, wanted: &str) -> Thing {
    let plain = thing_of_any_colour(domain, wanted);
    match coloured(wanted).filter(|_| plain.models.is_empty()) {
        Some((colour, rest)) => {
            let plain = thing_of_any_colour(domain, rest);
            let name = format!("{colour} {}", plain.name);
            Thing { symbol: wanted.into(), name, colour: Some(colour), ..plain }
        }
        None => plain,
    }
}

fn thing_of_any_colour(domain: &Domain, wanted: &str) -> Thing {
    let single = domain.objects.iter().find(|o| symbol(&o.name) == wanted);
    let models: Vec<ObjectModel> = match single {
        Some(model) => vec![model.clone()],
        None => domain.objects.iter().filter(|o| symbol(&o.kind) == wanted).cloned().collect(),
    };
    let name = single.map(|m| m.name.clone()).or_else(|| models.first().map(|m| m.kind.clone()));
    Thing { symbol: wanted.into(), name: name.unwrap_or_default(), models, ..Thing::default() }
}
