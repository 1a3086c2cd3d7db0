//! Confidence in the places of things, in the completeness of kinds, and in what stands on surfaces.

use descry_memory::belief::Track;

use crate::belief::{adrift, doubt};
use crate::known::Thing;
use crate::situation::Situation;

impl Situation {
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

    /// Probability that a thing is on a surface: as one of the objects that were seen, or hidden.
    pub(crate) fn chance_on(&self, what: usize, on: usize) -> f64 {
        let name = &self.things[what].name;
        let none_is = self.on_surface(on).map(|t| 1.0 - t.probability_of(name)).product::<f64>();
        (1.0 - none_is + self.doubt_about_on(what, on).hidden).min(1.0)
    }

    /// True if the objects on a surface are known with the requested confidence.
    pub(crate) fn is_clear(&self, on: usize) -> bool {
        self.is_looked_at(on) && self.clarity(on) >= self.threshold
    }

    /// True if a view of a surface was taken in this run.
    pub(crate) fn is_looked_at(&self, on: usize) -> bool {
        !self.spaces[on].seen_from().is_empty()
    }

    /// Objects that were seen and are none of the things of the problem.
    pub(crate) fn strangers(&self) -> impl Iterator<Item = &Track> {
        let is_thing = |track: &Track| {
            let is_it = |thing: &Thing| match thing.track {
                Some(id) => id == track.id,
                None => track.probability_of(&thing.name) >= self.threshold,
            };
            self.things.iter().any(is_it)
        };
        self.belief.tracks.iter().filter(move |track| !is_thing(track))
    }
}
