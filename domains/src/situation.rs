//! Everything that the symbols of a planning round are grounded in: the body, the belief, and where one could look from.

mod sight;
mod surface;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use descry_memory::belief::{Belief, Track};
use descry_memory::remember::Remembered;
use descry_memory::space::Space;
use descry_perception::nalgebra::{Isometry3, Point3};
use descry_perception::recognise::ObjectModel;
use descry_planner::{Call, CallError, FactValue};
use descry_robots::{Place, Robot};
use serde::{Deserialize, Serialize};

use crate::abilities::learning::news::News;
use crate::abilities::searching::adrift;
use crate::abilities::searching::doubt::{self, Doubt, Hypothesis, Taken};
use crate::abilities::searching::obstacle::{self, Obstacle};
use crate::abilities::searching::reasons;
use crate::abilities::shapes::floor::Floor;
use crate::abilities::surveying::chart::Chart;
use crate::config::Thresholds;
use crate::geometry::Geometry;
use crate::lexicon::symbol;
use crate::load::Domain;
pub use surface::KnownSurface;

/// Somewhere to stand and look from.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its PDDL symbol.
    pub symbol: String,
    /// Its pose or station.
    pub place: Place,
}

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

/// Persistent belief from earlier runs, and the time at which this run began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Past {
    /// Objects as they were seen last.
    pub remembered: Arc<Remembered>,
    /// Seconds since 1970.
    pub now_unix_s: f64,
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
    /// Objects on the floor that the laser has found.
    pub floor: Arc<Floor>,
    /// The map that the body has made itself.
    pub chart: Arc<Chart>,
    /// Novel objects and learned things.
    pub news: Arc<News>,
    /// Prior weight of each thing, then each kind, then anything on each surface, relative to another
    /// surface.
    pub expected: Vec<Vec<f64>>,
    /// Geometry of the map, kept from round to round.
    pub geometry: Arc<Geometry>,
}

/// Snapshot of the world model that grounds the symbols of one planning round: all that is [`Known`], and
/// values derived from it. Nothing in it moves anything.
pub struct Situation {
    known: Known,
    /// Thresholds of confidence.
    pub thresholds: Thresholds,
    derived: Derived,
}

/// A candidate to drive from, and the doors that are shut then.
type Departure = (usize, Vec<usize>);

/// Values that are computed on demand and kept.
#[derive(Default)]
struct Derived {
    /// Candidates by their symbols.
    candidates: OnceLock<HashMap<String, usize>>,
    travel_s: Vec<OnceLock<Vec<f64>>>,
    /// Candidates that the plans of the round are made with, once they are chosen, in order.
    focused: OnceLock<Vec<usize>>,
    /// Travel to these alone.
    travel_to_focused_s: Vec<OnceLock<Vec<f64>>>,
    travel_past_s: Mutex<BTreeMap<Departure, Arc<Vec<f64>>>>,
    /// Objects by surface, by their index.
    standing: OnceLock<Vec<Vec<usize>>>,
    about: Vec<OnceLock<Doubt>>,
    on: Vec<OnceLock<Doubt>>,
    of: Vec<OnceLock<Doubt>>,
    about_on: Vec<OnceLock<Doubt>>,
    going_there_s: Vec<OnceLock<f64>>,
    unseen_ends: Vec<OnceLock<Vec<Hypothesis>>>,
    obstacles: OnceLock<Vec<Obstacle>>,
}

impl std::ops::Deref for Situation {
    type Target = Known;

    fn deref(&self) -> &Known {
        &self.known
    }
}

impl Known {
    /// The body has moved, until now: how localisation errs where it stands is to be seen.
    pub fn has_moved(&mut self) {
        (self.stands_since_ns, self.errs_by) = (self.robot.now_ns(), None);
    }
}

