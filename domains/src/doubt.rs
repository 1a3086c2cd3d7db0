//! What is not yet known, as hypotheses that a look could settle.
//!
//! A thing may stand where nothing has been seen yet, or be one of the objects that were seen from too few sides. Each
//! such possibility is a [`Hypothesis`] with the probability that hangs on it; a look settles those that it shows.

use std::sync::OnceLock;

use descry_memory::belief::Track;
use descry_memory::space::Cell;
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::recognise::ObjectModel;

use crate::situation::{KnownSurface, Situation};

/// Distance between places where a hidden object may stand.
const GRID_M: f64 = 0.05;
/// How far beyond the seen part of a surface it may go on.
const BEYOND_M: f64 = 0.3;
/// Share of an object's volume that must be unseen for it to stand there unnoticed.
const UNSEEN_SHARE: f64 = 0.6;
/// Share of an object's volume that may have been seen free, for noise, if it stands there.
const FREE_SHARE: f64 = 0.15;
/// Sides from which an object is looked at.
const SECTORS: usize = 8;
/// An object that is believed less than this to be the thing is no longer asked about.
const NEGLIGIBLE: f64 = 0.02;
/// Size of an object of which nothing is known: a small cup, height and diameter.
const SMALL_M: (f64, f64) = (0.10, 0.07);

/// A possibility that a look can settle.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// The probability that hangs on it.
    pub weight: f64,
    /// The surface on which it stands.
    pub on: usize,
    /// Where it is.
    pub centre: Point3<f64>,
    /// What must be seen to settle it.
    pub points: Vec<Point3<f64>>,
    /// The side from which it must be seen, as a unit vector away from it; none if any will do.
    pub facing: Option<Vector3<f64>>,
}

/// Everything that is in doubt about a thing or a surface.
#[derive(Debug)]
pub struct Doubt {
    /// The possibilities.
    pub hypotheses: Vec<Hypothesis>,
    /// The probability that it, or anything, is where nothing has been seen.
    pub hidden: f64,
    /// No surface is known yet: every look may settle everything.
    pub anywhere: bool,
    /// Probability below which what is left is not worth a look.
    negligible: f64,
    shown: Vec<OnceLock<Vec<bool>>>,
    within_reach: OnceLock<f64>,
    surfaces: usize,
}

impl Doubt {
    /// What is in doubt about a thing: where it may be hidden, and which objects may be it.
    pub(crate) fn about(situation: &Situation, what: usize) -> Self {
        let thing = &situation.things[what];
        let best = situation.confidence(what);
        let size = thing.models.first().map_or(SMALL_M, size_m);
        let mut doubt = Self::hidden_on(situation, 0..situation.surfaces.len(), size);
        doubt.scale_hidden(1.0 - best);
        for track in &situation.belief.tracks {
            let p = track.probability_of(&thing.name);
            if p > NEGLIGIBLE {
                doubt.hypotheses.extend(unseen_sides(situation, track, p));
            }
        }
        doubt
    }

    /// What is in doubt on a surface: what may be hidden there, and what the objects on it are.
    pub(crate) fn on(situation: &Situation, on: usize) -> Self {
        let mut doubt = Self::hidden_on(situation, on..on + 1, SMALL_M);
        for track in &situation.belief.tracks {
            doubt.hypotheses.extend(unseen_sides(situation, track, 1.0 - track.certainty()));
        }
        doubt
    }

    /// The share of the doubt that a look at `from` would settle beyond what the planned looks settle, 0 to 1. Doubt that
    /// no look can settle does not count; none is worth a look where what can be settled is negligible.
    pub fn share_settled(&self, situation: &Situation, from: usize, planned: &[(usize, usize)]) -> f64 {
        if self.anywhere {
            return if planned.is_empty() { 1.0 } else { 0.0 };
        }
        let total = *self.within_reach.get_or_init(|| self.settled_by_all(situation));
        if total < self.negligible {
            return 0.0;
        }
        let earlier: Vec<&Vec<bool>> = planned.iter().map(|&(p, on)| self.shown(situation, p, on)).collect();
        let settled = |on: usize| -> f64 {
            let now = self.shown(situation, from, on);
            let fresh = |i: &usize| now[*i] && !earlier.iter().any(|e| e[*i]);
            (0..self.hypotheses.len()).filter(fresh).map(|i| self.hypotheses[i].weight).sum()
        };
        (0..self.surfaces).map(settled).sum::<f64>() / total
    }

    /// The probability that hangs on what some look could settle that has not been taken and can be.
    fn settled_by_all(&self, situation: &Situation) -> f64 {
        let open = |&(from, on): &(usize, usize)| {
            !situation.observed.contains(&(from, on)) && situation.can_reach(from) && situation.sees(from, on)
        };
        let looks =
            (0..situation.candidates.len()).flat_map(|from| (0..self.surfaces).map(move |on| (from, on)));
        let looks: Vec<&Vec<bool>> =
            looks.filter(open).map(|(from, on)| self.shown(situation, from, on)).collect();
        let settled = |(n, _): &(usize, &Hypothesis)| looks.iter().any(|shown| shown[*n]);
        self.hypotheses.iter().enumerate().filter(settled).map(|(_, h)| h.weight).sum()
    }

    /// The probability that hangs on all that is in doubt.
    pub fn remaining(&self) -> f64 {
        if self.anywhere { self.hidden } else { self.hypotheses.iter().map(|h| h.weight).sum() }
    }

