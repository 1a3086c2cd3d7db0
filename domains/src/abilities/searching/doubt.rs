//! What is not yet known, as hypotheses that a look could settle.
//!
//! A thing may stand where nothing has been seen yet, or be one of the objects that were seen from too few sides. Each
//! such possibility is a [`Hypothesis`] with the probability that hangs on it; a look settles those that it shows.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use descry_memory::belief::Track;
use descry_memory::space::{Cell, Space};
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::recognise::ObjectModel;

use crate::situation::{KnownSurface, Situation, Thing};

/// Distance between places where a hidden object may stand.
const GRID_M: f64 = 0.05;
/// How far beyond the seen part of a surface it may go on.
const BEYOND_M: f64 = 0.3;
/// Share of an object's volume that must be unseen for it to stand there unnoticed.
const UNSEEN_SHARE: f64 = 0.6;
/// Share of an object's volume that may have been seen free, for noise, if it stands there.
const FREE_SHARE: f64 = 0.15;
/// So many of the five columns of an object may seem to lie within a solid body where it only stands close to it.
const GRAZED: usize = 2;
/// Share of an object's volume in which something was measured that no object explains, for it to be likely that one stands there.
const MEASURED_SHARE: f64 = 1.0 / 3.0;
/// Share of an object's volume that may have been seen free where so much was measured: from afar a rim is cut off and noise frays
/// what is left.
const FRAYED_SHARE: f64 = 0.5;
/// What is known so well is not taken for two things that blur into each other.
const SURE: f64 = 0.8;
/// How many times more likely an object stands at such a place than at one of which nothing is known: what was measured there is
/// something, if not what is asked about.
const MEASURED_WEIGHT: f64 = 50.0;
/// How far above an unseen place the top of a body that fills it is looked for, metres.
const ROOF_M: f64 = 0.5;
/// Sides from which an object is looked at.
const SECTORS: usize = 8;
/// An object that is believed less than this to be the thing is no longer asked about.
const NEGLIGIBLE: f64 = 0.02;
/// The columns of an object's volume that are asked for, in diameters from its middle, and the levels, in heights from its foot.
const COLUMNS: [(f64, f64); 5] = [(0.0, 0.0), (0.35, 0.0), (-0.35, 0.0), (0.0, 0.35), (0.0, -0.35)];
const LEVELS: [f64; 3] = [0.25, 0.6, 0.95];
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
    /// Some surface is not known yet: every look may settle everything.
    pub anywhere: bool,
    /// Places where something can stand at all, by surface.
    places: BTreeMap<usize, usize>,
    /// How far a look settles each hypothesis, 0 to 1, by obstacle moved (0: none), candidate and surface.
    told: Vec<OnceLock<Vec<f64>>>,
    /// What all looks together can settle, by obstacle moved (0: none).
    within_reach: Vec<OnceLock<Reach>>,
    looks: usize,
    surfaces: usize,
}

/// What a plan does before a look.
#[derive(Debug, Clone, Copy, Default)]
pub struct Taken<'a> {
    /// Looks: candidate and surface.
    pub looks: &'a [(usize, usize)],
    /// The obstacle that is pushed aside.
    pub moved: Option<usize>,
}

/// The probability that hangs on what looks can settle.
#[derive(Debug, Clone, Copy, Default)]
struct Reach {
    weight: f64,
    /// Each possibility counted only as far as the look tells it that shows it most clearly.
    as_told: f64,
}

impl Doubt {
    /// What is in doubt about a thing: where it may be hidden, and which objects may be it.
    pub(crate) fn about(situation: &Situation, what: usize) -> Self {
        let thing = &situation.things[what];
        let best = situation.confidence(what);
        let mut doubt = Self::hidden(situation, thing, &situation.expected[what]);
        doubt.scale_hidden(1.0 - best);
        for track in &situation.belief.tracks {
            let p = thing.probability(track, &situation.surfaces);
            if p > NEGLIGIBLE {
                doubt.hypotheses.extend(unseen_sides(situation, track, p));
            }
        }
        doubt
    }

