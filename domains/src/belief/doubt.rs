//! Remaining uncertainty, as hypotheses that a view could settle.
//!
//! A thing may stand where nothing has been seen yet, or be one of the objects that were seen from too
//! few sides. Each such possibility is a [`Hypothesis`], weighted by its probability; a view settles
//! those that it shows.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use descry_memory::belief::{MISLAID_M, Track};
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::recognise::ObjectModel;

use crate::belief::adrift;
use crate::belief::hidden::Hidden;
use crate::belief::hypothesis::{Basis, Hypothesis};
use crate::belief::unnoticed::across;
use crate::known::Thing;
use crate::situation::{Situation, cells};
use crate::surface::KnownSurface;

/// Number of sectors around an object by which views of it are distinguished.
const SECTORS: usize = 8;
/// Probability below which an object is no longer a candidate for a thing.
const NEGLIGIBLE: f64 = 0.02;
/// Size of an object without any model, height and diameter: a small cup, metres.
const SMALL_M: (f64, f64) = (0.10, 0.07);

/// Doubt about a thing or a surface: weighted hypotheses.
#[derive(Debug)]
pub struct Doubt {
    /// Possibilities with their probabilities as weights.
    pub hypotheses: Vec<Hypothesis>,
    /// Probability that the thing, or any object, is in unseen space.
    pub hidden: f64,
    /// True if some surface is unknown, so that any view may settle anything.
    pub anywhere: bool,
    /// Hypotheses by surface.
    parts: BTreeMap<usize, Part>,
    /// Cache of the shares that a view settles once an obstacle is moved, by obstacle, candidate and
    /// surface.
    told_without: Mutex<BTreeMap<[usize; 3], Arc<[f64]>>>,
    /// Cache of the weight that all views can settle, by moved obstacle: entry 0 for none, entry `n + 1`
    /// for obstacle `n`.
    within_reach: Vec<OnceLock<Reach>>,
}

/// Hypotheses on one surface.
#[derive(Debug, Default)]
struct Part {
    /// Places where the thing may stand on the surface, and those among them where it may stand unseen;
    /// `None` outside the requested surfaces.
    hidden: Option<Arc<Hidden>>,
    /// Indices of the hypotheses of hidden places, in [`Doubt::hypotheses`].
    places: Range<usize>,
    /// Indices of the other hypotheses on the surface, about seen objects.
    objects: Vec<usize>,
    /// Cache of the settled shares of all hypotheses on the surface, by index of the viewpoint among
    /// those that see the surface.
    told: OnceLock<Vec<OnceLock<Arc<[f64]>>>>,
}

impl Part {
    /// Indices of the surface's hypotheses, in order.
    fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.places.clone().chain(self.objects.iter().copied())
    }
}

/// Actions of a plan before a view.
#[derive(Debug, Clone, Copy, Default)]
pub struct Taken<'a> {
    /// Views taken: candidate index and surface index of each.
    pub looks: &'a [(usize, usize)],
    /// Index of the obstacle that is pushed aside, if any.
    pub moved: Option<usize>,
}

/// Probability mass that views can still settle.
#[derive(Debug, Clone, Copy, Default)]
struct Reach {
    weight: f64,
    /// Weight settled if each hypothesis is viewed from the viewpoint that shows most of it.
    as_told: f64,
}

impl Doubt {
    /// Doubt about a thing: hidden places, and objects that may be the thing.
    pub(crate) fn about(situation: &Situation, what: usize) -> Self {
        let thing = &situation.things[what];
        let p = |track: &Track| thing.probability(track, &situation.surfaces);
        let best = situation.belief.tracks.iter().map(p).fold(0.0, f64::max);
        let mut doubt = Self::hidden(situation, thing, &situation.expected[what]);
        doubt.scale_hidden(1.0 - best);
        for track in &situation.belief.tracks {
            let p = thing.probability(track, &situation.surfaces);
            if p > NEGLIGIBLE {
                doubt.suppose(unseen_sides(situation, track, p));
                doubt.suppose(adrift::ends_of(situation, track, p));
            }
        }
        doubt
    }

