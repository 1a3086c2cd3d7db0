//! Confidence in the places of things, the completeness of kinds, and the objects on surfaces.

use descry_memory::belief::Track;

use crate::belief::{adrift, doubt};
use crate::situation::Situation;

impl Situation {
    /// Confidence in the place of a thing, 0 to 1: probability of its likeliest object at the
    /// requested places, times the probability that this object is not displaced.
    pub fn confidence(&self, what: usize) -> f64 {
        let thing = &self.things[what];
        let there = |t| match thing.probability(t, &self.surfaces) {
            0.0 => 0.0,
            p => p * (1.0 - adrift::chance_off(self, t)) * self.trust(t),
        };
        self.belief.tracks.iter().map(there).fold(0.0, f64::max)
    }

    /// Object that a thing most probably is, if its probability exceeds one half.
    pub(crate) fn best(&self, what: usize) -> Option<&Track> {
        let p = |t: &Track| self.things[what].probability(t, &self.surfaces);
        let best = self.belief.tracks.iter().max_by(|a, b| p(a).total_cmp(&p(b)));
        best.filter(|t| p(t) > 0.5)
    }

    /// Confidence in the position of a thing along its surface, 0 to 1; 1 if no object is believed
    /// to be the thing.
    pub fn placed(&self, what: usize) -> f64 {
        self.best(what).map_or(1.0, |track| 1.0 - adrift::chance_off(self, track))
    }

    /// Probability that a thing stands on a surface, 0 to 1.
    pub fn presence(&self, what: usize, on: usize) -> f64 {
        let thing = &self.things[what];
        self.on_surface(on).map(|track| thing.is(track) * self.trust(track)).fold(0.0, f64::max)
    }

    /// Probability that camera and poses of the views by which an object is known have no fault.
    fn trust(&self, track: &Track) -> f64 {
        self.surface_of(track).map_or(1.0, |on| 1.0 - self.surfaces[on].sensor_doubt)
    }

    /// Probability that a thing was lost out of the hand and lies where no view of a surface shows it.
    pub fn chance_lost(&self, what: usize) -> f64 {
        let lost = self.belief.mislaid.iter().filter(|t| t.on.is_empty());
        lost.map(|t| self.things[what].probability(t, &self.surfaces)).fold(0.0, f64::max)
    }

    /// Probability that a thing is at the requested places, as a seen object or hidden.
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
        sure * (1.0 - self.doubt_on(on).hidden) * (1.0 - self.surfaces[on].sensor_doubt)
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

    /// Maximum completeness reachable by views; objects seen from all sides gain nothing from further
    /// views.
    pub fn most_complete(&self, of: usize) -> f64 {
        let sure = |p: f64| p.max(1.0 - p);
        let told = self.belief.tracks.iter().filter(|track| doubt::is_seen_around(self, track));
        told.map(|track| sure(self.kinds[of].probability(track, &self.surfaces))).product()
    }

    /// True if views can still raise the completeness of a kind to the required confidence.
    pub fn can_be_complete(&self, of: usize) -> bool {
        self.most_complete(of) >= self.wanted_of(of)
    }

    /// True if a seen object is believed to be of a kind at the requested places.
    pub fn has_member(&self, of: usize) -> bool {
        self.belief.tracks.iter().any(|t| self.kinds[of].probability(t, &self.surfaces) > 0.5)
    }

    /// Confidence required to claim that all of a kind are found; if none was found, at least the
    /// certainty that *not there* requires.
    pub fn wanted_of(&self, of: usize) -> f64 {
        let is_empty = self.completeness(of) >= self.threshold && !self.has_member(of);
        if is_empty { self.threshold.max(1.0 - self.thresholds.not_there) } else { self.threshold }
    }

    /// Probability that a thing is on a surface, as a seen object or hidden.
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
}