    /// What is in doubt about a thing on one surface.
    pub(crate) fn about_on(situation: &Situation, what: usize, on: usize) -> Self {
        let thing = Thing { on: Some(vec![on]), ..situation.things[what].clone() };
        let mut doubt = Self::hidden(situation, &thing, &situation.expected[what]);
        doubt.scale_hidden(1.0 - situation.presence(what, on));
        for track in situation.on_surface(on) {
            let p = thing.probability(track, &situation.surfaces);
            if p > NEGLIGIBLE {
                doubt.hypotheses.extend(unseen_sides(situation, track, p));
            }
        }
        doubt
    }

    /// What is in doubt about which objects are of a kind: where more of it may be hidden, and which objects may be of it.
    pub(crate) fn of(situation: &Situation, of: usize) -> Self {
        let kind = &situation.kinds[of];
        let mut doubt = Self::hidden(situation, kind, &situation.expected[situation.things.len() + of]);
        for track in &situation.belief.tracks {
            let p = kind.probability(track, &situation.surfaces);
            doubt.hypotheses.extend(unseen_sides(situation, track, p.min(1.0 - p)));
        }
        doubt
    }

    /// What is in doubt on a surface: what may be hidden there, and what the objects on it are.
    pub(crate) fn on(situation: &Situation, on: usize) -> Self {
        let mut doubt = Self::hidden_on(situation, &[(on, 1.0)], SMALL_M);
        for track in situation.on_surface(on) {
            doubt.hypotheses.extend(unseen_sides(situation, track, 1.0 - track.certainty()));
        }
        doubt
    }

    /// Where a thing may be hidden, on the surfaces that it is asked about.
    fn hidden(situation: &Situation, thing: &Thing, expected: &[f64]) -> Self {
        let size = thing.models.first().map_or(SMALL_M, size_m);
        let surfaces = (0..situation.surfaces.len()).filter(|&on| thing.may_be_on(on));
        let weighted: Vec<(usize, f64)> = surfaces.map(|on| (on, expected[on])).collect();
        Self::hidden_on(situation, &weighted, size)
    }

    /// The share of the doubt that a look, a candidate and a surface, would settle beyond what the plan does before it, 0 to 1. Doubt that no
    /// look can settle does not count; none is worth a look where what can be settled is negligible.
    pub fn share_settled(&self, situation: &Situation, look: (usize, usize), before: Taken<'_>) -> f64 {
        if self.anywhere {
            return if before.looks.is_empty() { 1.0 } else { 0.0 };
        }
        let total = self.within_reach(situation, before.moved);
        if !self.is_worth_it(situation, total.weight, before.moved) {
            return 0.0;
        }
        let told = |look: (usize, usize)| self.told(situation, look, before.moved);
        let earlier: Vec<&[f64]> =
            before.looks.iter().filter(|earlier| earlier.1 == look.1).map(|&look| told(look)).collect();
        let now = told(look);
        let fresh = |i: usize| (now[i] - earlier.iter().map(|e| e[i]).fold(0.0, f64::max)).max(0.0);
        let settled: f64 = (0..self.hypotheses.len()).map(|i| self.hypotheses[i].weight * fresh(i)).sum();
        settled / total.as_told
    }

    /// What hangs on all that some look could settle that can be taken and, as long as nothing is moved, has not been taken.
    fn within_reach(&self, situation: &Situation, moved: Option<usize>) -> Reach {
        *self.within_reach[moved.map_or(0, |o| o + 1)].get_or_init(|| {
            let open = |look: &(usize, usize)| moved.is_some() || !situation.observed.contains(look);
            let looks = self.all_looks(situation, open, moved);
            let best = |n: usize| looks.iter().map(|told| told[n]).fold(0.0, f64::max);
            let mut reach = Reach::default();
            for (n, hypothesis) in self.hypotheses.iter().enumerate() {
                let best = best(n);
                reach.as_told += hypothesis.weight * best;
                reach.weight += if best > 0.0 { hypothesis.weight } else { 0.0 };
            }
            reach
        })
    }

    /// Whether looking alone can settle anything that matters.
    pub fn can_be_settled(&self, situation: &Situation) -> bool {
        self.anywhere || self.is_worth_it(situation, self.within_reach(situation, None).weight, None)
    }

    /// Whether looks that settle so much matter: by themselves, or because with them it could be said that nothing is hidden.
    fn is_worth_it(&self, situation: &Situation, weight: f64, moved: Option<usize>) -> bool {
        let t = &situation.thresholds;
        let most = t.remaining + t.out_of_sight;
        weight >= negligible(situation, moved) || (self.hidden > most && self.hidden - weight <= most)
    }