    /// Doubt about a thing on one surface.
    pub(crate) fn about_on(situation: &Situation, what: usize, on: usize) -> Self {
        let thing = Thing { on: Some(vec![on]), ..situation.things[what].clone() };
        let mut doubt = Self::hidden(situation, &thing, &situation.expected[what]);
        doubt.scale_hidden(1.0 - situation.presence(what, on));
        for track in situation.on_surface(on) {
            let p = thing.probability(track, &situation.surfaces);
            if p > NEGLIGIBLE {
                doubt.suppose(unseen_sides(situation, track, p));
            }
        }
        doubt
    }

    /// Doubt about the members of a kind: hidden places for more, and objects that may belong to
    /// it.
    pub(crate) fn of(situation: &Situation, of: usize) -> Self {
        let kind = &situation.kinds[of];
        let mut doubt = Self::hidden(situation, kind, &situation.expected[situation.things.len() + of]);
        for track in &situation.belief.tracks {
            let p = kind.probability(track, &situation.surfaces);
            doubt.suppose(unseen_sides(situation, track, p.min(1.0 - p)));
        }
        doubt
    }

    /// Doubt about a surface: hidden objects, and identities of the seen ones.
    pub(crate) fn on(situation: &Situation, on: usize) -> Self {
        let mut doubt = Self::hidden_on(situation, &[(on, 1.0)], SMALL_M);
        for track in situation.on_surface(on) {
            doubt.suppose(unseen_sides(situation, track, 1.0 - track.certainty()));
        }
        doubt
    }

    /// Hypotheses of hidden places of a thing on the requested surfaces.
    fn hidden(situation: &Situation, thing: &Thing, expected: &[f64]) -> Self {
        // Of a kind the smallest may be where the largest has no room.
        let sizes = thing.models.iter().map(size_m);
        let size = sizes.min_by(|a, b| volume_m3(a).total_cmp(&volume_m3(b))).unwrap_or(SMALL_M);
        let surfaces = (0..situation.surfaces.len()).filter(|&on| thing.may_be_on(on));
        let weighted: Vec<(usize, f64)> = surfaces.map(|on| (on, expected[on])).collect();
        let mut doubt = Self::hidden_on(situation, &weighted, size);
        doubt.expect_again(situation, thing);
        doubt
    }

    /// Shifts weight to unseen places around the old place of each touched object, by the probability
    /// that the touched object was the thing. An object lost out of the hand lies where no view of a
    /// surface shows it.
    fn expect_again(&mut self, situation: &Situation, thing: &Thing) {
        for track in &situation.belief.mislaid {
            let p = thing.probability(track, &situation.surfaces);
            let is_near = |h: &Hypothesis| {
                situation.surfaces[h.on].symbol == track.on
                    && (h.centre - track.position_m).norm() < MISLAID_M
            };
            let near: f64 = self.hypotheses.iter().filter(|h| is_near(h)).map(|h| h.weight).sum();
            let is_lost = track.on.is_empty();
            if p <= NEGLIGIBLE || (near <= 0.0 && !is_lost) {
                continue;
            }
            for h in &mut self.hypotheses {
                let share = if is_near(h) { h.weight / near } else { 0.0 };
                h.weight = p * share + (1.0 - p) * h.weight;
            }
            self.hidden = p + (1.0 - p) * self.hidden;
        }
    }

    /// Share of the doubt, 0 to 1, that a view (candidate, surface) would settle beyond the earlier
    /// steps of the plan. Doubt that no view can settle is left out of account; zero if what views can
    /// settle is negligible.
    pub fn share_settled(&self, situation: &Situation, look: (usize, usize), before: Taken<'_>) -> f64 {
        if self.anywhere {
            return if before.looks.is_empty() { 1.0 } else { 0.0 };
        }
        let total = self.within_reach(situation, before.moved);
        if !self.is_worth_it(situation, total.weight, before.moved) {
            return 0.0;
        }
        let Some(part) = self.parts.get(&look.1) else { return 0.0 };
        let told = |look: (usize, usize)| self.told(situation, look, before.moved);
        let earlier: Vec<Arc<[f64]>> =
            before.looks.iter().filter(|earlier| earlier.1 == look.1).map(|&look| told(look)).collect();
        let now = told(look);
        let fresh = |i: usize| (now[i] - earlier.iter().map(|e| e[i]).fold(0.0, f64::max)).max(0.0);
        let settled: f64 = part.all().enumerate().map(|(i, n)| self.hypotheses[n].weight * fresh(i)).sum();
        settled / total.as_told
    }

