//! Verification of known models: likelihood of the views around an object given a model, relative
//! to that given the object's own measured shape.

use super::body::{Body, Cuboid, Frustum};
use super::evidence::Measured;
use super::model::{ObjectModel, Range, Shape};
use super::percept::Stance;
use super::rays::{BAD_VIEW, Rays, ViewRays, bounded};
use crate::pool;
use crate::scale::{EDGE_M, PLACE_M};

/// Thickness of the walls of vessels, metres. From: chosen.
pub(super) const WALL_M: f64 = 0.003;
/// Steps of the search for a body's best shift in a view, metres. From: work.
const STEPS_M: [f64; 2] = [0.003, 0.0015];
/// Standard deviation of a body's shift in views registered at it, metres, and maximum number of
/// steps of each size. From: derived, as exactly as an edge is known; work.
const LAID: (f64, usize) = (EDGE_M, 2);
/// Standard deviation of a body's shift in views at their merged poses, metres, and maximum number
/// of steps of each size. From: derived, a place; work, so that they are moved up to 3 cm.
pub(super) const MERGED: (f64, usize) = (PLACE_M, 7);

/// Minimum radius of a round body, metres. From: rounding.
const LEAST_M: f64 = 0.01;

/// Best placement of a body in one view.
#[derive(Clone, Copy)]
pub(super) struct Placed {
    /// Log likelihood ratio against no body, plus the log prior of the shift.
    pub log: f64,
    /// Best shift of the body along x and y of the surface, metres.
    pub shift_m: [f64; 2],
}

impl Placed {
    /// Unmoved placement without evidence. From: mark.
    pub const UNMOVED: Placed = Placed { log: 0.0, shift_m: [0.0; 2] };
}

/// Reference for known models: the best body with the object's own measures.
pub(super) struct Own<'a> {
    rays: &'a Rays,
    measured: &'a Measured,
    base_m: f64,
    /// Best shift of the measured frustum in each view; unmoved if no round body was fitted.
    placed: Vec<Placed>,
    /// Log likelihood of each view, against no body, given the better of measured frustum and box.
    logs: Vec<f64>,
}

impl<'a> Own<'a> {
    pub fn of(rays: &'a Rays, measured: &'a Measured, base_m: f64) -> Own<'a> {
        let frustum = measured.round.map(|round| {
            let body = Frustum::around(&round, base_m, base_m + measured.height_m);
            let body = Frustum { wall_m: wall_m(measured), ..body };
            pool::map(&rays.views, 1, |view| placed(view, &body, [0.0; 2], LAID))
        });
        let cuboid = measured.rectangle.map(|rectangle| {
            let body = Cuboid::around(&rectangle, base_m, base_m + measured.height_m);
            rays.views.iter().map(|view| view.log_likelihood(&body)).collect::<Vec<f64>>()
        });
        let round = frustum.as_ref().map(|placed| placed.iter().map(|p| p.log).collect());
        let own = [round, cuboid].into_iter().flatten();
        // What no body was fitted to is compared with none: each view is as likely as without one.
        let none = || vec![0.0; rays.views.len()];
        let logs = own.max_by(|a, b| total(a).total_cmp(&total(b))).unwrap_or_else(none);
        let unmoved = || vec![Placed::UNMOVED; rays.views.len()];
        Own { rays, measured, base_m, placed: frustum.unwrap_or_else(unmoved), logs }
    }

    /// Reference for the object turned upright, with `rays` and `measured` turned too; the log
    /// likelihoods of the object as it lies are kept.
    pub fn turned<'b>(&self, rays: &'b Rays, measured: &'b Measured, base_m: f64) -> Own<'b> {
        let placed = vec![Placed::UNMOVED; rays.views.len()];
        Own { rays, measured, base_m, placed, logs: self.logs.clone() }
    }

    /// Log likelihood ratio of a model against the best body with the object's own measures; at
    /// most 0, and 0 for a box.
    pub fn log_against(&self, model: &ObjectModel, stance: Stance) -> f64 {
        let (m, Shape::Round, Some(diameter_m)) = (self.measured, model.shape, model.diameter_m) else {
            return 0.0;
        };
        let within =
            |value: f64, range: Range, slack: f64| value.clamp(range.low - slack, range.high + slack);
        let apart_m = m.apart_m();
        let tapers = match stance {
            Stance::UpsideDown => Range { low: 1.0 / model.taper.high, high: 1.0 / model.taper.low },
            _ => model.taper,
        };
        let wide_m = if m.round.is_some() { 2.0 * m.evidence.radius_m } else { m.footprint.sides_m[0] };
        let widest_m = 0.5 * within(wide_m, diameter_m, apart_m);
        let (x, y) = m.round.map_or((m.footprint.x, m.footprint.y), |round| (round.x, round.y));
        let of_taper = |taper: f64| {
            let body = Frustum {
                x,
                y,
                base_m: self.base_m,
                top_m: self.base_m + within(m.height_m, model.height_m, apart_m),
                foot_m: widest_m * taper.min(1.0),
                rim_m: widest_m / taper.max(1.0),
                wall_m: wall_m(m),
            };
            total(&pool::each(self.rays.views.len(), 1, |n| {
                let moved = placed(&self.rays.views[n], &body, self.placed[n].shift_m, LAID);
                against(moved.log - self.logs[n])
            }))
        };
        let (middle, own) =
            (tapers.middle(), within(m.evidence.taper, tapers, apart_m / widest_m.max(LEAST_M)));
        let log = of_taper(middle);
        if own == middle { log.min(0.0) } else { log.max(of_taper(own)).min(0.0) }
    }
}

/// Wall thickness, metres, if the upper end is more likely open; `None` if closed. The same for all
/// bodies, because the upper end is judged separately.
fn wall_m(measured: &Measured) -> Option<f64> {
    (measured.upper.open_log > 0.0).then_some(WALL_M)
}

/// Log likelihood ratio of one view, bounded below because the view may be uninformative.
fn against(log: f64) -> f64 {
    if log < 0.0 { bounded(log, BAD_VIEW) } else { log }
}

/// The log likelihood of all views together.
fn total(logs: &[f64]) -> f64 {
    logs.iter().sum()
}

/// Finds a body's best shift in a view by hill climbing from `from`; `spread_m`: prior standard
/// deviation of the shift, metres, `tries`: maximum number of steps of each size.
pub(super) fn placed(
    view: &ViewRays,
    body: &impl Body,
    from: [f64; 2],
    (spread_m, tries): (f64, usize),
) -> Placed {
    let mut known: Vec<Placed> = Vec::with_capacity(1 + STEPS_M.len() * tries * 4);
    let mut at = |shift_m: [f64; 2]| {
        // A step back leads to where it was already.
        if let Some(known) = known.iter().find(|known| known.shift_m == shift_m) {
            return *known;
        }
        let [dx, dy] = shift_m;
        let log =
            view.log_likelihood(&body.moved(shift_m)) - 0.5 * (dx * dx + dy * dy) / (spread_m * spread_m);
        known.push(Placed { log, shift_m });
        Placed { log, shift_m }
    };
    let mut best = at(from);
    for step_m in STEPS_M {
        for _ in 0..tries {
            let [x, y] = best.shift_m;
            let around = [[x + step_m, y], [x - step_m, y], [x, y + step_m], [x, y - step_m]].map(&mut at);
            match around.into_iter().max_by(|a, b| a.log.total_cmp(&b.log)).filter(|to| to.log > best.log) {
                Some(better) => best = better,
                None => break,
            }
        }
    }
    best
}