    /// Whether looks would settle enough once an obstacle is moved, of what no look shows now.
    pub(crate) fn can_be_settled_without(&self, situation: &Situation, what: usize) -> bool {
        let [before, after] = [None, Some(what)].map(|moved| self.all_looks(situation, |_| true, moved));
        let only_after = |n: &usize| {
            let shown = |looks: &[&[f64]]| looks.iter().any(|told| told[*n] > 0.0);
            shown(&after) && !shown(&before)
        };
        let uncovered: f64 =
            (0..self.hypotheses.len()).filter(only_after).map(|n| self.hypotheses[n].weight).sum();
        uncovered >= negligible(situation, Some(what))
    }

    /// The probability that hangs on what the best look at a surface would settle, of those that can be taken and have not been.
    pub fn most_settled_on(&self, situation: &Situation, on: usize) -> f64 {
        if self.anywhere {
            return self.hidden;
        }
        let open = |look: &(usize, usize)| look.1 == on && !situation.observed.contains(look);
        let looks = self.all_looks(situation, open, None);
        let settled =
            |told: &&[f64]| self.hypotheses.iter().zip(*told).map(|(h, told)| h.weight * told).sum::<f64>();
        looks.iter().map(settled).fold(0.0, f64::max)
    }

    /// The share of the places on a surface where it could not stand unseen, 0 to 1; none if it is not asked about there or
    /// nothing is known of the surface.
    pub fn share_seen(&self, on: usize) -> Option<f64> {
        let places = *self.places.get(&on)?;
        let hidden = self.hypotheses.iter().filter(|h| h.facing.is_none() && h.on == on).count();
        Some(1.0 - hidden as f64 / (places.max(1)) as f64)
    }

    /// The probability that hangs on all that is in doubt.
    pub fn remaining(&self) -> f64 {
        if self.anywhere { self.hidden } else { self.hypotheses.iter().map(|h| h.weight).sum() }
    }

    /// The probability that hangs on hidden places that no look shows, and those places.
    pub fn out_of_sight(&self, situation: &Situation) -> (f64, Vec<Point3<f64>>) {
        let looks = self.all_looks(situation, |_| true, None);
        let hidden = self.hypotheses.iter().enumerate().filter(|(_, h)| h.facing.is_none());
        let unseeable = hidden.filter(|(n, _)| !looks.iter().any(|told| told[*n] > 0.0));
        let unseeable: Vec<&Hypothesis> = unseeable.map(|(_, h)| h).collect();
        (unseeable.iter().map(|h| h.weight).sum(), unseeable.iter().map(|h| h.centre).collect())
    }

    /// What each look tells that is open, can be reached and sees the surface.
    fn all_looks(
        &self,
        situation: &Situation,
        open: impl Fn(&(usize, usize)) -> bool,
        moved: Option<usize>,
    ) -> Vec<&[f64]> {
        (0..situation.candidates.len())
            .flat_map(|from| (0..self.surfaces).map(move |on| (from, on)))
            .filter(|look| open(look) && situation.can_reach(look.0) && situation.sees(look.0, look.1))
            .map(|look| self.told(situation, look, moved))
            .collect()
    }

    /// How far a look, a candidate and a surface, settles each hypothesis.
    fn told(&self, situation: &Situation, (from, on): (usize, usize), moved: Option<usize>) -> &[f64] {
        let at = moved.map_or(0, |o| o + 1) * self.looks + from * self.surfaces + on;
        self.told[at].get_or_init(|| {
            let obstacle = moved.map(|o| &situation.obstacles()[o]);
            let settled = |h: &Hypothesis| {
                if h.on == on { situation.would_settle(from, on, h, obstacle) } else { 0.0 }
            };
            self.hypotheses.iter().map(settled).collect()
        })
    }

