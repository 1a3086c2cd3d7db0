//! Visited places, novel objects there, and learned objects.

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::sync::Arc;

use descry_memory::RecordId;
use descry_memory::learned::{LearnedThing, Visited};
use descry_memory::remember::Remembered;
use descry_perception::View;
use descry_perception::learning::{KnowOptions, Library, MetaRoom};
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::recognise::{Handle, ObjectModel, Range, Shape, Top};
use descry_robots::Place as Where;

use crate::known::{Known, Thing};
use crate::past::Past;
use crate::situation::Situation;
use crate::states::{States, state};
use crate::symbol::symbol;

/// Number of equal sectors into which directions around an object are divided.
pub(super) const DIRECTIONS: usize = 36;
/// Number of sectors (10 degrees each) that a view covers to either side of the sector of its viewpoint.
const TO_EITHER_SIDE: usize = 1;

/// Visited places, novel objects and learned objects.
#[derive(Clone, Default)]
pub struct News {
    /// Places to visit, in the order of the surfaces.
    pub places: Vec<Place>,
    /// Objects to be viewed from all around: novel ones, and learned ones known from too few sides.
    pub novelties: Vec<Novelty>,
    /// Changes since earlier visits that leave nothing to learn.
    pub changes: Vec<Difference>,
    /// Learned objects, oldest first: those of earlier runs, then those of this run.
    pub things: Vec<LearnedThing>,
    /// Number of objects learned in this run.
    pub learned: usize,
    /// Learned objects prepared for recognition; `None` if nothing was learned.
    pub models: Option<Arc<Models>>,
    /// Ids of the recorded views that objects are learned from.
    pub records: Vec<RecordId>,
}

/// Place to visit: a surface as seen from a waypoint.
#[derive(Clone)]
pub struct Place {
    /// Symbol of the waypoint.
    pub waypoint: String,
    /// Symbol of the surface that is seen from the waypoint.
    pub on: String,
    /// Static structure of the place from all visits; `None` before the first.
    pub room: Option<Arc<MetaRoom>>,
    /// True if visited in this run.
    pub is_visited: bool,
    /// Reason why the visit of this run could not be compared with earlier ones, if so.
    pub strange: Option<String>,
}

/// Object on a surface that is viewed from all around: novel, or learned from too few sides.
#[derive(Clone)]
pub struct Novelty {
    /// PDDL symbol.
    pub symbol: String,
    /// Symbol of the surface that the object stands on.
    pub on: String,
    /// Centre in the map frame, metres.
    pub centre: Point3<f64>,
    /// Size of the bounding box of the detected part, metres.
    pub size_m: [f64; 3],
    /// Views of the object; the first is the one in which it was detected.
    pub looks: Vec<NoveltyView>,
    /// Pixels of the object in the first view, true where the object is.
    pub mask: Arc<Vec<bool>>,
    /// Viewpoint on each line around the object, by pose symbol; `None` where the body does not fit.
    pub stands: Vec<Option<String>>,
    /// For each viewpoint, true if the route to the next one is no detour.
    pub joined: Vec<bool>,
    /// Index in [`News::things`] of the learned object that matches but is known from too few
    /// sides.
    pub taken_for: Option<usize>,
    /// State of learning the object.
    pub fate: Fate,
}

/// View of a novel object.
#[derive(Clone)]
pub struct NoveltyView {
    /// Symbol of the pose from which the view was taken.
    pub from: String,
    /// View of the object.
    pub view: Arc<View>,
}

/// State of learning a novel object.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// Not learned yet.
    Open,
    /// Learned in this run.
    Learned {
        /// Name given to the object.
        name: String,
        /// Numbers of registered views and of all views.
        looks: (usize, usize),
        /// Share of directions around the object from which it was seen, 0 to 1.
        sides: f64,
    },
    /// Matches an object learned before.
    Known {
        /// Name of the object learned before.
        name: String,
        /// Probability of the match, 0 to 1.
        confidence: f64,
        /// Sentence on the improvement of the known model, if the object was viewed from all around.
        model: Option<String>,
    },
    /// Cannot be learned, with the reason.
    GivenUp(String),
}

