//! Visited places, novel objects found there, and learned things.

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

/// Number of viewing directions around an object that are distinguished.
pub(super) const DIRECTIONS: usize = 36;
/// A look shows what lies so far to either side of where it comes from, directions: 15 degrees.
const TO_EITHER_SIDE: usize = 1;

/// Visited places, novel objects and learned things.
#[derive(Clone, Default)]
pub struct News {
    /// Places to visit, by the symbols of their poses.
    pub places: Vec<Place>,
    /// Novel objects that are no learned things.
    pub novelties: Vec<Novelty>,
    /// Changes in which there is nothing to be learned.
    pub changes: Vec<Difference>,
    /// Things that were learned, the oldest first: those of earlier runs, then those of this one.
    pub things: Vec<LearnedThing>,
    /// The number of things that this run has learned.
    pub learned: usize,
    /// The same made ready to be known again; none if nothing was learned.
    pub models: Option<Arc<Models>>,
    /// Records of the looks that novelties are learned from.
    pub records: Vec<RecordId>,
}

/// A place that is visited.
#[derive(Clone)]
pub struct Place {
    /// The symbol of its waypoint.
    pub waypoint: String,
    /// The symbol of the surface that is looked at from there.
    pub on: String,
    /// Its static structure, by earlier visits and this one; none before the first.
    pub room: Option<Arc<MetaRoom>>,
    /// True if it has been visited in this run.
    pub is_visited: bool,
    /// The reason a visit could not be compared with earlier ones.
    pub strange: Option<String>,
}

/// Something new on a surface.
#[derive(Clone)]
pub struct Novelty {
    /// Its PDDL symbol.
    pub symbol: String,
    /// The symbol of the surface that it stands on.
    pub on: String,
    /// Its middle, in the map.
    pub centre: Point3<f64>,
    /// Sides of the box around what was noticed of it, metres.
    pub size_m: [f64; 3],
    /// Looks at the object; the first one noticed it.
    pub looks: Vec<NoveltyView>,
    /// Its pixels in that.
    pub mask: Arc<Vec<bool>>,
    /// On each line around it where to stand, by the symbol of the pose; none where the body does not fit.
    pub stands: Vec<Option<String>>,
    /// For each of them, true if the route to the next one is no detour.
    pub joined: Vec<bool>,
    /// The learned thing that it was taken for, though too few of the sides of that are known: its index in
    /// [`News::things`].
    pub taken_for: Option<usize>,
    /// Its fate.
    pub fate: Fate,
}

/// A look at something new.
#[derive(Clone)]
pub struct NoveltyView {
    /// The symbol of the pose that it was taken from.
    pub from: String,
    /// The view that shows it.
    pub view: Arc<View>,
}

/// The fate of a novel object.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// It is still to be learned.
    Open,
    /// It was learned.
    Learned {
        /// Its name.
        name: String,
        /// Looks that fit, and of how many.
        looks: (usize, usize),
        /// Share of the directions around it from which it was seen.
        sides: f64,
    },
    /// It is something that was learned before.
    Known {
        /// Its name.
        name: String,
        /// Probability of that.
        confidence: f64,
        /// Result of modelling it, in words, if it was looked at from around.
        model: Option<String>,
    },
    /// It cannot be learned.
    GivenUp(String),
}

/// A change in which there is nothing to be learned.
#[derive(Clone, Debug, PartialEq)]
pub enum Difference {
    /// Something that was learned has come or has been moved.
    Came {
        /// Its name.
        name: String,
        /// Its present position.
        at: Point3<f64>,
        /// Its position before.
        before: Point3<f64>,
    },
    /// Something that was learned is not where it was seen.
    Left {
        /// Its name.
        name: String,
        /// Its former position.
        at: Point3<f64>,
    },
    /// Something of the static structure is gone.
    Gone {
        /// Its middle.
        at: Point3<f64>,
        /// Sides of the box around it, metres.
        size_m: [f64; 3],
    },
    /// Something has come that stands on no surface.
    Beside {
        /// Its middle.
        at: Point3<f64>,
        /// Sides of the box around it, metres.
        size_m: [f64; 3],
    },
}

impl News {
    /// Knowledge at the beginning of a run.
    pub(crate) fn of_past(past: Option<&Past>) -> Self {
        let things = past.map(|p| p.remembered.things.clone()).unwrap_or_default();
        News { models: Models::of(&things), things, ..News::default() }
    }

    /// Adds what was learned and visited to what later runs remember.
    pub(super) fn keep(known: &Known, past: &Past, later: &mut Remembered) {
        let news = known.news();
        later.things.clone_from(&news.things);
        let pose = |waypoint: &str| match &known.candidates.iter().find(|c| c.symbol == waypoint)?.place {
            Where::Pose(pose) => Some([pose.x_m, pose.y_m, pose.yaw_rad]),
            Where::Station(_) => Some([0.0; 3]),
        };
        later.visited = news.visited(std::mem::take(&mut later.visited), pose, past.now_unix_s);
    }

