//! Observed and unobserved extents of an object: its top, and the sides of its footprint.

use super::asker::Asker;
use super::body::{Body, Cuboid};
use super::model::Range;
use super::rays::Rays;
use super::verify::{MERGED, Placed, placed};
use crate::outline::Rectangle;
use crate::pool;
use crate::scale::{APART_M, EDGE_M};
use crate::visibility::Seen;

/// True if most positions just above the object are occluded.
pub(super) fn top_hidden(asker: &Asker, footprint: &Rectangle, top: f64) -> bool {
    /// Distance of the tested positions from the centre, as a share of the shorter side.
    /// From: chosen.
    const REACH: f64 = 0.25;
    let reach = REACH * footprint.sides_m[1];
    let places = [(0.0, 0.0), (reach, 0.0), (-reach, 0.0), (0.0, reach), (0.0, -reach)];
    let above = top + APART_M;
    let hidden = places
        .iter()
        .filter(|(dx, dy)| asker.look(footprint.x + dx, footprint.y + dy, above) < Seen::Surface)
        .count();
    !asker.views.is_empty() && 2 * hidden > places.len()
}

/// Likelihood of each length of one side of a box, relative to the likeliest.
#[derive(Clone, Debug)]
pub struct Side {
    /// Smallest tried length, metres; further lengths follow in steps of [`EDGE_M`].
    least_m: f64,
    /// Log likelihood of each tried length, 0 for the likeliest.
    logs: Vec<f64>,
}

impl Side {
    /// Raises the likelihoods to a power.
    pub fn soften(&mut self, exponent: f64) {
        self.logs.iter_mut().for_each(|log| *log *= exponent);
    }

    /// Tried lengths, metres, each with its log likelihood.
    fn tried(&self) -> impl Iterator<Item = (f64, f64)> {
        self.logs.iter().enumerate().map(|(n, log)| (self.least_m + EDGE_M * n as f64, *log))
    }

    /// Likelihood of a length, blurred by the edge accuracy and constant beyond the longest tried
    /// length.
    pub fn likelihood(&self, length_m: f64) -> f64 {
        let near = |(tried_m, log): (f64, f64)| log - 0.5 * ((length_m - tried_m) / EDGE_M).powi(2);
        let beyond = self.logs.last().copied().filter(|_| length_m > self.longest_m());
        self.tried().map(near).chain(beyond).fold(f64::NEG_INFINITY, f64::max).exp()
    }

    /// Mean likelihood of the lengths of a range.
    pub fn mean(&self, range: Range) -> f64 {
        let steps = 1 + ((range.high - range.low) / STEP_M) as u32;
        let length_m =
            |n: u32| range.low + (f64::from(n) + 0.5) / f64::from(steps) * (range.high - range.low);
        (0..steps).map(|n| self.likelihood(length_m(n))).sum::<f64>() / f64::from(steps)
    }

    /// Integral of the likelihood over a density of lengths; `beyond`: probability of lengths
    /// beyond the longest tried one.
    pub fn sum(&self, density: impl Fn(f64) -> f64, beyond: f64) -> f64 {
        /// Number of steps below the smallest tried length that are integrated too. From: rounding.
        const SHORTER: usize = 8;
        let steps = SHORTER + ((self.longest_m() - self.least_m) / STEP_M).round() as usize;
        let lengths_m = (0..steps).map(|n| self.longest_m() - (n as f64 + 0.5) * STEP_M);
        let tried: f64 = lengths_m.map(|at_m| density(at_m) * self.likelihood(at_m) * STEP_M).sum();
        tried + beyond * self.logs.last().map_or(0.0, |log| log.exp())
    }

    /// Longest tried length, metres.
    pub fn longest_m(&self) -> f64 {
        self.least_m + EDGE_M * self.logs.len().saturating_sub(1) as f64
    }

    /// Likeliest length, metres; the longest of equally likely ones.
    pub fn likeliest_m(&self) -> f64 {
        self.tried().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |(length_m, _)| length_m)
    }
}

/// Step of the sums over lengths, metres. From: work.
const STEP_M: f64 = 0.5 * EDGE_M;
/// Log likelihood ratio against a length at which no further lengths are tried. From: chosen.
const SURE: f64 = 40.0;
/// Step sizes of the search for a box's sides, metres, and rotation, radians. From: work, a turn
/// moves the ends of what is 15 cm long by as much.
const SOUGHT: [(f64, f64); 2] = [(EDGE_M, 0.026), (0.5 * EDGE_M, 0.013)];
/// Maximum number of steps of each size in the search for a box's sides and rotation. From: work.
const TRIES: usize = 8;
/// Number of alternations between registering the views and fitting the box. From: work.
const ROUNDS: usize = 2;

