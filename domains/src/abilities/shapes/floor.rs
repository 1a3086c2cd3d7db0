//! Objects on the floor found by the laser outside the map, and the named shapes.

use std::collections::BTreeSet;
use std::sync::Arc;

use descry_perception::laser::{Alignment, Ignored, KnownShape, PosedScan, Recognition, ScanGain, Verdict};
use descry_perception::nalgebra::{Point2, Vector2};

use crate::abilities::shapes::unseen::UnseenFloor;
use crate::config::Candidates;
use crate::known::Known;
use crate::situation::Situation;
use crate::states::state;
use crate::symbol::symbol;

/// Symbol of the first object found on the floor, the one nearest to the body at its first sweep.
pub const THIS: &str = "this";
/// Looseness (mean distance that an object may reach beyond its outline) of an object without scans,
/// metres.
pub const NOTHING_KNOWN_M: f64 = 1.0;
/// Prior probability that an object is of no known shape.
const STRANGER: f64 = 0.5;
/// Probability that the scans of a known shape fit no model, each with the looseness in metres below
/// which it applies: 1 of 210 measured with closed outlines, see `experiments/measure/src/shapes`. Open
/// outlines constrain scans less and are scanned once more before they are called unknown.
const MISSED: [(f64, f64); 2] = [(0.02, 0.01), (f64::INFINITY, 0.15)];
/// Probability that an object of no known shape fits one of five known shapes, each with the looseness
/// in metres below which it applies: measured with 210 objects, scanned until that looseness or until
/// one shape was left.
const TAKEN_FOR_KNOWN: [(f64, f64); 4] = [(0.01, 0.07), (0.02, 0.10), (0.16, 0.16), (f64::INFINITY, 0.60)];
/// Number of known shapes in that measurement.
const MEASURED_WITH: f64 = 5.0;

/// Objects found by the laser outside the map, and the named shapes.
#[derive(Clone, Default)]
pub struct Floor {
    /// Named shapes: those of the domain, then learned ones.
    pub known: Vec<KnownShape>,
    /// Shapes learned in this run.
    pub learned: Vec<KnownShape>,
    /// Objects found on the floor.
    pub things: Vec<FloorThing>,
    /// Time of each sweep, nanoseconds, with the symbol of its pose.
    pub sweeps: Vec<(i64, String)>,
    /// Ids of the recorded sweeps.
    pub records: Vec<descry_memory::RecordId>,
    /// Floor that no sweep has passed over.
    pub unseen: UnseenFloor,
    /// Symbols of the requested shapes; empty: the goal is about [`THIS`].
    pub sought: Vec<String>,
    /// Symbol and spoken name of each shape.
    pub names: Vec<(String, String)>,
    /// Centres of unobserved discs on which an object of a sought shape may stand, map frame.
    pub room: Vec<Point2<f64>>,
    /// Symbols of the poses from which a sweep would pass over one of the places in `room`.
    pub promising: BTreeSet<String>,
    /// Number and distance of the viewpoints placed around a floor object.
    pub poses: Candidates,
}

/// Object on the floor.
#[derive(Clone)]
pub struct FloorThing {
    /// PDDL symbol.
    pub symbol: String,
    /// Approximate centre, map frame.
    pub near: Point2<f64>,
    /// Scans that bound the object on both sides, in the map frame, each with its pose symbol.
    pub scans: Vec<(String, PosedScan)>,
    /// Unusable scans, each with its pose symbol and the reason.
    pub ignored: Vec<(String, Ignored)>,
    /// Symbols of the viewpoints around the object, in order.
    pub ring: Vec<String>,
    /// Joint outline of the scans; `None` before alignment.
    pub outline: Option<Arc<Outline>>,
    /// Recognition result of the last alignment; `None` after a newer scan.
    pub taken_for: Option<Arc<Recognition>>,
}

/// Joint outline of an object's scans.
pub struct Outline {
    /// Aligned scans, in the map.
    pub alignment: Alignment,
    /// Expected gain of a scan from each viewpoint around the object.
    pub outlook: ScanGain,
}