    /// Probability mass that a view would settle beyond the earlier views of the plan, as far as any
    /// possible view can settle it.
    pub fn settled(&self, situation: &Situation, look: (usize, usize), before: Taken<'_>) -> f64 {
        let all = if self.anywhere { 1.0 } else { self.within_reach(situation, before.moved).weight };
        self.share_settled(situation, look, before) * all.min(1.0)
    }

    /// Total weight of the hypotheses that at least one reachable view could settle, once the obstacle
    /// `moved` is out of the way. Views already taken count only if an obstacle is moved.
    fn within_reach(&self, situation: &Situation, moved: Option<usize>) -> Reach {
        *self.within_reach[moved.map_or(0, |o| o + 1)].get_or_init(|| {
            let open = |look: &(usize, usize)| moved.is_some() || !situation.observed.contains(look);
            let mut best = vec![0.0_f64; self.hypotheses.len()];
            for (&on, part) in &self.parts {
                for told in self.looks_at(situation, on, &open, moved) {
                    part.all().zip(&*told).for_each(|(n, told)| best[n] = best[n].max(*told));
                }
            }
            let mut reach = Reach::default();
            for (hypothesis, best) in self.hypotheses.iter().zip(best) {
                reach.as_told += hypothesis.weight * best;
                reach.weight += if best > 0.0 { hypothesis.weight } else { 0.0 };
            }
            reach
        })
    }

    /// True if views alone, without moving an obstacle, can settle enough doubt to be worthwhile.
    pub fn can_be_settled(&self, situation: &Situation) -> bool {
        self.anywhere || self.is_worth_it(situation, self.within_reach(situation, None).weight, None)
    }

    /// True if views that settle this weight are worthwhile: by themselves, or because they would allow
    /// the claim that nothing is hidden.
    fn is_worth_it(&self, situation: &Situation, weight: f64, moved: Option<usize>) -> bool {
        let t = &situation.thresholds;
        let most = t.remaining + t.out_of_sight;
        weight >= negligible(situation, moved) || (self.hidden > most && self.hidden - weight <= most)
    }

    /// True if moving an obstacle would let views settle enough doubt that no view can settle now.
    pub(crate) fn can_be_settled_without(&self, situation: &Situation, what: usize) -> bool {
        let [before, after] = [None, Some(what)].map(|moved| self.shown(situation, moved));
        let only_after = |n: &usize| after[*n] && !before[*n];
        let uncovered: f64 =
            (0..self.hypotheses.len()).filter(only_after).map(|n| self.hypotheses[n].weight).sum();
        uncovered >= negligible(situation, Some(what))
    }

    /// Maximum weight that one reachable, unused view of a surface would settle.
    pub fn most_settled_on(&self, situation: &Situation, on: usize) -> f64 {
        if self.anywhere {
            return self.hidden;
        }
        let Some(part) = self.parts.get(&on) else { return 0.0 };
        let open = |look: &(usize, usize)| !situation.observed.contains(look);
        let settled = |told: Arc<[f64]>| {
            part.all().zip(&*told).map(|(n, told)| self.hypotheses[n].weight * told).sum::<f64>()
        };
        self.looks_at(situation, on, &open, None).map(settled).fold(0.0, f64::max)
    }

    /// Probability mass that views of a surface from several viewpoints settle together.
    pub(crate) fn settled_by(&self, situation: &Situation, from: &[usize], on: usize) -> f64 {
        let Some(part) = self.parts.get(&on) else { return 0.0 };
        let told: Vec<Arc<[f64]>> = from.iter().map(|&from| self.told(situation, (from, on), None)).collect();
        let best = |i: usize| told.iter().map(|told| told[i]).fold(0.0, f64::max);
        part.all().enumerate().map(|(i, n)| self.hypotheses[n].weight * best(i)).sum()
    }