    /// The learned object of a symbol, as the lexicon makes symbols of names.
    pub fn thing(&self, of: &str) -> Option<&LearnedThing> {
        self.things.iter().find(|t| symbol(&t.name) == of)
    }

    /// The novelty of a symbol.
    pub fn novelty(&self, of: &str) -> Option<&Novelty> {
        self.novelties.iter().find(|n| n.symbol == of)
    }

    /// A name that nothing learned has yet.
    pub(super) fn free_name(&self) -> String {
        let is_free = |n: &usize| self.thing(&symbol(&format!("thing {n}"))).is_none();
        let number = (self.things.len() + 1..).find(is_free).unwrap_or_default();
        format!("thing {number}")
    }

    /// Visits for a later run to remember: places visited in this run as they are now, the others as they
    /// were.
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
    /// Radius of its footprint around its centre, metres.
    pub(super) fn radius_m(&self) -> f64 {
        0.5 * self.size_m[0].hypot(self.size_m[1])
    }

    /// The direction of a place around it, one of [`DIRECTIONS`].
    fn direction(&self, from: &Point3<f64>) -> usize {
        let off = from - self.centre;
        let turn = off.y.atan2(off.x).rem_euclid(TAU);
        (turn / TAU * DIRECTIONS as f64).round() as usize % DIRECTIONS
    }

    /// The directions that a look from a place shows.
    fn shown(&self, from: &Point3<f64>) -> impl Iterator<Item = usize> + use<> {
        let middle = self.direction(from) + DIRECTIONS - TO_EITHER_SIDE;
        (0..=2 * TO_EITHER_SIDE).map(move |k| (middle + k) % DIRECTIONS)
    }

    /// The directions from which it was seen, as a thing that stands turned by so much has them: a bit each.
    pub(super) fn directions(&self, turned_rad: f64) -> u64 {
        let turned = (turned_rad.rem_euclid(TAU) / TAU * DIRECTIONS as f64).round() as usize;
        self.seen().iter().fold(0, |all, k| all | 1 << ((k + DIRECTIONS - turned % DIRECTIONS) % DIRECTIONS))
    }

    /// The directions from which it was seen.
    pub(super) fn seen(&self) -> BTreeSet<usize> {
        let eye = |l: &NoveltyView| Point3::from(l.view.world_from_camera.translation.vector);
        self.looks.iter().map(eye).flat_map(|eye| self.shown(&eye)).collect()
    }

    /// The directions that a look from a pose shows.
    pub(super) fn shown_from(&self, s: &Situation, pose: &str) -> Vec<usize> {
        let place = s.candidate(pose).ok().map(|n| &s.candidates[n].place);
        match place {
            Some(descry_robots::Place::Pose(p)) => {
                self.shown(&Point3::new(p.x_m, p.y_m, self.centre.z)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// The stands from which it may still be looked at.
    pub(super) fn open_stands<'a>(&'a self, s: &'a Situation) -> impl Iterator<Item = &'a String> + 'a {
        let can_go = |pose: &&String| s.candidate(pose).is_ok_and(|n| !s.out_of_reach.contains(&n));
        self.stands.iter().flatten().filter(can_go).filter(|pose| self.looks.iter().all(|l| l.from != **pose))
    }

    /// Directions that were not seen and can be seen from where the body fits, as a share of all.
    pub(super) fn unfaced(&self, s: &Situation) -> f64 {
        let seen = self.seen();
        let open: BTreeSet<usize> = self.open_stands(s).flat_map(|pose| self.shown_from(s, pose)).collect();
        open.difference(&seen).count() as f64 / DIRECTIONS as f64
    }
}

/// Learned things made ready to be known again.
pub struct Models {
    /// Their surfaces and features.
    pub(super) known: Library,
    /// Index in [`News::things`] of each model; things of which too little was seen have none.
    pub(super) things: Vec<usize>,
}

impl Models {
    /// Makes things ready; none if there is none.
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

/// Object model of a learned thing for visibility questions: a body of its size.
fn model(thing: &LearnedThing) -> ObjectModel {
    /// Tolerance of a size comparison: the object may rest on another side, and edges are measured
    /// this accurately.
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
    }
}

/// Symbol of a name as people say it, without a leading article: two names with the same one cannot be told apart.
pub fn called(name: &str) -> String {
    symbol(crate::english::without_article(&name.to_lowercase()))
}

state!(News);

impl Known {
    /// Novel objects and learned things.
    pub(super) fn news(&self) -> &News {
        self.states.get()
    }

    /// The same, to be changed.
    pub(super) fn news_mut(&mut self) -> &mut News {
        self.states.get_mut()
    }
}

/// The learned thing of a symbol, to be looked for.
pub(super) fn thing(states: &States, symbol: &str) -> Option<Thing> {
    let learned = states.get::<News>().thing(symbol)?;
    let (name, models) = (learned.name.clone(), vec![model(learned)]);
    Some(Thing { symbol: symbol.into(), name, models, ..Thing::default() })
}