impl Floor {
    /// Object with a symbol.
    pub fn thing(&self, name: &str) -> Option<&FloorThing> {
        self.things.iter().find(|t| t.symbol == name)
    }

    /// True if a shape with this name is known.
    pub fn knows(&self, shape: &str) -> bool {
        self.known.iter().any(|k| symbol(&k.name) == shape)
    }

    /// True if an object that no sweep has met may stand on the floor.
    pub fn may_hide_more(&self) -> bool {
        self.sweeps.is_empty() || self.sought.is_empty() || !self.room.is_empty()
    }

    /// True if a thing may be of one of the sought shapes, as far as its scans tell.
    pub fn may_be_sought(&self, thing: &FloorThing, threshold: f64) -> bool {
        self.sought.iter().any(|shape| thing.may_have(shape, self.known.len(), threshold))
    }

    /// True if nothing of a shape stands anywhere on the floor, as far as sweeps and scans tell.
    pub fn has_none(&self, shape: &str, threshold: f64) -> bool {
        let may_have = |t: &FloorThing| t.may_have(shape, self.known.len(), threshold);
        let is_sought = self.sought.iter().any(|sought| sought == shape);
        is_sought && self.knows(shape) && !self.may_hide_more() && !self.things.iter().any(may_have)
    }

    /// Highest confidence among objects that fit this name alone; 0 if none does.
    pub fn surest(&self, shape: &str) -> f64 {
        let of_name = self.things.iter().filter(|t| t.is().is_some_and(|is| symbol(is) == shape));
        of_name.map(|t| t.sureness(self.known.len())).fold(0.0, f64::max)
    }
}

impl FloorThing {
    /// Mean distance that the object may extend beyond its measured outline, metres.
    pub fn looseness_m(&self) -> f64 {
        let known = |outline: &Arc<Outline>| outline.outlook.looseness_m(&[]).min(0.9 * NOTHING_KNOWN_M);
        self.outline.as_ref().map_or(NOTHING_KNOWN_M, known)
    }

    /// Looseness expected after scans from the viewpoints `more` (indices in `ring`), metres; 0 after
    /// all of them.
    pub fn hoped_looseness_m(&self, more: &[usize]) -> f64 {
        let Some(outlook) = self.outline.as_ref().map(|o| &o.outlook) else { return NOTHING_KNOWN_M };
        let all: Vec<usize> = (0..self.ring.len()).collect();
        let [now, after, least] = [&[], more, &all[..]].map(|poses| outlook.leaves_m2(poses));
        let share = if now > least { (after - least) / (now - least) } else { 1.0 };
        self.looseness_m() * share
    }

    /// Name of the known shape that fits, if only one does.
    pub fn is(&self) -> Option<&str> {
        match &self.taken_for.as_ref()?.verdict {
            Verdict::Is(name) => Some(name),
            Verdict::OneOf(_) | Verdict::Unknown => None,
        }
    }

    /// Names of the shapes that the scans do not rule out; `None` before alignment: any.
    pub fn may_be(&self) -> Option<&[String]> {
        Some(&self.taken_for.as_ref()?.may_be)
    }

    /// True if the object may have a shape, given its scans and the number of `known` shapes; false if
    /// it surely has another shape or none, or if this shape is ruled out.
    pub fn may_have(&self, shape: &str, known: usize, threshold: f64) -> bool {
        let is_sure = self.sureness(known) >= threshold;
        match self.taken_for.as_deref() {
            None => true,
            Some(Recognition { verdict: Verdict::Unknown, .. }) => !is_sure,
            Some(Recognition { verdict: Verdict::Is(name), .. }) if is_sure => symbol(name) == shape,
            Some(taken) => taken.may_be.iter().any(|name| symbol(name) == shape),
        }
    }

