//! Merging of what a run leaves for later runs with what other runs have written into the same store since
//! the run began.

use std::collections::BTreeMap;

use descry_perception::laser::KnownShape;
use serde_json::Value;

use super::{MOST_GONE, Recollection, Remembered, SAME_M};
use crate::learned::{LearnedThing, Visited};

/// Author of a change to a part of the store since a run began.
enum Changed {
    /// Nobody, or the run alone.
    Here,
    /// Other runs alone.
    Elsewhere,
    /// Both the run and others.
    Both,
}

fn changed<T: PartialEq>(before: &T, others: &T, after: &T) -> Changed {
    match (others == before, after == before) {
        (true, _) => Changed::Here,
        (false, true) => Changed::Elsewhere,
        (false, false) => Changed::Both,
    }
}

impl Remembered {
    /// Merges this content of a store with that of a run, which began with `before` at `began_unix_s` and
    /// ends with `after`. What other runs wrote meanwhile, and given names, stay; the run adds what it
    /// learned and saw. Each surface is kept as last viewed. If the run and others built a map meanwhile, the
    /// map from more views stays, with the objects seen on it.
    pub fn joined(&self, before: &Self, mut after: Self, began_unix_s: f64) -> Self {
        self.give_names(&mut after);
        let looks = |of: &Self| of.surveyed.as_ref().map_or(0, |map| map.stood.len());
        let with_places = match changed(&before.surveyed, &self.surveyed, &after.surveyed) {
            Changed::Both if looks(&after) > looks(self) => after.clone(),
            Changed::Both => self.clone(),
            Changed::Here => {
                Self { surveyed: after.surveyed.clone(), ..self.places(before, &after, began_unix_s) }
            }
            Changed::Elsewhere => self.places(before, &after, began_unix_s),
        };
        let is_new = |shape: &&KnownShape| ![&before.shapes, &self.shapes].iter().any(|s| s.contains(shape));
        Self {
            shapes: self.shapes.iter().chain(after.shapes.iter().filter(is_new)).cloned().collect(),
            besides: self.besides_of(before, &after),
            visited: self.visits(before, &after),
            things: self.learned(before, &after),
            ..with_places
        }
    }

    /// Merges the data that other abilities keep: from the run for each ability whose data the run has
    /// changed, else from the store.
    fn besides_of(&self, before: &Self, after: &Self) -> BTreeMap<String, Value> {
        let is_new = |(name, kept): &(&String, &Value)| before.besides.get(*name) != Some(*kept);
        let ours = after.besides.iter().filter(is_new).map(|(name, kept)| (name.clone(), kept.clone()));
        self.besides.clone().into_iter().chain(ours).collect()
    }

    /// Renames the objects of a run to their names in the store, and gives objects learned only by the run
    /// unique names.
    fn give_names(&self, after: &mut Self) {
        let here = marked(&self.things);
        let mut names: BTreeMap<String, String> = BTreeMap::new();
        let mut taken: Vec<String> =
            self.things.iter().chain(&after.things).map(|t| t.name.clone()).collect();
        for (mark, thing) in marked(&after.things) {
            let name = match here.get(&mark) {
                Some(same) => same.name.clone(),
                None if self.things.iter().all(|other| other.name != thing.name) => continue,
                None => {
                    (1..).map(|n| format!("thing {n}")).find(|name| !taken.contains(name)).unwrap_or_default()
                }
            };
            taken.push(name.clone());
            names.insert(thing.name.clone(), name);
        }
        after.call(|name| names.get(name).cloned());
    }

    /// Merges the learned objects; of two models of one object, that of the later encounter stays.
    fn learned(&self, before: &Self, after: &Self) -> Vec<LearnedThing> {
        let (earlier, ours) = (marked(&before.things), marked(&after.things));
        let here = marked(&self.things);
        let kept = here.iter().map(|(mark, thing)| match (earlier.get(mark), ours.get(mark)) {
            (Some(earlier), Some(our)) => {
                let earlier = LearnedThing { name: thing.name.clone(), ..LearnedThing::clone(earlier) };
                match changed(&&earlier, thing, our) {
                    Changed::Here => LearnedThing::clone(our),
                    Changed::Both if our.seen.unix_s > thing.seen.unix_s => LearnedThing::clone(our),
                    Changed::Both | Changed::Elsewhere => LearnedThing::clone(thing),
                }
            }
            _ => LearnedThing::clone(thing),
        });
        let mut all: BTreeMap<_, _> = here.keys().copied().zip(kept).collect();
        for (mark, our) in &ours {
            all.entry(*mark).or_insert_with(|| LearnedThing::clone(our));
        }
        // In the order in which they were kept: those of the store, then those that are new to it.
        let order = marks(&self.things).into_iter().chain(marks(&after.things));
        order.filter_map(|mark| all.remove(&mark)).collect()
    }