/// Change without anything to learn.
#[derive(Clone, Debug, PartialEq)]
pub enum Difference {
    /// A learned object stands elsewhere than before.
    Came {
        /// Name of the object.
        name: String,
        /// Present position, map frame.
        at: Point3<f64>,
        /// Position before, map frame.
        before: Point3<f64>,
    },
    /// A learned object is no longer where it was seen.
    Left {
        /// Name of the object.
        name: String,
        /// Former position, map frame.
        at: Point3<f64>,
    },
    /// Part of the static structure is gone.
    Gone {
        /// Centre, map frame.
        at: Point3<f64>,
        /// Size of the bounding box, metres.
        size_m: [f64; 3],
    },
    /// An object on no surface has appeared.
    Beside {
        /// Centre, map frame.
        at: Point3<f64>,
        /// Size of the bounding box, metres.
        size_m: [f64; 3],
    },
}

impl News {
    /// State at the beginning of a run: the objects learned in earlier runs.
    pub(crate) fn of_past(past: Option<&Past>) -> Self {
        let things = past.map(|p| p.remembered.things.clone()).unwrap_or_default();
        News { models: Models::of(&things), things, ..News::default() }
    }

    /// Adds learned objects and visited places to the persistent belief.
    pub(super) fn keep(known: &Known, past: &Past, later: &mut Remembered) {
        let news = known.news();
        later.things.clone_from(&news.things);
        let pose = |waypoint: &str| match &known.candidates.iter().find(|c| c.symbol == waypoint)?.place {
            Where::Pose(pose) => Some([pose.x_m, pose.y_m, pose.yaw_rad]),
            Where::Station(_) => Some([0.0; 3]),
        };
        later.visited = news.visited(std::mem::take(&mut later.visited), pose, past.now_unix_s);
    }

    /// Learned object whose name has this symbol.
    pub fn thing(&self, of: &str) -> Option<&LearnedThing> {
        self.things.iter().find(|t| symbol(&t.name) == of)
    }

    /// Novel object with a symbol.
    pub fn novelty(&self, of: &str) -> Option<&Novelty> {
        self.novelties.iter().find(|n| n.symbol == of)
    }

    /// Name that no learned object has yet.
    pub(super) fn free_name(&self) -> String {
        let is_free = |n: &usize| self.thing(&symbol(&format!("thing {n}"))).is_none();
        let number = (self.things.len() + 1..).find(is_free).unwrap_or_default();
        format!("thing {number}")
    }

    /// Visits for later runs to remember: those of `before`, replaced by this run's. `at` gives the pose
    /// of a waypoint (x, y in metres, yaw in radians); `now` is the Unix time in seconds.
    fn visited(&self, before: Vec<Visited>, at: impl Fn(&str) -> Option<[f64; 3]>, now: f64) -> Vec<Visited> {
        let seen: Vec<Visited> = self
            .places
            .iter()
            .filter(|p| p.is_visited)
            .filter_map(|p| {
                let room = MetaRoom::clone(p.room.as_ref()?);
                Some(Visited { waypoint: p.waypoint.clone(), at: at(&p.waypoint)?, last_unix_s: now, room })
            })
            .collect();
        let is_old = |v: &Visited| seen.iter().all(|s| s.waypoint != v.waypoint);
        let mut kept: Vec<Visited> = before.into_iter().filter(is_old).collect();
        kept.extend(seen);
        kept
    }
}

impl Novelty {
    /// Radius of the footprint around the centre, metres.
    pub(super) fn radius_m(&self) -> f64 {
        0.5 * self.size_m[0].hypot(self.size_m[1])
    }

    /// Sector of the direction from the object to a point, below [`DIRECTIONS`]; counter-clockwise from
    /// the map's x.
    fn direction(&self, from: &Point3<f64>) -> usize {
        let off = from - self.centre;
        let turn = off.y.atan2(off.x).rem_euclid(TAU);
        (turn / TAU * DIRECTIONS as f64).round() as usize % DIRECTIONS
    }

    /// Sectors around the object that a view from a point shows.
    fn shown(&self, from: &Point3<f64>) -> impl Iterator<Item = usize> + use<> {
        let middle = self.direction(from) + DIRECTIONS - TO_EITHER_SIDE;
        (0..=2 * TO_EITHER_SIDE).map(move |k| (middle + k) % DIRECTIONS)
    }

    /// Sectors from which the object was seen, as bits, counted in a frame of the object that is turned
    /// by `turned_rad` about the vertical.
    pub(super) fn directions(&self, turned_rad: f64) -> u64 {
        let turned = (turned_rad.rem_euclid(TAU) / TAU * DIRECTIONS as f64).round() as usize;
        self.seen().iter().fold(0, |all, k| all | 1 << ((k + DIRECTIONS - turned % DIRECTIONS) % DIRECTIONS))
    }