impl Situation {
    /// Grounds a round in what is known.
    pub fn new(mut known: Known, thresholds: Thresholds) -> Self {
        known.geometry = Arc::new(known.geometry.renewed(&known));
        fn cells<T>(n: usize) -> Vec<OnceLock<T>> {
            (0..n).map(|_| OnceLock::new()).collect()
        }
        let derived = Derived {
            candidates: OnceLock::new(),
            travel_s: cells(known.candidates.len()),
            focused: OnceLock::new(),
            travel_to_focused_s: cells(known.candidates.len()),
            travel_past_s: Mutex::default(),
            standing: OnceLock::new(),
            about: cells(known.things.len()),
            on: cells(known.surfaces.len()),
            of: cells(known.kinds.len()),
            about_on: cells(known.things.len() * known.surfaces.len()),
            going_there_s: cells(known.surfaces.len()),
            unseen_ends: cells(known.surfaces.len()),
            obstacles: OnceLock::new(),
        };
        Self { known, thresholds, derived }
    }

    /// The candidate of a symbol.
    ///
    /// # Errors
    /// [`CallError::Failed`] if there is none.
    pub fn candidate(&self, name: &str) -> Result<usize, CallError> {
        let symbols = self.derived.candidates.get_or_init(|| {
            // Of two of one name the first is meant.
            self.candidates.iter().enumerate().rev().map(|(n, c)| (c.symbol.clone(), n)).collect()
        });
        let found = symbols.get(name).copied();
        found.ok_or_else(|| CallError::Failed(format!("`{name}` is not a pose to look from")))
    }

    /// The surface of a symbol.
    ///
    /// # Errors
    /// [`CallError::Failed`] if there is none.
    pub fn surface(&self, name: &str) -> Result<usize, CallError> {
        find(self.surfaces.iter().map(|s| &s.symbol), name, "a surface")
    }

    /// The thing of a symbol.
    ///
    /// # Errors
    /// [`CallError::Failed`] if there is none.
    pub fn thing(&self, name: &str) -> Result<usize, CallError> {
        find(self.things.iter().map(|t| &t.symbol), name, "something that is looked for")
    }

    /// The door of a symbol.
    ///
    /// # Errors
    /// [`CallError::Failed`] if there is none.
    pub fn door(&self, name: &str) -> Result<usize, CallError> {
        find(self.doors.iter().map(|d| &d.symbol), name, "a door")
    }

    /// Seconds that a drive takes on the map, past the doors that are believed to be shut; infinite where no route leads.
    pub fn travel_s(&self, from: usize, to: usize) -> f64 {
        let whole = &self.derived.travel_s[from];
        let focused = self.derived.focused.get().filter(|_| whole.get().is_none());
        if let Some((focused, at)) = focused.and_then(|all| Some((all, all.binary_search(&to).ok()?))) {
            let row = || self.travel_row(from, focused.iter().copied(), &self.shut);
            return self.derived.travel_to_focused_s[from].get_or_init(row)[at];
        }
        whole.get_or_init(|| self.travel_row(from, 0..self.candidates.len(), &self.shut))[to]
    }

    /// The same where other doors are shut than now.
    pub fn travel_past_s(&self, from: usize, to: usize, shut: &BTreeSet<usize>) -> f64 {
        if *shut == self.shut {
            return self.travel_s(from, to);
        }
        let key = (from, shut.iter().copied().collect());
        let known =
            self.derived.travel_past_s.lock().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
        let row = known.unwrap_or_else(|| {
            let row = Arc::new(self.travel_row(from, 0..self.candidates.len(), shut));
            let mut rows = self.derived.travel_past_s.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(rows.entry(key).or_insert(row))
        });
        row[to]
    }

    /// Notes the candidates that plans of this round are made with: ways between these are asked for together.
    pub(crate) fn focus_on(&self, candidates: Vec<usize>) {
        self.derived.focused.get_or_init(|| candidates);
    }