    /// Where a body of a size may be hidden on some surfaces, each with how much more often it is expected there than on another,
    /// however large they are; on each, everywhere alike.
    fn hidden_on(situation: &Situation, surfaces: &[(usize, f64)], size_m: (f64, f64)) -> Self {
        let mut all = 0.0;
        let mut anywhere = false;
        let mut hypotheses = Vec::new();
        let mut count = BTreeMap::new();
        for &(on, expected) in surfaces {
            let surface = &situation.surfaces[on];
            let standing: Vec<&Track> = situation.on_surface(on).collect();
            let places = grid(surface, size_m.1);
            anywhere |= places.is_empty() && surface.outline.is_empty();
            if places.is_empty() {
                continue;
            }
            all += expected;
            let each = expected / places.len() as f64;
            count.insert(on, places.len());
            hypotheses.extend(places.iter().filter_map(|centre| {
                around(surface, centre).find_map(|centre| {
                    let space = &situation.spaces[on];
                    let Unseen { points, likely } =
                        unseen_volume(surface, space, &standing, &centre, size_m)?;
                    let weight = each * if likely { MEASURED_WEIGHT } else { 1.0 };
                    Some(Hypothesis { weight, on, centre, points, facing: None })
                })
            }));
        }
        let unseen: f64 = hypotheses.iter().map(|h| h.weight).sum();
        let open = if anywhere || all == 0.0 { 1.0 } else { unseen / all };
        let prior = situation.thresholds.prior;
        let hidden = prior * open / (prior * open + 1.0 - prior);
        hypotheses.iter_mut().for_each(|h| h.weight *= hidden / unseen);
        let looks = situation.candidates.len() * situation.surfaces.len();
        let moves = 1 + situation.belief.tracks.len();
        Self {
            hypotheses,
            hidden,
            anywhere,
            places: count,
            told: (0..moves * looks).map(|_| OnceLock::new()).collect(),
            within_reach: (0..moves).map(|_| OnceLock::new()).collect(),
            looks,
            surfaces: situation.surfaces.len(),
        }
    }

    fn scale_hidden(&mut self, factor: f64) {
        self.hidden *= factor;
        self.hypotheses.iter_mut().for_each(|h| h.weight *= factor);
    }
}

/// Probability below which what can be settled is not worth a look; what can be seen only by moving something asks for less,
/// since it can be settled in no other way.
fn negligible(situation: &Situation, moved: Option<usize>) -> f64 {
    if moved.is_some() { situation.thresholds.out_of_sight } else { situation.thresholds.remaining }
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
        .filter(|p| surface.covers(p, margin))
        .collect()
}

/// The places that stand for a square of the grid, nearest to its middle first.
fn around(surface: &KnownSurface, place: &Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
    const STEPS: [f64; 4] = [-0.125, 0.125, -0.375, 0.375];
    let (e1, e2) = across(surface);
    let place = *place;
    let steps = STEPS.into_iter().flat_map(|a| STEPS.into_iter().map(move |b| (a, b)));
    steps.map(move |(a, b)| place + (e1 * a + e2 * b) * GRID_M)
}

/// An object that could stand at a place unnoticed.
struct Unseen {
    /// Its points that no view settled.
    points: Vec<Point3<f64>>,
    /// Whether so much was measured there, apart from all objects that are believed in, that something does stand there.
    likely: bool,
}

/// An object that stood at a place, if it could stand there unnoticed. What was measured there and belongs to no object that is believed
/// in may be its own; close to one it may as well be that one's.
fn unseen_volume(
    surface: &KnownSurface,
    space: &Space,
    standing: &[&Track],
    centre: &Point3<f64>,
    (height_m, diameter_m): (f64, f64),
) -> Option<Unseen> {
    let all = (COLUMNS.len() * LEVELS.len()) as f64;
    let (e1, e2) = across(surface);
    let column = |(a, b): (f64, f64)| centre + (e1 * a + e2 * b) * diameter_m;
    let explained = COLUMNS.map(|at| {
        let point = column(at);
        standing.iter().any(|track| surface.is_of(track, &point, space.voxel_m() / 2.0))
    });
    // Nothing is looked for in a vessel.
    let fills =
        |track: &Track| COLUMNS.iter().all(|&at| surface.is_of(track, &column(at), space.voxel_m() / 2.0));
    if standing.iter().any(|track| track.certainty() >= SURE && track.label().is_some() && fills(track)) {
        return None;
    }
    let mut unseen = Vec::new();
    let (mut free, mut measured) = (0.0, 0.0);
    for (n, &at) in COLUMNS.iter().enumerate() {
        for level in LEVELS {
            let point = column(at) + surface.up * (height_m * level);
            match space.cell(&point) {
                Cell::Unseen => unseen.push(point),
                Cell::Occupied if !explained[n] => {
                    measured += 1.0;
                    unseen.push(point);
                }
                Cell::Occupied => {}
                Cell::Free => free += 1.0,
            }
        }
    }
    // Where no map knows how far it goes, it may be another surface.
    let likely = surface.whole && measured >= MEASURED_SHARE * all && !explained.contains(&true);
    let (most_free, least_unseen) =
        if likely { (FRAYED_SHARE, 1.0 - FRAYED_SHARE) } else { (FREE_SHARE, UNSEEN_SHARE) };
    if free > most_free * all || (unseen.len() as f64) < least_unseen * all {
        return None;
    }
    let is_inside = |&n: &usize| {
        let top = column(COLUMNS[n]) + surface.up * height_m;
        explained[n] && is_roofed(space, &top, &surface.up)
    };
    ((0..COLUMNS.len()).filter(is_inside).count() <= GRAZED).then_some(Unseen { points: unseen, likely })
}