    /// Sectors from which the object was seen.
    pub(super) fn seen(&self) -> BTreeSet<usize> {
        let eye = |l: &NoveltyView| Point3::from(l.view.world_from_camera.translation.vector);
        self.looks.iter().map(eye).flat_map(|eye| self.shown(&eye)).collect()
    }

    /// Sectors that a view from a pose shows; none for a station.
    pub(super) fn shown_from(&self, s: &Situation, pose: &str) -> Vec<usize> {
        let place = s.candidate(pose).ok().map(|n| &s.candidates[n].place);
        match place {
            Some(descry_robots::Place::Pose(p)) => {
                self.shown(&Point3::new(p.x_m, p.y_m, self.centre.z)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Reachable viewpoints around the object from which it was not viewed yet.
    pub(super) fn open_stands<'a>(&'a self, s: &'a Situation) -> impl Iterator<Item = &'a String> + 'a {
        let can_go = |pose: &&String| s.candidate(pose).is_ok_and(|n| !s.out_of_reach.contains(&n));
        self.stands.iter().flatten().filter(can_go).filter(|pose| self.looks.iter().all(|l| l.from != **pose))
    }

    /// Share of all sectors that are unseen but visible from a remaining viewpoint, 0 to 1.
    pub(super) fn unfaced(&self, s: &Situation) -> f64 {
        let seen = self.seen();
        let open: BTreeSet<usize> = self.open_stands(s).flat_map(|pose| self.shown_from(s, pose)).collect();
        open.difference(&seen).count() as f64 / DIRECTIONS as f64
    }
}

/// Learned objects prepared for recognition.
pub struct Models {
    /// Library of the models' surfels and features.
    pub(super) known: Library,
    /// Index in [`News::things`] of each model; incompletely seen objects have no model.
    pub(super) things: Vec<usize>,
}

impl Models {
    /// Prepares learned objects for recognition; `None` if there are none.
    pub(super) fn of(things: &[LearnedThing]) -> Option<Arc<Models>> {
        let mut models = Models { known: Library::default(), things: Vec::new() };
        for (n, thing) in things.iter().enumerate() {
            if models.known.add(&thing.cloud, &KnowOptions::default()).is_ok() {
                models.things.push(n);
            }
        }
        (!models.known.is_empty()).then(|| Arc::new(models))
    }
}

/// Box of a learned object's size, as the object model for computing visibility.
fn model(thing: &LearnedThing) -> ObjectModel {
    /// Relative tolerance of the size, as the object may rest on another side.
    const OFF: f64 = 0.1;
    let (low, high) = thing.cloud.bounds().unwrap_or_default();
    let size: Vector3<f64> = (high - low).cast();
    let about = |m: f64| Range { low: m * (1.0 - OFF), high: m * (1.0 + OFF) };
    ObjectModel {
        name: thing.name.clone(),
        kind: thing.name.clone(),
        phrases: Vec::new(),
        shape: Shape::Box,
        height_m: about(size.z),
        diameter_m: None,
        width_m: Some(about(size.x.max(size.y))),
        depth_m: Some(about(size.x.min(size.y))),
        taper: Range { low: 1.0, high: 1.0 },
        top: Top::Any,
        handle: Handle::Any,
        colours: Vec::new(),
    }
}

/// Symbol of a spoken name, without a leading article; names with equal symbols cannot be
/// distinguished.
pub fn called(name: &str) -> String {
    symbol(crate::english::without_article(&name.to_lowercase()))
}

state!(News);

impl Known {
    /// State of *learning*: visited places, novel objects and learned objects.
    pub(super) fn news(&self) -> &News {
        self.states.get()
    }

    /// Mutable access to the state of *learning*.
    pub(super) fn news_mut(&mut self) -> &mut News {
        self.states.get_mut()
    }
}

/// Learned object with a symbol, as a search target.
pub(super) fn thing(states: &States, symbol: &str) -> Option<Thing> {
    let learned = states.get::<News>().thing(symbol)?;
    let (name, models) = (learned.name.clone(), vec![model(learned)]);
    Some(Thing { symbol: symbol.into(), name, models, ..Thing::default() })
}
