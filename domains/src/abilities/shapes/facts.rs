//! Predicates and functions whose values *shapes* states.

use super::floor::{FloorThing, NOTHING_KNOWN_M, THIS};
use crate::ability::Fact;
use crate::range::{Range, Referent};
use crate::situation::Situation;
use crate::symbol::symbol;

/// All facts of *shapes*.
pub(super) const ALL: &[Fact] = &[
    Fact {
        name: "around",
        types: &["pose", "spot"],
        about: "the pose is one of those around it",
        states: around,
        bounds: None,
    },
    Fact {
        name: "on-floor",
        types: &["pose"],
        about: "the pose is around nothing",
        states: on_floor,
        bounds: None,
    },
    Fact {
        name: "looseness",
        types: &["spot"],
        about: "how far on average it may reach beyond what was met of it, metres",
        states: looseness,
        bounds: Some(looseness_bounds),
    },
    Fact {
        name: "aligned",
        types: &["spot"],
        about: "all scans of it are brought together",
        states: aligned,
        bounds: None,
    },
    Fact {
        name: "sureness",
        types: &["spot"],
        about: "how sure it is what it is, or that it is none of the known",
        states: sureness,
        bounds: Some(sureness_bounds),
    },
    Fact {
        name: "may-be",
        types: &["spot", "shape"],
        about: "its scans fit that shape",
        states: may_be,
        bounds: Some(may_be_bounds),
    },
    Fact {
        name: "found",
        types: &["shape"],
        about: "how sure it is that something on the floor has that shape",
        states: found,
        bounds: Some(found_bounds),
    },
    Fact {
        name: "learned",
        types: &["shape"],
        about: "its shape was learned in this run",
        states: learned,
        bounds: None,
    },
];

fn around(s: &Situation) -> Vec<String> {
    let of = |t: &FloorThing| {
        t.ring.iter().map(|pose| format!("(around {pose} {})", t.symbol)).collect::<Vec<_>>()
    };
    s.floor().things.iter().flat_map(of).collect()
}

fn on_floor(s: &Situation) -> Vec<String> {
    let is_around = |pose: &String| s.floor().things.iter().any(|t| t.ring.contains(pose));
    let open = s.candidates.iter().filter(|c| !is_around(&c.symbol));
    open.map(|c| format!("(on-floor {})", c.symbol)).collect()
}

fn looseness(s: &Situation) -> Vec<String> {
    let mut lines: Vec<String> = s
        .floor()
        .things
        .iter()
        .map(|t| format!("(= (looseness {}) {:.5})", t.symbol, t.looseness_m()))
        .collect();
    if s.floor().thing(THIS).is_none() {
        lines.push(format!("(= (looseness {THIS}) {NOTHING_KNOWN_M})"));
    }
    lines
}

fn aligned(s: &Situation) -> Vec<String> {
    let aligned = s.floor().things.iter().filter(|t| t.taken_for.is_some());
    aligned.map(|t| format!("(aligned {})", t.symbol)).collect()
}

fn sureness(s: &Situation) -> Vec<String> {
    let known = s.floor().known.len();
    let mut lines: Vec<String> = s
        .floor()
        .things
        .iter()
        .map(|t| format!("(= (sureness {}) {:.6})", t.symbol, t.sureness(known)))
        .collect();
    if s.floor().thing(THIS).is_none() {
        lines.push(format!("(= (sureness {THIS}) 0)"));
    }
    lines
}

fn may_be(s: &Situation) -> Vec<String> {
    let of = |t: &FloorThing| {
        let names = t.may_be().unwrap_or_default();
        names.iter().map(|name| format!("(may-be {} {})", t.symbol, symbol(name))).collect::<Vec<_>>()
    };
    s.floor().things.iter().flat_map(of).collect()
}

fn found(s: &Situation) -> Vec<String> {
    let line = |name: &String| format!("(= (found {name}) {:.6})", s.floor().surest(name));
    s.floor().names.iter().map(|(name, _)| line(name)).collect()
}

/// Object on the floor that a referent denotes, if it was found.
fn thing_of<'a>(s: &'a Situation, of: Option<&Referent<'_>>) -> Option<&'a FloorThing> {
    match of {
        Some(Referent::Named(name)) => s.floor().thing(name),
        _ => None,
    }
}

/// Bounds on an object's looseness, metres: further scans can only lessen it.
fn looseness_bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let now_m = thing_of(s, of.first()).map_or(NOTHING_KNOWN_M, FloorThing::looseness_m);
    Range { believed: now_m, least: 0.0, greatest: now_m, sure: 1.0 }
}

/// Bounds on the certainty of what shape an object has.
fn sureness_bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let sure = |t: &FloorThing| Range::certainty(t.sureness(s.floor().known.len()), s.threshold);
    thing_of(s, of.first()).map_or(Range::UNKNOWN, sure)
}

/// Bounds on the truth of `(may-be ?spot ?shape)`: unknown before all scans of the object are aligned.
fn may_be_bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let [spot, Referent::Named(shape)] = of else { return Range::UNKNOWN };
    let names = thing_of(s, Some(spot)).and_then(FloorThing::may_be);
    let fits = |names: &[String]| names.iter().any(|name| symbol(name) == **shape);
    names.map_or(Range::UNKNOWN, |names| Range::exactly(f64::from(u8::from(fits(names)))))
}

/// Bounds on the certainty that something on the floor has a shape; zero if nothing can have it.
fn found_bounds(s: &Situation, of: &[Referent<'_>]) -> Range {
    let [Referent::Named(shape)] = of else { return Range::UNKNOWN };
    let sure = Range::certainty(s.floor().surest(shape), s.threshold);
    let is_absent = sure.believed < s.threshold && s.floor().has_none(shape, s.threshold);
    if is_absent { Range::exactly(0.0).with(s.threshold) } else { sure }
}

fn learned(s: &Situation) -> Vec<String> {
    s.floor().learned.iter().map(|k| format!("(learned {})", symbol(&k.name))).collect()
}
