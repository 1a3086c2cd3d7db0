//! Random conditions: what they say in PDDL, and whether they are true by what is where, judged in three values over the places that
//! were looked at.

use std::collections::BTreeSet;

/// Draws numbers (splitmix64).
pub struct Draws(pub u64);

impl Draws {
    pub fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }

    pub fn of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }
}

/// Meaning of a word pattern by what is where. `{t}` and `{u}` stand for two things, `{k}` for the kind of the first, `{p}` and `{q}`
/// for two places, `{d}` for a door.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Means {
    On,
    NotOn,
    Somewhere,
    Nowhere,
    /// Something, whatever it is.
    AnythingOn,
    NothingOn,
    /// One of the kind.
    KindOn,
    EachOfKindOn,
    /// At least two, whatever they are.
    TwoOn,
    TwoOfKindOn,
    BothOn,
    NeitherOn,
    BothSomewhere,
    NeitherSomewhere,
    /// On the first place, and not on the second.
    RatherOn,
    Held,
    HandFree,
    Shut,
}

/// A pattern, with its meaning.
pub type Pattern = (Means, &'static str);

/// Names that goals may use.
pub struct Nouns {
    /// Things and their kinds.
    pub things: Vec<(&'static str, &'static str)>,
    pub places: Vec<&'static str>,
    /// Type of the places, for variables.
    pub of_place: &'static str,
    pub door: &'static str,
}

/// A thing as it stands in truth: name, kind, and place; none in the hand or away.
pub struct Standing {
    pub thing: String,
    pub kind: String,
    pub place: Option<String>,
    pub is_held: bool,
}

/// Truth at the end of a run, and what was looked at.
pub struct Seen {
    pub standing: Vec<Standing>,
    pub shut: Vec<String>,
    /// Names of the places that were looked at, and `anything` where there was any look.
    pub looked: BTreeSet<String>,
}

/// Three-valued truth.
type Known = Option<bool>;

fn any(parts: impl Iterator<Item = Known>) -> Known {
    let parts: Vec<Known> = parts.collect();
    match parts.contains(&Some(true)) {
        true => Some(true),
        false => (!parts.contains(&None)).then_some(false),
    }
}

fn not(of: Known) -> Known {
    of.map(|holds| !holds)
}

impl Seen {
    fn count_on(&self, place: &str, is: impl Fn(&Standing) -> bool) -> Option<usize> {
        let there = self.standing.iter().filter(|s| s.place.as_deref() == Some(place) && is(s)).count();
        self.looked.contains(place).then_some(there)
    }

    fn on(&self, thing: &str, place: &str) -> Known {
        self.count_on(place, |s| s.thing == thing).map(|n| n > 0)
    }

    fn somewhere(&self, thing: &str, nouns: &Nouns) -> Known {
        any(nouns.places.iter().map(|place| self.on(thing, place)))
    }
}

/// A condition.
pub enum Goal {
    /// A pattern with its things, its places (none: the variable) and its door.
    Word {
        means: Means,
        text: String,
        things: [usize; 2],
        places: [Option<usize>; 2],
    },
    Not(Box<Goal>),
    And(Box<[Goal; 2]>),
    Or(Box<[Goal; 2]>),
    Imply(Box<[Goal; 2]>),
    /// For every place, or for some.
    Every(Box<Goal>),
    Some(Box<Goal>),
}

impl Goal {
    /// A condition over patterns; within a quantifier its first place is a variable.
    pub fn drawn(
        draws: &mut Draws,
        nouns: &Nouns,
        patterns: &[Pattern],
        depth: usize,
        is_within: bool,
    ) -> Goal {
        let word = |draws: &mut Draws| {
            let fits = |(_, text): &&Pattern| !is_within || (text.contains("{p}") && !text.contains("{q}"));
            let fitting: Vec<&Pattern> = patterns.iter().filter(fits).collect();
            let (means, pattern) = draws.of(&fitting);
            let things = [draws.below(nouns.things.len()), draws.below(nouns.things.len())];
            let one = draws.below(nouns.places.len());
            let other = (one + 1) % nouns.places.len();
            let places = [(!is_within).then_some(one), Some(other)];
            let place = |of: Option<usize>| of.map_or("?s", |n| nouns.places[n]);
            let text = pattern
                .replace("{t}", nouns.things[things[0]].0)
                .replace("{u}", nouns.things[things[1]].0)
                .replace("{k}", nouns.things[things[0]].1)
                .replace("{p}", place(places[0]))
                .replace("{q}", place(places[1]))
                .replace("{d}", nouns.door);
            Goal::Word { means: *means, text, things, places }
        };
        let inner = |draws: &mut Draws, is_within: bool| {
            Box::new(Goal::drawn(draws, nouns, patterns, depth - 1, is_within))
        };
        let two = |draws: &mut Draws| {
            let mut one = || Goal::drawn(draws, nouns, patterns, depth - 1, is_within);
            Box::new([one(), one()])
        };
        let is_placed = patterns.iter().any(|(_, text)| text.contains("{p}"));
        match draws.below(if depth == 0 { 4 } else { 11 }) {
            0..=3 => word(draws),
            4 | 5 => Goal::Not(inner(draws, is_within)),
            6 => Goal::And(two(draws)),
            7 => Goal::Or(two(draws)),
            8 => Goal::Imply(two(draws)),
            9 if is_placed && !is_within => Goal::Every(inner(draws, true)),
            10 if is_placed && !is_within => Goal::Some(inner(draws, true)),
            _ => word(draws),
        }
    }

    /// The condition in PDDL.
    pub fn pddl(&self, nouns: &Nouns) -> String {
        let two =
            |word: &str, of: &[Goal; 2]| format!("({word} {} {})", of[0].pddl(nouns), of[1].pddl(nouns));
        match self {
            Goal::Word { text, .. } => text.clone(),
            Goal::Not(of) => format!("(not {})", of.pddl(nouns)),
            Goal::And(of) => two("and", of),
            Goal::Or(of) => two("or", of),
            Goal::Imply(of) => two("imply", of),
            Goal::Every(of) => format!("(forall (?s - {}) {})", nouns.of_place, of.pddl(nouns)),
            Goal::Some(of) => format!("(exists (?s - {}) {})", nouns.of_place, of.pddl(nouns)),
        }
    }

    /// Its truth; none where that hangs on places that were not looked at. `at` is the value of the variable.
    pub fn truth(&self, seen: &Seen, nouns: &Nouns, at: usize) -> Known {
        let both = |of: &[Goal; 2]| of.each_ref().map(|goal| goal.truth(seen, nouns, at));
        match self {
            Goal::Word { means, things, places, .. } => {
                let things = things.map(|n| nouns.things[n]);
                let places = places.map(|n| nouns.places[n.unwrap_or(at)]);
                meant(*means, things, places, seen, nouns)
            }
            Goal::Not(of) => not(of.truth(seen, nouns, at)),
            Goal::And(of) => not(any(both(of).into_iter().map(not))),
            Goal::Or(of) => any(both(of).into_iter()),
            Goal::Imply(of) => {
                let [one, other] = both(of);
                any([not(one), other].into_iter())
            }
            Goal::Every(of) => not(any((0..nouns.places.len()).map(|at| not(of.truth(seen, nouns, at))))),
            Goal::Some(of) => any((0..nouns.places.len()).map(|at| of.truth(seen, nouns, at))),
        }
    }
}

fn meant(
    means: Means,
    [(t, kind), (u, _)]: [(&str, &str); 2],
    [p, q]: [&str; 2],
    seen: &Seen,
    nouns: &Nouns,
) -> Known {
    let of_kind = |s: &Standing| s.kind == kind;
    let both = |one: Known, other: Known| not(any([not(one), not(other)].into_iter()));
    match means {
        Means::On => seen.on(t, p),
        Means::NotOn => not(seen.on(t, p)),
        Means::Somewhere => seen.somewhere(t, nouns),
        Means::Nowhere => not(seen.somewhere(t, nouns)),
        Means::AnythingOn => seen.count_on(p, |_| true).map(|n| n > 0),
        Means::NothingOn => seen.count_on(p, |_| true).map(|n| n == 0),
        Means::KindOn => seen.count_on(p, of_kind).map(|n| n > 0),
        Means::EachOfKindOn => not(any(nouns
            .places
            .iter()
            .filter(|place| **place != p)
            .map(|place| seen.count_on(place, of_kind).map(|n| n > 0)))),
        Means::TwoOn => seen.count_on(p, |_| true).map(|n| n > 1),
        Means::TwoOfKindOn => seen.count_on(p, of_kind).map(|n| n > 1),
        Means::BothOn => both(seen.on(t, p), seen.on(u, p)),
        Means::NeitherOn => not(any([seen.on(t, p), seen.on(u, p)].into_iter())),
        Means::BothSomewhere => both(seen.somewhere(t, nouns), seen.somewhere(u, nouns)),
        Means::NeitherSomewhere => not(any([seen.somewhere(t, nouns), seen.somewhere(u, nouns)].into_iter())),
        Means::RatherOn => both(seen.on(t, p), not(seen.on(t, q))),
        Means::Held => Some(seen.standing.iter().any(|s| s.is_held && s.thing == t)),
        Means::HandFree => Some(seen.standing.iter().all(|s| !s.is_held)),
        Means::Shut => {
            seen.looked.contains(nouns.door).then(|| seen.shut.iter().any(|door| door == nouns.door))
        }
    }
}