    fn travel_row(&self, from: usize, to: impl Iterator<Item = usize>, shut: &BTreeSet<usize>) -> Vec<f64> {
        let places: Vec<Place> = to.map(|to| self.candidates[to].place.clone()).collect();
        let shut: Vec<String> = shut.iter().map(|&n| self.doors[n].door.name.clone()).collect();
        let travel = self.chart.travel(&*self.robot, &self.candidates[from].place, &places, &shut);
        travel.into_iter().map(|t| t.map_or(f64::INFINITY, |t| t.duration_s)).collect()
    }

    /// True if the body can drive to a candidate from where it stands without opening anything.
    pub fn can_drive_to(&self, to: usize) -> bool {
        to == self.at || (!self.out_of_reach.contains(&to) && self.travel_s(self.at, to).is_finite())
    }

    /// True if the body can get to a candidate from where it stands, through doors that it would have to open
    /// too.
    pub fn can_reach(&self, to: usize) -> bool {
        let through_doors =
            || !self.shut.is_empty() && self.travel_past_s(self.at, to, &BTreeSet::new()).is_finite();
        self.can_drive_to(to) || (!self.out_of_reach.contains(&to) && through_doors())
    }

    /// True if a look from a candidate may settle a doubt about the requested objects, once an obstacle has
    /// been moved out of the way.
    pub fn worth_a_look(&self, from: usize, on: usize, moved: Option<usize>) -> bool {
        let taken = Taken { looks: &[], moved };
        self.doubts().iter().any(|doubt| doubt.share_settled(self, (from, on), taken) > 0.0)
    }

    /// Everything that is in doubt about what is asked for: things, kinds and surfaces; where nothing is asked for, every surface.
    pub fn doubts(&self) -> Vec<&Doubt> {
        let things = (0..self.things.len()).map(|what| self.doubt_about(what));
        let kinds = (0..self.kinds.len()).map(|of| self.doubt_of(of));
        let mut doubts: Vec<&Doubt> = things.chain(kinds).collect();
        doubts.extend(self.asked.iter().map(|&on| self.doubt_on(on)));
        if doubts.is_empty() {
            (0..self.surfaces.len()).map(|on| self.doubt_on(on)).collect()
        } else {
            doubts
        }
    }

    /// The objects that may be pushed aside to see what they hide; none while looking alone can settle anything.
    pub fn obstacles(&self) -> &[Obstacle] {
        self.derived.obstacles.get_or_init(|| obstacle::all(self))
    }

    /// True if looks would settle enough doubt once an obstacle were out of the way.
    pub(crate) fn would_uncover(&self, what: usize) -> bool {
        self.doubts().iter().any(|doubt| doubt.can_be_settled_without(self, what))
    }

    /// The kind of a symbol.
    ///
    /// # Errors
    /// [`CallError::Failed`] if there is none.
    pub fn kind(&self, name: &str) -> Result<usize, CallError> {
        find(self.kinds.iter().map(|t| &t.symbol), name, "a kind of which all are looked for")
    }

    /// The obstacle of a symbol.
    ///
    /// # Errors
    /// [`CallError::Failed`] if there is none.
    pub fn obstacle(&self, name: &str) -> Result<usize, CallError> {
        find(self.obstacles().iter().map(|o| &o.symbol), name, "something that may be pushed aside")
    }

    /// Confidence in the place of a thing, 0 to 1: the probability of the likeliest object that it may be,
    /// where it is asked about, times the probability that this object stands where it is believed to, as far
    /// as looks can tell.
    pub fn confidence(&self, what: usize) -> f64 {
        let thing = &self.things[what];
        let there = |t| match thing.probability(t, &self.surfaces) {
            0.0 => 0.0,
            p => p * (1.0 - adrift::chance_off(self, t)),
        };
        self.belief.tracks.iter().map(there).fold(0.0, f64::max)
    }

    /// The object that a thing most probably is, if that is more likely than not.
    pub(crate) fn best(&self, what: usize) -> Option<&Track> {
        let p = |t: &Track| self.things[what].probability(t, &self.surfaces);
        let best = self.belief.tracks.iter().max_by(|a, b| p(a).total_cmp(&p(b)));
        best.filter(|t| p(t) > 0.5)
    }