/// Whether a measured surface lies over an unseen point, with nothing seen free between: it is within a solid body.
fn is_roofed(space: &Space, point: &Point3<f64>, up: &Vector3<f64>) -> bool {
    let step_m = space.voxel_m();
    let above = (0..(ROOF_M / step_m) as usize).map(|k| space.cell(&(point + up * (k as f64 * step_m))));
    above.into_iter().find(|cell| *cell != Cell::Unseen) == Some(Cell::Occupied)
}

/// The sides of an object that no view has shown, each with its part of what hangs on the object.
fn unseen_sides(situation: &Situation, track: &Track, weight: f64) -> Vec<Hypothesis> {
    let Some(on) = situation.surface_of(track) else { return Vec::new() };
    let surface = &situation.surfaces[on];
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
    let each = weight / open.len().max(1) as f64;
    let hypothesis = |side: &Vector3<f64>| Hypothesis {
        weight: each,
        on,
        centre,
        points: vec![centre + side * (radius + 0.02)],
        facing: Some(*side),
    };
    open.iter().map(hypothesis).collect()
}

#[cfg(test)]
mod tests {
    use descry_memory::RecordId;
    use descry_perception::Intrinsics;
    use descry_perception::nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use descry_perception::recognise::Evidence;
    use descry_perception::visibility::DepthMap;

    use super::*;

    /// What a camera two metres above a table has seen of a disc of 7 cm at a height: what is below it is unseen.
    fn seen_from_above(disc_m: f64) -> Space {
        let intrinsics = Intrinsics { width: 320, height: 240, fx: 500.0, fy: 500.0, cx: 160.0, cy: 120.0 };
        let depth_m = |n: usize| {
            let (u, v) = ((n % 320) as f64 - 160.0, (n / 320) as f64 - 120.0);
            let above = 2.0 - disc_m;
            if (u * above / 500.0).hypot(v * above / 500.0) < 0.035 { above as f32 } else { 2.0 }
        };
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let world_from_camera = Isometry3::from_parts(Translation3::new(0.0, 0.0, 2.0), down);
        let depths_m = (0..320 * 240).map(depth_m).collect();
        let mut space = Space::default();
        space.integrate(&DepthMap { intrinsics, camera_from_world: world_from_camera.inverse(), depths_m });
        space
    }

    /// What a camera one metre before a cup has seen of it from the side: a piece of its middle, so high and so wide to either side.
    fn seen_from_the_side(low_m: f64, high_m: f64, aside_m: f64) -> Space {
        let intrinsics = Intrinsics { width: 320, height: 240, fx: 500.0, fy: 500.0, cx: 160.0, cy: 120.0 };
        let depth_m = |n: usize| {
            let (u, v) = ((n % 320) as f64 - 160.0, (n / 320) as f64 - 120.0);
            let (aside, height) = (u / 500.0, 0.05 - v / 500.0);
            let is_seen = aside.abs() < aside_m && height > low_m && height < high_m;
            // From afar noise is as wide as the cup.
            let noise_m = 0.015 * ((n * 7919) % 5) as f64 - 0.03;
            let front_m = (0.035_f64.powi(2) - aside * aside).max(0.0).sqrt();
            if is_seen { (1.0 - front_m + noise_m) as f32 } else { 3.0 }
        };
        // Along +x, with the image's rows downwards.
        let ahead = UnitQuaternion::from_euler_angles(
            -std::f64::consts::FRAC_PI_2,
            0.0,
            -std::f64::consts::FRAC_PI_2,
        );
        let world_from_camera = Isometry3::from_parts(Translation3::new(-1.0, 0.0, 0.05), ahead);
        let depths_m = (0..320 * 240).map(depth_m).collect();
        let mut space = Space::default();
        space.integrate(&DepthMap { intrinsics, camera_from_world: world_from_camera.inverse(), depths_m });
        space
    }