/// Box, with its best shift in each view.
struct Boxed<'a> {
    rays: &'a Rays,
    placed: Vec<Placed>,
    body: Cuboid,
    log: f64,
}

impl Boxed<'_> {
    fn of<'a>(rays: &'a Rays, rectangle: &Rectangle, (base_m, top_m): (f64, f64)) -> Boxed<'a> {
        let body = Cuboid::around(rectangle, base_m, top_m);
        let placed = vec![Placed::UNMOVED; rays.views.len()];
        let mut boxed = Boxed { rays, placed, body, log: 0.0 };
        boxed.log = boxed.log_of(&body);
        boxed
    }

    /// Shifts each view to its best match with the box.
    fn place(&mut self) {
        self.placed = self.suited(&self.body, &self.placed);
        self.log = self.log_of(&self.body);
    }

    /// Log likelihood of another box in all views.
    fn log_of(&self, body: &Cuboid) -> f64 {
        let of_view = |n: usize| self.rays.views[n].log_likelihood(&body.moved(self.placed[n].shift_m));
        pool::each(self.rays.views.len(), 1, of_view).iter().sum()
    }

    /// Optimises the box's ends and rotation over all views.
    fn settle(&mut self) {
        for (step_m, step_rad) in SOUGHT {
            for _ in 0..TRIES {
                let ends = (0..4).flat_map(|end| [-step_m, step_m].map(|by_m| self.body.longer(end, by_m)));
                let turns = [-step_rad, step_rad].map(|by_rad| self.body.turned(by_rad));
                let tried = ends.chain(turns).map(|body| (self.log_of(&body), body));
                match tried.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(log, _)| *log > self.log) {
                    Some(better) => (self.log, self.body) = better,
                    None => break,
                }
            }
        }
    }

    /// Likelihoods of the lengths of the side between two ends (as for [`Cuboid::longer`]), up to
    /// `longest_m`. Either end may move, and the views are shifted to match.
    fn side(&self, ends: [usize; 2], longest_m: f64) -> Side {
        let length_m = self.body.length_m(ends[0]);
        let log = |placed: &[Placed]| placed.iter().map(|view| view.log).sum::<f64>();
        let own = log(&self.suited(&self.body, &self.placed));
        let walk = |step_m: f64, reach_m: f64| {
            let mut placed = ends.map(|_| self.placed.clone());
            let mut logs = Vec::new();
            for n in 1..=(reach_m / EDGE_M).max(0.0) as usize {
                let at = |end: usize| self.body.longer(end, step_m * n as f64);
                placed = [0, 1].map(|k| self.suited(&at(ends[k]), &placed[k]));
                logs.push(log(&placed[0]).max(log(&placed[1])) - own);
                if logs.last().is_some_and(|log| *log < -SURE) {
                    break;
                }
            }
            logs
        };
        let mut logs = walk(-EDGE_M, length_m - EDGE_M);
        let least_m = length_m - EDGE_M * logs.len() as f64;
        logs.reverse();
        logs.push(0.0);
        logs.extend(walk(EDGE_M, longest_m - length_m));
        let best = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        logs.iter_mut().for_each(|log| *log -= best);
        Side { least_m, logs }
    }

    /// Best placement of another box in each view, starting near the placement of this box.
    fn suited(&self, body: &Cuboid, from: &[Placed]) -> Vec<Placed> {
        pool::each(self.rays.views.len(), 1, |n| placed(&self.rays.views[n], body, from[n].shift_m, MERGED))
    }
}

/// Likelihoods of the lengths of both sides of a box from the surrounding rays, up to `longest_m`,
/// starting from the likelier of two rectangles.
pub fn sides(rays: &Rays, about: [&Rectangle; 2], heights_m: (f64, f64), longest_m: f64) -> [Side; 2] {
    let [mut one, other] = about.map(|rectangle| Boxed::of(rays, rectangle, heights_m));
    if other.log > one.log {
        one = other;
    }
    one.settle();
    for _ in 0..ROUNDS {
        one.place();
        one.settle();
    }
    [one.side([0, 1], longest_m), one.side([2, 3], longest_m)]
}
