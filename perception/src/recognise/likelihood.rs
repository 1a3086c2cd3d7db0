//! Likelihood of the measures given sizes, form, upper end and handle.

use super::ends::Side;
use super::evidence::Measured;
use super::model::{Handle, Range, Shape, Top};
use super::percept::Sighting;
use super::rays::BELL;
use crate::noise::normal_cdf;
use crate::scale::{APART_M, EDGE_M, HANDLE_M, PLACE_M, SHAPE_M};

/// Minimum probability density of a measure. From: chosen.
const LEAST_DENSITY: f64 = 1e-12;
/// Minimum probability of a height of which only a lower bound was seen. From: chosen.
const LEAST_CHANCE: f64 = 1e-6;
/// Minimum probability that an object, as measured, is none of the known ones. From: chosen.
pub(super) const STRANGER: f64 = 0.05;

/// Probability that the true value lies within a range, given the measured value; 0 for a range of
/// one value.
pub(super) fn inside(value: f64, sigma: f64, r: Range) -> f64 {
    normal_cdf((value - r.low) / sigma) - normal_cdf((value - r.high) / sigma)
}

/// Probability of an outlier measurement: flat tails. From: chosen, a tenth of it was tried, and
/// with it a real mug that narrows was no mug.
const ASTRAY: f64 = 0.002;

/// Probability density of a measured value given a range: uniform, blurred by the measurement
/// error.
pub(super) fn within_density(value: f64, sigma: f64, r: Range) -> f64 {
    /// Width below which a range is a single value, as a share of the measurement's spread. From: chosen.
    const NARROW: f64 = 0.2;
    let width = r.high - r.low;
    if width > NARROW * sigma {
        inside(value, sigma, r) / width
    } else {
        normal_density(value - r.middle(), sigma)
    }
}

/// Log density of a measured value given a range (uniform, blurred by the measurement error) or,
/// without one, given everyday objects (log-normal: median and spread).
fn measure_log(value: f64, sigma: f64, range: Option<Range>, everyday: (f64, f64)) -> f64 {
    match range {
        Some(r) => {
            let density = within_density(value, sigma, r);
            ((1.0 - ASTRAY) * density + ASTRAY * everyday_density(value, everyday)).max(LEAST_DENSITY).ln()
        }
        None => everyday_density(value, everyday).max(LEAST_DENSITY).ln(),
    }
}

/// Median, metres, and log-normal spread of the heights of everyday things. From: chosen, a guess; nothing was measured.
pub(super) const HEIGHTS: (f64, f64) = (0.11, 0.6);
/// Median, metres, and log-normal spread of the widths of everyday things. From: chosen, a guess;
/// nothing was measured.
pub(super) const WIDTHS: (f64, f64) = (0.10, 0.6);
/// Median and log-normal spread of the tapers of everyday things, dimensionless. From: chosen, a
/// guess; nothing was measured.
const TAPERS: (f64, f64) = (0.95, 0.25);
/// Minimum standard deviation of a taper, however well the side is measured. From: chosen.
const RATIO_SIGMA: f64 = 0.05;

pub(super) fn height_log(range: Option<Range>, everyday: (f64, f64), m: &Measured) -> f64 {
    if m.top_hidden {
        // Only a lower bound: the chance of being at least that high.
        let chance = match range {
            Some(r) => 1.0 - normal_cdf((m.height_m - r.high) / m.height_sigma_m),
            None => 1.0 - normal_cdf((m.height_m / everyday.0).ln() / everyday.1),
        };
        return chance.max(LEAST_CHANCE).ln();
    }
    measure_log(m.height_m, m.height_sigma_m, range, everyday)
}

pub(super) fn diameter_log(range: Option<Range>, everyday: (f64, f64), m: &Measured) -> f64 {
    if m.round.is_none() {
        // No circle fits; were it round, its footprint would be its diameter.
        return measure_log(m.footprint.sides_m[0], APART_M, range, everyday);
    }
    measure_log(2.0 * m.evidence.radius_m, diameter_sigma_m(m), range, everyday)
}

/// Joint log density of diameter and form of a round body: an outlying diameter is not that of the
/// body's side, so roundness is no evidence then.
pub(super) fn round_log(range: Option<Range>, m: &Measured) -> f64 {
    let form = form_log(Some(Shape::Round), m);
    let Some(r) = range.filter(|_| m.round.is_some()) else { return diameter_log(range, WIDTHS, m) + form };
    let (value, sigma) = (2.0 * m.evidence.radius_m, diameter_sigma_m(m));
    let fits = (1.0 - ASTRAY) * within_density(value, sigma, r);
    let astray = ASTRAY * everyday_density(value, WIDTHS);
    log_sum(&[fits.max(LEAST_DENSITY).ln() + form, astray.max(LEAST_DENSITY).ln() + form.min(LEAST_FORM)])
}