    /// Which hypotheses a look from a candidate at a surface shows.
    fn shown(&self, situation: &Situation, from: usize, on: usize) -> &Vec<bool> {
        self.shown[from * self.surfaces + on].get_or_init(|| {
            self.hypotheses.iter().map(|h| h.on == on && situation.would_settle(from, on, h)).collect()
        })
    }

    fn hidden_on(situation: &Situation, surfaces: std::ops::Range<usize>, size_m: (f64, f64)) -> Self {
        let mut places = 0;
        let mut hypotheses = Vec::new();
        for on in surfaces {
            let surface = &situation.surfaces[on];
            for centre in grid(surface, size_m.1) {
                places += 1;
                if let Some(points) = unseen_volume(situation, surface, &centre, size_m) {
                    hypotheses.push(Hypothesis { weight: 1.0, on, centre, points, facing: None });
                }
            }
        }
        let open = if places == 0 { 1.0 } else { hypotheses.len() as f64 / places as f64 };
        let prior = situation.thresholds.prior;
        let hidden = prior * open / (prior * open + 1.0 - prior);
        let each = hidden / hypotheses.len().max(1) as f64;
        hypotheses.iter_mut().for_each(|h| h.weight = each);
        let shown =
            (0..situation.candidates.len() * situation.surfaces.len()).map(|_| OnceLock::new()).collect();
        Self {
            hypotheses,
            hidden,
            anywhere: places == 0,
            negligible: situation.thresholds.remaining,
            shown,
            within_reach: OnceLock::new(),
            surfaces: situation.surfaces.len(),
        }
    }

    fn scale_hidden(&mut self, factor: f64) {
        self.hidden *= factor;
        self.hypotheses.iter_mut().for_each(|h| h.weight *= factor);
    }
}

/// Height and diameter of a model, metres.
fn size_m(model: &ObjectModel) -> (f64, f64) {
    let across = model.diameter_m.or(model.depth_m).map_or(SMALL_M.1, |d| d.middle());
    (model.height_m.middle(), across)
}

/// Two unit vectors that span a surface.
fn across(surface: &KnownSurface) -> (Vector3<f64>, Vector3<f64>) {
    let helper = if surface.up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let first = surface.up.cross(&helper).normalize();
    (first, surface.up.cross(&first))
}

/// Places on a surface where the middle of an object can be; beyond the outline too while that is not all of it.
fn grid(surface: &KnownSurface, diameter_m: f64) -> Vec<Point3<f64>> {
    let Some(centre) = surface.centre() else { return Vec::new() };
    let (e1, e2) = across(surface);
    let margin = if surface.whole { -diameter_m / 2.0 } else { BEYOND_M };
    let reach = surface.outline.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max) + margin.max(0.0);
    let steps = (reach / GRID_M).ceil() as i64;
    let place = |i: i64, j: i64| centre + (e1 * i as f64 + e2 * j as f64) * GRID_M;
    (-steps..=steps)
        .flat_map(|i| (-steps..=steps).map(move |j| (i, j)))
        .map(|(i, j)| place(i, j))
        .filter(|p| covers(surface, p, margin))
        .collect()
}

/// Whether a point lies within the outline widened by a margin.
fn covers(surface: &KnownSurface, point: &Point3<f64>, margin_m: f64) -> bool {
    let n = surface.outline.len();
    n >= 3
        && (0..n).all(|i| {
            let (a, b) = (surface.outline[i], surface.outline[(i + 1) % n]);
            let inward = surface.up.cross(&(b - a));
            inward.dot(&(point - a)) >= -margin_m * inward.norm()
        })
}

/// The unseen points of an object that stood at a place, if it could stand there unnoticed.
fn unseen_volume(
    situation: &Situation,
    surface: &KnownSurface,
    centre: &Point3<f64>,
    (height_m, diameter_m): (f64, f64),
) -> Option<Vec<Point3<f64>>> {
    let (e1, e2) = across(surface);
    let mut unseen = Vec::new();
    let (mut all, mut free) = (0.0, 0.0);
    for level in [0.25, 0.6, 0.95] {
        for (a, b) in [(0.0, 0.0), (0.35, 0.0), (-0.35, 0.0), (0.0, 0.35), (0.0, -0.35)] {
            let point = centre + surface.up * (height_m * level) + (e1 * a + e2 * b) * diameter_m;
            all += 1.0;
            match situation.space.cell(&point) {
                Cell::Unseen => unseen.push(point),
                Cell::Free => free += 1.0,
                Cell::Occupied => {}
            }
        }
    }
    (free <= FREE_SHARE * all && unseen.len() as f64 >= UNSEEN_SHARE * all).then_some(unseen)
}

/// The sides of an object that no view has shown, each with its part of what hangs on the object.
fn unseen_sides(situation: &Situation, track: &Track, weight: f64) -> Vec<Hypothesis> {
    let Some((on, surface)) = situation.surfaces.iter().enumerate().find(|(_, s)| !s.outline.is_empty())
    else {
        return Vec::new();
    };
    let (e1, e2) = across(surface);
    let centre = track.position_m + surface.up * (track.size_m[2] / 2.0);
    let radius = track.size_m[0].max(track.size_m[1]) / 2.0;
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
    let open: Vec<Vector3<f64>> = sides.filter(|side| !seen_from(side)).collect();
    let each = weight / SECTORS as f64;
    let hypothesis = |side: &Vector3<f64>| Hypothesis {
        weight: each,
        on,
        centre,
        points: vec![centre + side * (radius + 0.02)],
        facing: Some(*side),
    };
    open.iter().map(hypothesis).collect()
}