    #[test]
    fn what_is_left_of_a_thing_seen_from_afar_may_be_the_whole() {
        let left = |low_m: f64, high_m: f64, surface: &KnownSurface| {
            let space = seen_from_the_side(low_m, high_m, 0.03);
            unseen_volume(surface, &space, &[], &Point3::origin(), (0.104, 0.07)).map(|hidden| hidden.likely)
        };
        assert_eq!(left(0.0, 0.075, &table()), Some(true), "its rim was cut off");
        assert_eq!(left(0.0, 0.02, &table()), None, "too little is left of it");
        let boundless = KnownSurface { whole: false, ..table() };
        assert_eq!(left(0.0, 0.075, &boundless), None);
    }

    #[test]
    fn nothing_is_looked_for_in_a_vessel() {
        let hidden = |standing: &[&Track]| {
            let at = Point3::origin();
            unseen_volume(&table(), &Space::default(), standing, &at, (0.104, 0.06)).is_some()
        };
        let known = Track {
            unknown: 0.05,
            kinds: vec![("cup".into(), 0.95)],
            probabilities: vec![("cup B".into(), 0.95)],
            ..disc()
        };
        assert!(hidden(&[]));
        assert!(hidden(&[&disc()]), "of what is not known it may be a part");
        assert!(!hidden(&[&known]));
    }

    fn table() -> KnownSurface {
        let corners = [(-0.5, -0.4), (0.5, -0.4), (0.5, 0.4), (-0.5, 0.4)];
        KnownSurface {
            symbol: "table".into(),
            name: "table".into(),
            room: None,
            outline: corners.map(|(x, y)| Point3::new(x, y, 0.0)).to_vec(),
            up: Vector3::z(),
            whole: true,
            doubtful: None,
        }
    }

    /// An object of which the disc is the top.
    fn disc() -> Track {
        let round = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / 12.0;
            Point3::new(0.04 * angle.cos(), 0.04 * angle.sin(), 0.0)
        };
        Track {
            id: 0,
            on: "table".into(),
            position_m: Point3::origin(),
            position_sigma_m: 0.002,
            size_m: [0.07, 0.07, 0.1],
            footprint_m: (0..12).map(round).collect(),
            probabilities: vec![("cup A".into(), 0.01)],
            kinds: vec![("cup".into(), 0.01)],
            unknown: 0.99,
            seen_fraction: 0.5,
            viewpoints_m: vec![],
            evidence: Evidence::default(),
            cites: vec![RecordId(1)],
            first_ns: 0,
            last_ns: 0,
        }
    }

    /// Whether a cup of 7 cm may stand unnoticed under what was seen.
    fn check(disc_m: f64, cup_m: f64, standing: &[&Track], expected: bool) {
        let hidden =
            unseen_volume(&table(), &seen_from_above(disc_m), standing, &Point3::origin(), (cup_m, 0.07));
        assert_eq!(hidden.is_some(), expected, "disc at {disc_m} m, {} objects", standing.len());
    }

    #[test]
    fn what_was_measured_and_no_object_explains_is_likely_something() {
        let likely = |disc_m: f64, standing: &[&Track]| {
            let space = seen_from_above(disc_m);
            let hidden = unseen_volume(&table(), &space, standing, &Point3::origin(), (0.104, 0.07));
            hidden.map(|hidden| hidden.likely)
        };
        assert_eq!(likely(0.104, &[]), Some(true));
        assert_eq!(likely(0.20, &[]), Some(false), "it stands below what was measured");
        assert_eq!(likely(0.104, &[&disc()]), None);
    }

    #[test]
    fn a_rim_that_no_object_explains_may_be_its_own() {
        check(0.104, 0.104, &[], true);
        check(0.104, 0.104, &[&disc()], false);
        // What stands under a roof that is an object stands within a solid body.
        check(0.20, 0.104, &[&disc()], false);
        check(0.0, 0.104, &[], false);
    }
}