pub(super) fn diameter_sigma_m(m: &Measured) -> f64 {
    /// Minimum standard deviation of a diameter, however good the camera, metres. From: chosen.
    const LEAST_M: f64 = 0.003;
    (2.0 * m.evidence.radius_sigma_m).hypot(LEAST_M)
}

pub(super) fn taper_log(range: Option<Range>, m: &Measured) -> f64 {
    let (taper, sigma) = taper(m);
    measure_log(taper, sigma, range, TAPERS)
}

/// Log probability that the taper lies outside a range by more than a margin, for look-alikes with
/// another taper.
pub(super) fn other_taper_log(range: Range, margin: f64, m: &Measured) -> f64 {
    let (taper, sigma) = taper(m);
    (1.0 - inside(taper, sigma, Range { low: range.low - margin, high: range.high + margin }))
        .max(STRANGER)
        .ln()
}

/// Taper and its standard deviation.
fn taper(m: &Measured) -> (f64, f64) {
    /// Taper and its standard deviation if no circle fits. From: chosen.
    const UNKNOWN: (f64, f64) = (1.0, 0.2);
    let Some(round) = m.round else { return UNKNOWN };
    let sigma = m.height_m * round.slope_sigma / round.radius_m.max(EDGE_M);
    (m.evidence.taper, sigma.hypot(RATIO_SIGMA))
}

/// Standard deviation of a measured side of a footprint, metres.
fn side_sigma_m(m: &Measured) -> f64 {
    EDGE_M.hypot(2.0 * m.sigma_m)
}

/// Log density of the footprint of an object that is no known box: one side only, as for a round
/// body, so that densities of equal dimension are compared.
pub(super) fn sides_log(m: &Measured) -> f64 {
    measure_log(m.footprint.sides_m[0], side_sigma_m(m), None, WIDTHS)
        + measure_log(1.0, RATIO_SIGMA, None, TAPERS)
}

/// Log density of both sides of a known box from the rays, with either side the longer.
pub(super) fn box_sides_log(sides: Option<(Range, Range)>, m: &Measured) -> f64 {
    let known = |range: Range| {
        move |side: &Side| {
            let astray = ASTRAY * everyday_density(side.likeliest_m(), WIDTHS);
            (1.0 - ASTRAY) * side.mean(range) / SIDE_UNIT_M + astray
        }
    };
    let none = || both_sides_log(m, [|_: &Side| LEAST_DENSITY; 2]);
    sides.map_or_else(none, |(width, depth)| both_sides_log(m, [known(width), known(depth)]))
}

/// Log density of both sides for look-alikes; `sides`: median, metres, and log-normal spread of
/// each.
pub(super) fn alike_sides_log(sides: [(f64, f64); 2], m: &Measured) -> f64 {
    both_sides_log(
        m,
        sides.map(|alike| {
            move |side: &Side| {
                let longer = 1.0 - normal_cdf((side.longest_m() / alike.0).ln() / alike.1);
                side.sum(|length_m| everyday_density(length_m, alike), longer) / SIDE_UNIT_M
            }
        }),
    )
}

/// Divisor that turns the likelihood of a length into a density, metres. From: derived, the
/// integral of one whose spread is that of an edge.
const SIDE_UNIT_M: f64 = EDGE_M * BELL;

/// Log density of both sides, either of which may be the first; the minimum without ray evidence of
/// the sides.
fn both_sides_log(m: &Measured, [one, other]: [impl Fn(&Side) -> f64; 2]) -> f64 {
    let Some([a, b]) = &m.sides else { return 2.0 * LEAST_DENSITY.ln() };
    let log = |density: f64| density.max(LEAST_DENSITY).ln();
    0.5_f64.ln() + log_sum(&[log(one(a)) + log(other(b)), log(one(b)) + log(other(a))])
}

/// Minimum log likelihood of a form, because the forms' simplifications (rounded boxes, bulging
/// cups) limit their evidence. From: chosen.
const LEAST_FORM: f64 = -12.0;