    /// Confidence in the position of a thing along its surface, 0 to 1; 1 where no such object is believed
    /// in.
    pub fn placed(&self, what: usize) -> f64 {
        self.best(what).map_or(1.0, |track| 1.0 - adrift::chance_off(self, track))
    }

    /// The sides of a surface that a look could show for it to be known better where what was seen of it lies on the map.
    pub(crate) fn unseen_ends(&self, on: usize) -> &[Hypothesis] {
        self.derived.unseen_ends[on].get_or_init(|| adrift::unseen_ends(self, on))
    }

    /// Probability that a thing stands on a surface, 0 to 1.
    pub fn presence(&self, what: usize, on: usize) -> f64 {
        let thing = &self.things[what];
        self.on_surface(on)
            .filter(|t| thing.track.is_none_or(|id| id == t.id))
            .map(|t| t.probability_of(&thing.name))
            .fold(0.0, f64::max)
    }

    /// The probability that a thing is what was lost out of the hand, where it lies no look at a surface shows.
    pub fn chance_lost(&self, what: usize) -> f64 {
        let lost = self.belief.mislaid.iter().filter(|t| t.on.is_empty());
        lost.map(|t| self.things[what].probability(t, &self.surfaces)).fold(0.0, f64::max)
    }

    /// The probability that a thing is there, where it is asked about: as one of the objects that were seen, or hidden.
    pub fn chance_there(&self, what: usize) -> f64 {
        let thing = &self.things[what];
        let none_is =
            self.belief.tracks.iter().map(|t| 1.0 - thing.probability(t, &self.surfaces)).product::<f64>();
        // What hangs on hidden places is reckoned with what the objects leave of it already.
        (1.0 - none_is + self.doubt_about(what).hidden).min(1.0)
    }

    /// Confidence that each object on a surface is identified and none is hidden, 0 to 1.
    pub fn clarity(&self, on: usize) -> f64 {
        let sure = self.on_surface(on).map(Track::certainty).fold(1.0, f64::min);
        sure * (1.0 - self.doubt_on(on).hidden)
    }

    /// The objects on a surface.
    pub fn on_surface(&self, on: usize) -> impl Iterator<Item = &Track> {
        let standing = self.derived.standing.get_or_init(|| {
            let by_symbol: HashMap<&str, usize> =
                self.surfaces.iter().enumerate().map(|(n, s)| (s.symbol.as_str(), n)).collect();
            let mut standing = vec![Vec::new(); self.surfaces.len()];
            for (n, track) in self.belief.tracks.iter().enumerate() {
                if let Some(&on) = by_symbol.get(track.on.as_str()) {
                    standing[on].push(n);
                }
            }
            standing
        });
        standing[on].iter().map(|&n| &self.belief.tracks[n])
    }

    /// The surface that an object stands on.
    pub fn surface_of(&self, track: &Track) -> Option<usize> {
        self.surfaces.iter().position(|s| s.symbol == track.on)
    }

    /// Confidence that all members of a kind are known and no other is hidden, 0 to 1.
    pub fn completeness(&self, of: usize) -> f64 {
        let kind = &self.kinds[of];
        let sure = |t: &Track| {
            let p = kind.probability(t, &self.surfaces);
            p.max(1.0 - p)
        };
        self.belief.tracks.iter().map(sure).product::<f64>() * (1.0 - self.doubt_of(of).hidden)
    }

    /// Completeness that looks can still bring about: of an object that was seen from all sides, none tells
    /// more.
    pub fn most_complete(&self, of: usize) -> f64 {
        let sure = |p: f64| p.max(1.0 - p);
        let told = self.belief.tracks.iter().filter(|track| doubt::is_seen_around(self, track));
        told.map(|track| sure(self.kinds[of].probability(track, &self.surfaces))).product()
    }