    /// Merges the visited places, each as of its last visit.
    fn visits(&self, before: &Self, after: &Self) -> Vec<Visited> {
        let of = |all: &Self, waypoint: &str| all.visited.iter().find(|v| v.waypoint == waypoint).cloned();
        let is_ours = |waypoint: &str| {
            let (theirs, ours) = (of(self, waypoint), of(after, waypoint));
            let last = |visit: &Option<Visited>| visit.as_ref().map_or(0.0, |v| v.last_unix_s);
            match changed(&of(before, waypoint), &theirs, &ours) {
                Changed::Here => true,
                Changed::Both => last(&ours) > last(&theirs),
                Changed::Elsewhere => false,
            }
        };
        let theirs = self.visited.iter().filter(|v| !is_ours(&v.waypoint));
        theirs.chain(after.visited.iter().filter(|v| is_ours(&v.waypoint))).cloned().collect()
    }

    /// Merges the objects, each surface as last viewed, and the vanished objects; everything else is from
    /// `self`.
    fn places(&self, before: &Self, after: &Self, began_unix_s: f64) -> Self {
        let on = |all: &Self, surface: &str| -> Vec<Recollection> {
            all.present.iter().filter(|r| r.track.on == surface).cloned().collect()
        };
        let is_ours = |r: &Recollection| {
            let surface = r.track.on.as_str();
            let theirs = on(self, surface);
            match changed(&on(before, surface), &theirs, &on(after, surface)) {
                Changed::Here => true,
                Changed::Both => theirs.iter().all(|r| r.seen_unix_s <= began_unix_s),
                Changed::Elsewhere => false,
            }
        };
        let theirs = self.present.iter().filter(|r| !is_ours(r));
        let present: Vec<Recollection> =
            theirs.chain(after.present.iter().filter(|r| is_ours(r))).cloned().collect();
        let still = |r: &Recollection| {
            let near = |p: &Recollection| (p.track.position_m - r.track.position_m).norm() < SAME_M;
            present.iter().any(|p| p.track.on == r.track.on && near(p))
        };
        // What one of both has seen meanwhile and the other no more.
        let only_one = [self, after].into_iter().flat_map(|all| &all.present);
        let only_one = only_one.filter(|r| !before.present.contains(r) && !still(r));
        let theirs = self.gone.iter().chain(after.gone.iter().filter(|r| !before.gone.contains(r)));
        let mut gone: Vec<Recollection> = Vec::new();
        for r in theirs.chain(only_one) {
            if !gone.contains(r) {
                gone.push(r.clone());
            }
        }
        gone.drain(..gone.len().saturating_sub(MOST_GONE));
        let mut looked_at = [self.looked_at.as_slice(), &after.looked_at].concat();
        looked_at.sort_unstable();
        looked_at.dedup();
        Self { present, gone, looked_at, ..self.clone() }
    }
}

/// Identity of a learned object, whatever its name: time of learning, and index among those learned at that
/// time.
type Mark = (u64, usize);

fn marks(things: &[LearnedThing]) -> Vec<Mark> {
    let mut of_time: BTreeMap<u64, usize> = BTreeMap::new();
    let mark = |thing: &LearnedThing| {
        let time = thing.learned_unix_s.to_bits();
        let nth = of_time.entry(time).or_default();
        *nth += 1;
        (time, *nth)
    };
    things.iter().map(mark).collect()
}

fn marked(things: &[LearnedThing]) -> BTreeMap<Mark, &LearnedThing> {
    marks(things).into_iter().zip(things).collect()
}