/// Log likelihood of a form of the side relative to the best form, with evidence that the side
/// exists; `None` is a form neither round nor a box.
pub(super) fn form_log(shape: Option<Shape>, m: &Measured) -> f64 {
    /// Slope of the log likelihood over the seen-through share of the side, and the share that may
    /// be accidental. From: chosen.
    const THROUGH: (f64, f64) = (-60.0, 0.15);
    let all = [Some(Shape::Round), Some(Shape::Box), None].map(|s| raw_form_log(s, m));
    let best = all.into_iter().fold(miss_log(m.rival_m, m), f64::max);
    // However round what is there: a camera that looked through the rest of the side says that it is not.
    let through = match shape {
        Some(Shape::Round) => THROUGH.0 * (m.looked_through - THROUGH.1).max(0.0),
        _ => 0.0,
    };
    let beside = if shape == Some(Shape::Round) { beside_log(m) } else { 0.0 };
    (raw_form_log(shape, m) - best).max(LEAST_FORM) + through + beside
}

/// Log likelihood of points beside the side: a round body has only a handle there, and the blur of
/// the views.
fn beside_log(m: &Measured) -> f64 {
    let Some(round) = m.round else { return 0.0 };
    let beside_m = (m.footprint.sides_m[0] - 2.0 * round.radius_m - HANDLE_M.1).max(0.0);
    -0.5 * (beside_m / APART_M).powi(2)
}

fn raw_form_log(shape: Option<Shape>, m: &Measured) -> f64 {
    let miss = match shape {
        Some(Shape::Round) => m.round.map_or(APART_M, |r| r.spread_m),
        Some(Shape::Box) => m.rectangle.map_or(APART_M, |r| r.residual_m),
        None => PLACE_M,
    };
    miss_log(miss, m)
}

/// Log likelihood of a form from which the side's points have the root mean square distance
/// `miss_m`, metres.
fn miss_log(miss_m: f64, m: &Measured) -> f64 {
    /// Minimum error of a form, as a share of the spread of a measurement. From: chosen.
    const OF_SIGMA: f64 = 0.7;
    let apart = m.apart_m();
    let floor = SHAPE_M.hypot(OF_SIGMA * m.sigma_m).hypot(apart);
    // What lies beside each other by an error that whole views share tells the same again and again.
    let independent = m.independent / (1.0 + (apart / EDGE_M).powi(2));
    -independent * miss_m.hypot(floor).ln()
}

pub(super) fn top_log(top: Top, m: &Measured) -> f64 {
    /// Probability that a lid or an inside is missed, or falsely seen. From: chosen.
    const ASTRAY_TOP: f64 = 0.01;
    let open = ASTRAY_TOP + (1.0 - 2.0 * ASTRAY_TOP) / (1.0 + (-m.upper.open_log).exp());
    match top {
        Top::Open => open.ln(),
        Top::Closed => (1.0 - open).ln(),
        Top::Any => 0.5_f64.ln(),
    }
}

pub(super) fn handle_log(handle: Handle, m: &Measured) -> f64 {
    /// Reaches of a protrusion, metres: below the first it may be an artefact of misaligned views
    /// of a side; from the second it is a handle. From: chosen, the first is the least reach of a
    /// handle.
    const REACHES_M: (f64, f64) = (HANDLE_M.0, 0.022);
    /// Probability that a handle in view is missed. From: chosen.
    const MISSED: f64 = 0.04;
    /// Probability that a handle in view is found. From: chosen.
    const FOUND: f64 = 0.9;
    /// Probability that a handle is found wherever it is, even out of view. From: chosen.
    const STRAY: f64 = 0.02;
    /// Probabilities, for an object without a handle, that none is found and that one is found.
    /// From: chosen.
    const NEITHER: (f64, f64) = (0.99, 0.01);
    let unseen = m.evidence.handle_unseen.clamp(0.0, 1.0);
    let sure = match m.evidence.handle {
        Sighting::Seen => (m.evidence.protrusion_m - REACHES_M.0) / (REACHES_M.1 - REACHES_M.0),
        _ => 0.0,
    };
    let between = |no: f64, yes: f64| no * (yes / no).powf(sure.clamp(0.0, 1.0));
    // A handle that is there is missed in view now and then; out of view always.
    let with = between(unseen + (1.0 - unseen) * MISSED, FOUND * (1.0 - unseen) + STRAY);
    let without = between(NEITHER.0, NEITHER.1);
    match handle {
        Handle::One => with.ln(),
        Handle::None => without.ln(),
        Handle::Any => (0.5 * (with + without)).ln(),
    }
}

fn everyday_density(value: f64, (median, spread): (f64, f64)) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    normal_density((value / median).ln(), spread) / value
}

fn normal_density(x: f64, sigma: f64) -> f64 {
    (-0.5 * (x / sigma).powi(2)).exp() / (sigma * std::f64::consts::TAU.sqrt())
}

pub(super) fn log_sum(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.iter().map(|l| (l - most).exp()).sum::<f64>().ln()
}