    /// Share of places on a surface where the thing cannot stand unseen, 0 to 1; `None` outside the
    /// requested surfaces or for an unknown surface.
    pub fn share_seen(&self, on: usize) -> Option<f64> {
        let part = self.parts.get(&on)?;
        let places = part.hidden.as_ref()?.all;
        Some(1.0 - part.places.len() as f64 / places.max(1) as f64)
    }

    /// Probability that the thing is hidden on a surface, and the part of that probability at places
    /// with unexplained measurements.
    pub fn hidden_share(&self, on: usize) -> (f64, f64) {
        let places = self.parts.get(&on).map(|part| part.places.clone()).unwrap_or_default();
        let places = &self.hypotheses[places];
        let measured = places.iter().filter(|h| h.ground == Basis::Measured);
        (places.iter().map(|h| h.weight).sum(), measured.map(|h| h.weight).sum())
    }

    /// Probability mass that is still unsettled.
    pub fn remaining(&self) -> f64 {
        let all: f64 = self.hypotheses.iter().map(|h| h.weight).sum();
        if self.anywhere { self.hidden } else { all.min(1.0) }
    }

    /// Probability of hidden places that no view can show, and the centres of these places.
    pub fn out_of_sight(&self, situation: &Situation) -> (f64, Vec<Point3<f64>>) {
        let shown = self.shown(situation, None);
        let hidden = self.hypotheses.iter().zip(shown).filter(|(h, _)| h.facing.is_none());
        let unseeable: Vec<&Hypothesis> = hidden.filter(|(_, shown)| !shown).map(|(h, _)| h).collect();
        (unseeable.iter().map(|h| h.weight).sum(), unseeable.iter().map(|h| h.centre).collect())
    }

    /// For each hypothesis, true if a reachable view settles any of it.
    fn shown(&self, situation: &Situation, moved: Option<usize>) -> Vec<bool> {
        let mut shown = vec![false; self.hypotheses.len()];
        for (&on, part) in &self.parts {
            for told in self.looks_at(situation, on, &|_| true, moved) {
                part.all().zip(&*told).for_each(|(n, told)| shown[n] |= *told > 0.0);
            }
        }
        shown
    }

