//! How much worse a known model explains what the cameras saw around a thing than the thing's own measures do.

use super::body::{Cuboid, Frustum};
use super::evidence::Measured;
use super::model::{ObjectModel, Range, Shape, Top};
use super::percept::Stance;
use super::rays::{Rays, ViewRays, bounded};

/// Thickness of the walls of vessels (set by hand), metres.
const WALL_M: f64 = 0.003;
/// Steps by which a body is moved to where it suits best, one after the other, and how often each is tried at most, metres.
const STEPS_M: [f64; 3] = [0.004, 0.002, 0.001];
const TRIES: usize = 3;
/// Spread of how far a view shows a body beside where all show it, metres (set by hand).
const SHIFT_M: f64 = 0.005;

/// The bodies that a thing is compared with.
pub(super) struct Rivals<'a> {
    rays: &'a Rays,
    measured: &'a Measured,
    base_m: f64,
    /// Log likelihood, in each view, of the best body of its own measures.
    own: Vec<f64>,
}

impl<'a> Rivals<'a> {
    pub fn of(rays: &'a Rays, measured: &'a Measured, base_m: f64) -> Rivals<'a> {
        let mut rivals = Rivals { rays, measured, base_m, own: Vec::new() };
        let round = measured.round.map(|round| {
            let closed = Frustum::around(&round, base_m, base_m + measured.height_m);
            rivals.best([closed, Frustum { wall_m: Some(WALL_M), ..closed }])
        });
        let own = [round, rivals.cuboid()].into_iter().flatten();
        rivals.own = own.max_by(|a, b| total(a).total_cmp(&total(b))).unwrap_or_default();
        rivals
    }

    fn cuboid(&self) -> Option<Vec<f64>> {
        let rectangle = self.measured.rectangle.as_ref()?;
        let [half_x, half_y] = rectangle.along_m.map(|side| 0.5 * side);
        let cuboid = Cuboid {
            x: rectangle.x,
            y: rectangle.y,
            turn: rectangle.turn,
            low: [-half_x, -half_y, self.base_m],
            high: [half_x, half_y, self.base_m + self.measured.height_m],
        };
        Some(self.rays.views.iter().map(|view| view.log_likelihood(&cuboid)).collect())
    }

    /// Log of how much less likely a model makes the views than the best body of its own measures: 0 or less.
    pub fn log_against(&self, model: &ObjectModel, stance: Stance) -> f64 {
        let Shape::Round = model.shape else { return 0.0 };
        let Some(diameter_m) = model.diameter_m else { return 0.0 };
        let m = self.measured;
        let within = |value: f64, low: f64, high: f64| value.clamp(low, high);
        let height_m = within(m.height_m, model.height_m.low, model.height_m.high);
        let wide_m = if m.round.is_some() { 2.0 * m.evidence.radius_m } else { m.footprint_m[0] };
        let widest_m = 0.5 * within(wide_m, diameter_m.low, diameter_m.high);
        let tapers = match stance {
            Stance::UpsideDown => Range { low: 1.0 / model.taper.high, high: 1.0 / model.taper.low },
            _ => model.taper,
        };
        let [x, y] = m.round.map_or(m.middle, |round| [round.x, round.y]);
        let frustum = |taper: f64, wall_m: Option<f64>| {
            let (foot_m, rim_m) =
                if taper < 1.0 { (widest_m * taper, widest_m) } else { (widest_m, widest_m / taper) };
            Frustum { x, y, base_m: self.base_m, top_m: self.base_m + height_m, foot_m, rim_m, wall_m }
        };
        let each = [tapers.middle(), within(m.evidence.taper, tapers.low, tapers.high)];
        let of_top = |wall_m: Option<f64>| self.best(each.map(|taper| frustum(taper, wall_m)));
        let logs = match (stance, model.top) {
            (Stance::UpsideDown, _) | (_, Top::Closed) => of_top(None),
            (_, Top::Open) => of_top(Some(WALL_M)),
            (_, Top::Any) => better(of_top(None), of_top(Some(WALL_M))),
        };
        logs.iter().zip(&self.own).map(|(log, own)| bounded(log - own)).sum::<f64>().min(0.0)
    }

    /// Of some bodies the best, each in each view where it suits that view best.
    fn best<const N: usize>(&self, frusta: [Frustum; N]) -> Vec<f64> {
        let each = frusta.iter().map(|f| self.rays.views.iter().map(|view| placed_in(view, f)).collect());
        each.reduce(better).unwrap_or_default()
    }
}

fn better(a: Vec<f64>, b: Vec<f64>) -> Vec<f64> {
    if total(&b) > total(&a) { b } else { a }
}

/// The log likelihood of all views together, each of which is a bad one now and then.
fn total(logs: &[f64]) -> f64 {
    logs.iter().map(|log| bounded(*log)).sum()
}

/// The log likelihood of a frustum in one view, were it a good one, where it suits it best.
fn placed_in(view: &ViewRays, frustum: &Frustum) -> f64 {
    let log = |dx: f64, dy: f64| {
        let moved = Frustum { x: frustum.x + dx, y: frustum.y + dy, ..*frustum };
        view.log_likelihood(&moved) - 0.5 * (dx * dx + dy * dy) / (SHIFT_M * SHIFT_M)
    };
    let mut best = (log(0.0, 0.0), [0.0, 0.0]);
    for step_m in STEPS_M {
        for _ in 0..TRIES {
            let from = best;
            for [dx, dy] in [[step_m, 0.0], [-step_m, 0.0], [0.0, step_m], [0.0, -step_m]] {
                let to = [from.1[0] + dx, from.1[1] + dy];
                let log = log(to[0], to[1]);
                if log > best.0 {
                    best = (log, to);
                }
            }
            if best.0 <= from.0 {
                break;
            }
        }
    }
    best.0
}