    /// Confidence in the shape that alone fits, or in the object having no known shape, 0 to 1; 0 while
    /// several fit.
    pub fn sureness(&self, known: usize) -> f64 {
        match self.taken_for.as_ref().map(|r| &r.verdict) {
            None | Some(Verdict::OneOf(_)) => 0.0,
            Some(Verdict::Is(_)) => sure_of_name(self.looseness_m(), known),
            Some(Verdict::Unknown) => {
                let told = (1.0 - by_chance(self.looseness_m(), known)) * STRANGER;
                told / (told + up_to(&MISSED, self.looseness_m()) * (1.0 - STRANGER))
            }
        }
    }

    /// Maximum confidence reachable by scans from the viewpoints `more` (indices in `ring`).
    pub fn hoped(&self, more: &[usize], known: usize) -> f64 {
        self.hoped_of_name(more, known).max(self.sureness(known))
    }

    /// Confidence after scans from the viewpoints `more` (indices in `ring`), if one shape alone fits
    /// then.
    pub fn hoped_of_name(&self, more: &[usize], known: usize) -> f64 {
        sure_of_name(self.hoped_looseness_m(more), known)
    }
}

/// Probability that an object has the only shape that fits, among `known` shapes, at a looseness in
/// metres.
fn sure_of_name(loose_m: f64, known: usize) -> f64 {
    let is = 1.0 - STRANGER;
    is / (is + by_chance(loose_m, known) * STRANGER)
}

/// Probability that an object of no known shape fits one of `known` shapes by chance.
fn by_chance(loose_m: f64, known: usize) -> f64 {
    1.0 - (1.0 - up_to(&TAKEN_FOR_KNOWN, loose_m)).powf(known as f64 / MEASURED_WITH)
}

/// Value of the first bin whose upper edge exceeds the looseness; 1 beyond the last.
fn up_to(bins: &[(f64, f64)], loose_m: f64) -> f64 {
    bins.iter().find(|(edge_m, _)| loose_m < *edge_m).map_or(1.0, |(_, share)| *share)
}

/// Floor object with a symbol; `None` for [`THIS`] before anything was found, an error for any other
/// unknown symbol.
pub(super) fn thing<'a>(s: &'a Situation, name: &str) -> Result<Option<&'a FloorThing>, String> {
    match s.floor().thing(name) {
        None if name != THIS => Err(format!("`{name}` is nothing that was found on the floor")),
        found => Ok(found),
    }
}

/// Centre of an object in the map and its greatest width, metres: from the recognised shape, else
/// from the outline.
pub(super) fn place(floor: &Floor, thing: &FloorThing) -> (Point2<f64>, f64) {
    let fitted = thing.taken_for.as_ref().filter(|_| thing.is().is_some()).and_then(|r| r.candidates.first());
    if let Some(candidate) = fitted {
        let shape = &floor.known[candidate.index];
        let map_from_model = candidate.fit.model_from_other.inverse();
        return (map_from_model * shape.features().centre, width_m(&shape.model.hull().corners));
    }
    match &thing.outline {
        Some(outline) => {
            let hull = outline.alignment.model.hull();
            (hull.centre(), width_m(&hull.corners))
        }
        None => (thing.near, 0.0),
    }
}

/// Greatest distance between two corners, metres.
pub(super) fn width_m(corners: &[Point2<f64>]) -> f64 {
    let apart = |a: &Point2<f64>| corners.iter().map(|b| (a - b).norm()).fold(0.0, f64::max);
    corners.iter().map(apart).fold(0.0, f64::max)
}

/// Least width of a convex outline, metres.
pub(super) fn least_width_m(corners: &[Point2<f64>]) -> f64 {
    let n = corners.len();
    let across = |i: usize| {
        let side: Vector2<f64> = (corners[(i + 1) % n] - corners[i]).normalize();
        corners.iter().map(|c| side.perp(&(c - corners[i])).abs()).fold(0.0, f64::max)
    };
    (0..n).map(across).fold(f64::INFINITY, f64::min)
}

state!(Floor);

impl Known {
    /// State of *shapes*: the objects found on the floor and the named shapes.
    pub(super) fn floor(&self) -> &Floor {
        self.states.get()
    }

    /// Mutable access to the floor, the state of the ability *shapes*.
    pub(super) fn floor_mut(&mut self) -> &mut Floor {
        self.states.get_mut()
    }
}