    /// Settled share of each hypothesis on a surface, for every reachable view accepted by `open`.
    fn looks_at<'d>(
        &'d self,
        situation: &'d Situation,
        on: usize,
        open: &'d impl Fn(&(usize, usize)) -> bool,
        moved: Option<usize>,
    ) -> impl Iterator<Item = Arc<[f64]>> + 'd {
        let looks = situation.viewers(on).iter().map(move |&from| (from, on));
        looks
            .filter(move |look| open(look) && situation.can_reach(look.0))
            .map(move |look| self.told(situation, look, moved))
    }

    /// Share of each hypothesis of a surface that a view (candidate, surface) settles, in
    /// hypothesis order; zero if the view does not see the surface.
    fn told(&self, situation: &Situation, (from, on): (usize, usize), moved: Option<usize>) -> Arc<[f64]> {
        let Some(part) = self.parts.get(&on) else { return Arc::default() };
        let Ok(viewer) = situation.viewers(on).binary_search(&from) else {
            return part.all().map(|_| 0.0).collect();
        };
        if let Some(obstacle) = moved {
            return self.told_without(situation, part, (from, on), obstacle);
        }
        let told = part.told.get_or_init(|| situation.viewers(on).iter().map(|_| OnceLock::new()).collect());
        let told = told[viewer].get_or_init(|| {
            let hidden = part.hidden.as_ref().map(|hidden| hidden.told(situation, viewer, on));
            let settled = |&n: &usize| situation.would_settle(from, on, &self.hypotheses[n], None);
            match hidden {
                Some(hidden) if part.objects.is_empty() => Arc::clone(hidden),
                _ => {
                    let hidden = hidden.into_iter().flat_map(|hidden| hidden.iter().copied());
                    hidden.chain(part.objects.iter().map(settled)).collect()
                }
            }
        });
        Arc::clone(told)
    }

    /// Settled share of each hypothesis once an obstacle is moved.
    fn told_without(
        &self,
        situation: &Situation,
        part: &Part,
        (from, on): (usize, usize),
        obstacle: usize,
    ) -> Arc<[f64]> {
        let kept = || self.told_without.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(told) = kept().get(&[obstacle, from, on]) {
            return Arc::clone(told);
        }
        let moved = &situation.obstacles()[obstacle];
        let settled = |n: usize| situation.would_settle(from, on, &self.hypotheses[n], Some(moved));
        let told: Arc<[f64]> = part.all().map(settled).collect();
        kept().insert([obstacle, from, on], Arc::clone(&told));
        told
    }

    /// Doubt about a hidden body (height and diameter `size_m`) on some surfaces, each given with a
    /// prior factor that does not depend on its area. All places of one surface are equally likely.
    fn hidden_on(situation: &Situation, surfaces: &[(usize, f64)], size_m: (f64, f64)) -> Self {
        let mut all = 0.0;
        let mut anywhere = false;
        let mut hypotheses: Vec<Hypothesis> = Vec::new();
        let mut parts: BTreeMap<usize, Part> = BTreeMap::new();
        for &(on, expected) in surfaces {
            let hidden = Hidden::on(situation, on, size_m);
            anywhere |= hidden.all == 0 && situation.surfaces[on].outline.is_empty();
            if hidden.all == 0 {
                continue;
            }
            all += expected;
            let each = expected / hidden.all as f64;
            let first = hypotheses.len();
            let weighted = |h: &Hypothesis| Hypothesis { weight: each * h.weight, ..h.clone() };
            hypotheses.extend(hidden.hypotheses.iter().map(weighted));
            let places = first..hypotheses.len();
            parts.insert(on, Part { hidden: Some(hidden), places, ..Part::default() });
        }
        let unseen: f64 = hypotheses.iter().map(|h| h.weight).sum();
        let open = if anywhere || all == 0.0 { 1.0 } else { unseen / all };
        let prior = situation.thresholds.prior;
        let hidden = prior * open / (prior * open + 1.0 - prior);
        hypotheses.iter_mut().for_each(|h| h.weight *= hidden / unseen);
        let moves = 1 + situation.belief.tracks.len();
        Self {
            hypotheses,
            hidden,
            anywhere,
            parts,
            told_without: Mutex::default(),
            within_reach: (0..moves).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Adds hypotheses about seen objects.
    fn suppose(&mut self, more: Vec<Hypothesis>) {
        for hypothesis in more {
            self.parts.entry(hypothesis.on).or_default().objects.push(self.hypotheses.len());
            self.hypotheses.push(hypothesis);
        }
    }

    fn scale_hidden(&mut self, factor: f64) {
        self.hidden *= factor;
        self.hypotheses.iter_mut().for_each(|h| h.weight *= factor);
    }
}

/// Probability below which doubt is not worth a view; lower for doubt that only moving an obstacle can
/// settle.
fn negligible(situation: &Situation, moved: Option<usize>) -> f64 {
    if moved.is_some() { situation.thresholds.out_of_sight } else { situation.thresholds.remaining }
}

/// Product of height and squared diameter, by which cylinders are ordered by volume, cubic metres.
fn volume_m3((height_m, diameter_m): &(f64, f64)) -> f64 {
    height_m * diameter_m * diameter_m
}

/// Height and diameter of a model, metres.
fn size_m(model: &ObjectModel) -> (f64, f64) {
    let across = model.diameter_m.or(model.depth_m).map_or(SMALL_M.1, |d| d.middle());
    (model.height_m.middle(), across)
}

/// Unseen sides of an object as hypotheses, each with an equal share of `weight`.
fn unseen_sides(situation: &Situation, track: &Track, weight: f64) -> Vec<Hypothesis> {
    let Some(on) = situation.surface_of(track) else { return Vec::new() };
    let centre = middle(&situation.surfaces[on], track);
    let radius = track.size_m[0].max(track.size_m[1]) / 2.0;
    let open = open_sides(&situation.surfaces[on], track);
    let each = weight / open.len().max(1) as f64;
    let hypothesis = |side: &Vector3<f64>| Hypothesis {
        weight: each,
        on,
        centre,
        points: vec![centre + side * (radius + 0.02)],
        facing: Some(*side),
        ground: Basis::Object,
    };
    open.iter().map(hypothesis).collect()
}

/// Centre of the body of an object on a surface, map frame.
fn middle(surface: &KnownSurface, track: &Track) -> Point3<f64> {
    track.position_m + surface.up * (track.size_m[2] / 2.0)
}

/// Unseen sides of an object, as unit vectors pointing outwards.
fn open_sides(surface: &KnownSurface, track: &Track) -> Vec<Vector3<f64>> {
    let (e1, e2) = across(surface);
    let centre = middle(surface, track);
    let sides = (0..SECTORS).map(|k| {
        let angle = std::f64::consts::TAU * k as f64 / SECTORS as f64;
        e1 * angle.cos() + e2 * angle.sin()
    });
    let seen_from = |side: &Vector3<f64>| {
        track
            .viewpoints_m
            .iter()
            .any(|eye| (eye - centre).normalize().dot(side) > std::f64::consts::FRAC_1_SQRT_2)
    };
    sides.filter(|side| !seen_from(side)).collect()
}

/// True if an object was seen from all sides, so that further views add nothing about its identity.
pub(crate) fn is_seen_around(situation: &Situation, track: &Track) -> bool {
    situation.surface_of(track).is_some_and(|on| open_sides(&situation.surfaces[on], track).is_empty())
}

/// Cache of a situation's doubts, computed on demand.
struct Doubts {
    about: Vec<OnceLock<Doubt>>,
    on: Vec<OnceLock<Doubt>>,
    of: Vec<OnceLock<Doubt>>,
    about_on: Vec<OnceLock<Doubt>>,
}

impl Situation {
    fn doubts_kept(&self) -> &Doubts {
        let (things, surfaces) = (self.things.len(), self.surfaces.len());
        self.derived.get(&|| Doubts {
            about: cells(things),
            on: cells(surfaces),
            of: cells(self.kinds.len()),
            about_on: cells(things * surfaces),
        })
    }

    /// All doubts relevant to the goal: things, kinds and surfaces; all surfaces if nothing is
    /// requested.
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

    /// Doubt about a thing.
    pub fn doubt_about(&self, what: usize) -> &Doubt {
        self.doubts_kept().about[what].get_or_init(|| Doubt::about(self, what))
    }

    /// Doubt about a thing on one surface.
    pub fn doubt_about_on(&self, what: usize, on: usize) -> &Doubt {
        self.doubts_kept().about_on[what * self.surfaces.len() + on]
            .get_or_init(|| Doubt::about_on(self, what, on))
    }

    /// Doubt about the members of a kind.
    pub fn doubt_of(&self, of: usize) -> &Doubt {
        self.doubts_kept().of[of].get_or_init(|| Doubt::of(self, of))
    }

    /// Doubt about a surface.
    pub fn doubt_on(&self, on: usize) -> &Doubt {
        self.doubts_kept().on[on].get_or_init(|| Doubt::on(self, on))
    }

    /// True if a view of a surface from a candidate may settle a relevant doubt, after the obstacle
    /// `moved` has been moved.
    pub fn worth_a_look(&self, from: usize, on: usize, moved: Option<usize>) -> bool {
        let taken = Taken { looks: &[], moved };
        self.doubts().iter().any(|doubt| doubt.share_settled(self, (from, on), taken) > 0.0)
    }

    /// True if views would settle enough further doubt once an obstacle is moved.
    pub(crate) fn would_uncover(&self, what: usize) -> bool {
        self.doubts().iter().any(|doubt| doubt.can_be_settled_without(self, what))
    }
}
