//! Predicates and functions whose values *learning* states.

use super::news::{Fate, Novelty};
use super::stands;
use crate::ability::Fact;
use crate::situation::Situation;

/// All facts of *learning*.
pub(super) const ALL: &[Fact] = &[
    Fact {
        name: "waypoint",
        types: &["pose"],
        about: "a place is visited from there",
        states: waypoint,
        bounds: None,
    },
    Fact {
        name: "stand",
        types: &["pose", "novelty"],
        about: "one can look at it from there",
        states: stand,
        bounds: None,
    },
    Fact {
        name: "way-in",
        types: &["pose"],
        about: "one may drive there from anywhere: it stands around nothing, or begins a way around something",
        states: way_in,
        bounds: None,
    },
    Fact {
        name: "next-to",
        types: &["pose", "pose"],
        about: "neighbours on the way around something; to drive from one to the other is no detour",
        states: next_to,
        bounds: None,
    },
    Fact {
        name: "before",
        types: &["novelty", "novelty"],
        about: "one is learned after the other, in the order in which they were noticed",
        states: before,
        bounds: None,
    },
    Fact {
        name: "unfaced",
        types: &["novelty"],
        about: "share of the directions around it that were not seen and can be seen",
        states: unfaced,
        bounds: None,
    },
    Fact {
        name: "settled",
        types: &["novelty"],
        about: "it was learned, is known, or cannot be learned",
        states: settled,
        bounds: None,
    },
];

fn waypoint(s: &Situation) -> Vec<String> {
    s.news().places.iter().map(|p| format!("(waypoint {})", p.waypoint)).collect()
}

/// Novel objects that are still to be learned.
fn open(s: &Situation) -> impl Iterator<Item = &Novelty> {
    s.news().novelties.iter().filter(|n| n.fate == Fate::Open)
}

fn stand(s: &Situation) -> Vec<String> {
    let of = |n: &Novelty| {
        n.stands.iter().flatten().map(|pose| format!("(stand {pose} {})", n.symbol)).collect::<Vec<_>>()
    };
    open(s).flat_map(of).collect()
}

fn way_in(s: &Situation) -> Vec<String> {
    let around =
        |pose: &String| s.news().novelties.iter().any(|n| n.stands.iter().flatten().any(|p| p == pose));
    let free = s.candidates.iter().map(|c| &c.symbol).filter(|pose| !around(pose)).cloned();
    let first = open(s).next().map(|n| n.symbol.as_str());
    let in_turn = open(s).flat_map(|n| stands::ways_in(s, n, Some(n.symbol.as_str()) == first));
    free.chain(in_turn).map(|pose| format!("(way-in {pose})")).collect()
}

fn next_to(s: &Situation) -> Vec<String> {
    let both = |(a, b): (String, String)| [format!("(next-to {a} {b})"), format!("(next-to {b} {a})")];
    open(s).flat_map(|n| stands::neighbours(s, n)).flat_map(both).collect()
}

fn before(s: &Situation) -> Vec<String> {
    let all: Vec<&Novelty> = open(s).collect();
    let pairs =
        all.iter().enumerate().flat_map(|(k, one)| all[k + 1..].iter().map(move |other| (one, other)));
    pairs.map(|(one, other)| format!("(before {} {})", one.symbol, other.symbol)).collect()
}

fn unfaced(s: &Situation) -> Vec<String> {
    s.news().novelties.iter().map(|n| format!("(= (unfaced {}) {:.5})", n.symbol, n.unfaced(s))).collect()
}

fn settled(s: &Situation) -> Vec<String> {
    let done = s.news().novelties.iter().filter(|n| n.fate != Fate::Open);
    done.map(|n| format!("(settled {})", n.symbol)).collect()
}