    /// True if looks can still show that all of a kind are found, as surely as is required.
    pub fn can_be_complete(&self, of: usize) -> bool {
        self.most_complete(of) >= self.wanted_of(of)
    }

    /// True if a seen object is believed to be of a kind, where it is asked about.
    pub fn has_member(&self, of: usize) -> bool {
        self.belief.tracks.iter().any(|t| self.kinds[of].probability(t, &self.surfaces) > 0.5)
    }

    /// Confidence required to say that all of a kind are found. To say that there is none, at least the
    /// confidence of *not there* is required.
    pub fn wanted_of(&self, of: usize) -> f64 {
        let is_empty = self.completeness(of) >= self.threshold && !self.has_member(of);
        if is_empty { self.threshold.max(1.0 - self.thresholds.not_there) } else { self.threshold }
    }

    /// Doubt about the members of a kind.
    pub fn doubt_of(&self, of: usize) -> &Doubt {
        self.derived.of[of].get_or_init(|| Doubt::of(self, of))
    }

    /// Doubt about a thing.
    pub fn doubt_about(&self, what: usize) -> &Doubt {
        self.derived.about[what].get_or_init(|| Doubt::about(self, what))
    }

    /// Doubt about a thing on one surface.
    pub fn doubt_about_on(&self, what: usize, on: usize) -> &Doubt {
        self.derived.about_on[what * self.surfaces.len() + on].get_or_init(|| Doubt::about_on(self, what, on))
    }

    /// Time to go to a surface and look at it, seconds, doors left out. It is counted from the place of the
    /// last look, so that it stays the same while the body moves.
    pub fn going_there_s(&self, on: usize) -> f64 {
        *self.derived.going_there_s[on].get_or_init(|| {
            let to = self.viewers(on).iter().copied().filter(|&n| !self.observed.contains(&(n, on)));
            let way_s = |n| match n == self.looked_from {
                true => 0.0,
                false => self.travel_past_s(self.looked_from, n, &BTreeSet::new()),
            };
            let way_s = to.map(way_s).filter(|s| s.is_finite()).reduce(f64::min);
            reasons::LOOK_S + way_s.unwrap_or_default()
        })
    }

    /// Position of a point of the map in the localised frame, in which the body moves its hand.
    pub(crate) fn as_localised(&self, p: &Point3<f64>) -> Point3<f64> {
        self.errs_by.map_or(*p, |map_from_localised| map_from_localised.inverse() * p)
    }

    /// Doubt about a surface.
    pub fn doubt_on(&self, on: usize) -> &Doubt {
        self.derived.on[on].get_or_init(|| Doubt::on(self, on))
    }

    /// The looks that the plan takes before a call, by the `observed` facts that the call reads.
    pub(crate) fn planned_looks(&self, call: &Call) -> Vec<(usize, usize)> {
        let look = |r: &descry_planner::Reading| {
            let from = self.candidate(r.arguments.first()?).ok()?;
            let on = self.surface(r.arguments.get(1)?).ok()?;
            (!self.observed.contains(&(from, on))).then_some((from, on))
        };
        holding(call, "observed").filter_map(look).collect()
    }

    /// The obstacle that the plan pushes aside before a call, by the `pushed` facts that the call reads.
    pub(crate) fn planned_push(&self, call: &Call) -> Option<usize> {
        holding(call, "pushed").find_map(|r| self.obstacle(r.arguments.first()?).ok())
    }
}

/// The atoms of a predicate that hold among the facts that a call reads.
pub(crate) fn holding<'a>(
    call: &'a Call,
    predicate: &'a str,
) -> impl Iterator<Item = &'a descry_planner::Reading> {
    call.readings.iter().filter(move |r| &*r.symbol == predicate && r.value == FactValue::Truth(true))
}

fn find<'a>(
    mut symbols: impl Iterator<Item = &'a String>,
    name: &str,
    expected: &str,
) -> Result<usize, CallError> {
    symbols.position(|s| s == name).ok_or_else(|| CallError::Failed(format!("`{name}` is not {expected}")))
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
