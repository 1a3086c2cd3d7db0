//! Our recogniser: which hypothesis makes most likely what was measured, given what could be measured.
//!
//! Every known object and every family of things that are none of them is a hypothesis with a likelihood for size, form,
//! upper end and handle. A feature that was not in view has the same likelihood under all of them, so that doubt stays.

use super::Recogniser;
use super::evidence::{HANDLE_M, Measured, Setting, measure};
use super::model::{Handle, ObjectModel, Range, Shape, Top};
use super::percept::{Percept, Sighting, Stance};
use super::toppled::Toppled;
use super::verify::Own;
use crate::noise::{KINECT, Residuals, Sensor, normal_cdf};
use crate::segment::{Scene, Segment};
use crate::visibility::Visibility;
use nalgebra::Point3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Our recogniser with its few numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Descry {
    /// Probability before looking that an object on a table is one of the models. From: chosen.
    pub known: f64,
    /// How many things made like a known object but for one feature (a handle, a lid, flat sides, a taper) there are for each of it:
    /// what has not been seen of that feature stays in doubt. From: fitted, with the chance of standing upside down, on
    /// 100 simulated arrangements: Brier score .0090, and .0098 with 1.5 and .03; no other values were compared.
    pub look_alikes: f64,
    /// Probability that a known object stands upside down. From: fitted, with the look-alikes.
    pub upside_down: f64,
    /// How probable it is that a round thing lies on its side, for each that stands. From: chosen, as upside down.
    pub lying: f64,
    /// Least probability with which a percept carries a model's name. From: chosen, likelier than not.
    pub least: f64,
    /// Exponent on the likelihoods of sizes and form: below 1 softens them for what the model of the measurements leaves out. From: chosen.
    pub temper: f64,
    /// Exponent on how much less likely rays find a known object than what was measured: real things differ from their models.
    /// From: chosen.
    pub verified: f64,
}

impl Default for Descry {
    fn default() -> Self {
        Descry {
            known: 0.5,
            look_alikes: 1.0,
            upside_down: 0.02,
            lying: 0.02,
            least: 0.5,
            temper: 0.7,
            verified: 0.3,
        }
    }
}

/// A family of everyday things: its share, form, upper end and handle. Sizes are broad.
struct Family {
    share: f64,
    shape: Option<Shape>,
    top: Top,
    handle: Handle,
    /// Median and log-normal spread of height and width, metres.
    height: (f64, f64),
    width: (f64, f64),
}

/// What stands on tables besides the known objects: a census guess that only sets how sceptical we start.
/// From: chosen, a guess; nothing was counted.
const FAMILIES: [Family; 5] = [
    Family {
        share: 0.35,
        shape: Some(Shape::Box),
        top: Top::Closed,
        handle: Handle::None,
        height: HEIGHTS,
        width: WIDTHS,
    },
    // Tins, jars and bottles are made for the hand.
    Family {
        share: 0.22,
        shape: Some(Shape::Round),
        top: Top::Closed,
        handle: Handle::None,
        height: (0.12, 0.5),
        width: (0.075, 0.35),
    },
    Family {
        share: 0.08,
        shape: Some(Shape::Round),
        top: Top::Open,
        handle: Handle::None,
        height: (0.10, 0.5),
        width: (0.10, 0.5),
    },
    Family {
        share: 0.10,
        shape: Some(Shape::Round),
        top: Top::Open,
        handle: Handle::One,
        height: (0.10, 0.4),
        width: (0.085, 0.35),
    },
    Family { share: 0.25, shape: None, top: Top::Any, handle: Handle::Any, height: HEIGHTS, width: WIDTHS },
];

impl Recogniser for Descry {
    fn name(&self) -> &'static str {
        "descry"
    }

    fn recognise(&self, scene: &Scene, seen: &Visibility, models: &[ObjectModel]) -> Vec<Percept> {
        let _span = tracing::debug_span!("recognise", segments = scene.segments.len()).entered();
        let setting = Setting::of(scene, fitted(scene, seen));
        let judge = |segment| self.judge(&setting, segment, seen, models);
        // Some take far longer than others.
        scene.segments.par_iter().with_max_len(1).map(judge).collect()
    }
}

/// The sensor that errs as what the cameras show of the surface.
fn fitted(scene: &Scene, seen: &Visibility) -> Sensor {
    let mut residuals = Residuals::default();
    seen.maps.iter().for_each(|map| residuals.add(map, &scene.surface));
    residuals.fit(&KINECT)
}

/// How probable each model is, and its likelier stance.
struct Weighed {
    probabilities: Vec<f64>,
    stances: Vec<Stance>,
}

/// A model that is less probable than this by cheap measures is not worth asking rays about. From: chosen.
const DOUBT: f64 = 0.1;

impl Descry {
    fn judge(
        &self,
        setting: &Setting,
        segment: &Segment,
        seen: &Visibility,
        models: &[ObjectModel],
    ) -> Percept {
        let mut looked = measure(setting, segment, seen);
        let toppled = Toppled::of(setting, segment, seen, &looked.measured, models);
        if let Some(toppled) = &toppled {
            looked.measured.rival_m = toppled.spread_m();
        }
        let mut weighed =
            self.weigh(models, &looked.measured, toppled.as_ref(), &vec![[0.0; 3]; models.len()]);
        let doubted: Vec<bool> = weighed.probabilities.iter().map(|p| *p > DOUBT).collect();
        if self.verified > 0.0 && doubted.contains(&true) {
            let own = Own::of(&looked.rays, &looked.measured, segment.base_m);
            let lying = toppled.as_ref().map(|toppled| toppled.own(&looked.measured));
            let against = |(m, stance): (&ObjectModel, &Stance)| {
                let lies =
                    lying.as_ref().map(|ways| ways.each_ref().map(|way| way.log_against(m, Stance::Upright)));
                let [foot, rim] = lies.unwrap_or_default();
                [own.log_against(m, *stance), foot, rim].map(|log| self.verified * log)
            };
            let each = models.iter().zip(&weighed.stances).zip(doubted);
            let against: Vec<[f64; 3]> =
                each.map(|(asked, doubted)| if doubted { against(asked) } else { [0.0; 3] }).collect();
            weighed = self.weigh(models, &looked.measured, toppled.as_ref(), &against);
        }
        let Weighed { probabilities, stances } = weighed;
        let unknown = 1.0 - probabilities.iter().sum::<f64>();
        let best =
            (0..models.len()).max_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]).then(b.cmp(&a)));
        let named = best.filter(|&b| probabilities[b] >= self.least);
        let probabilities = models.iter().zip(probabilities).map(|(m, p)| (m.name.clone(), p)).collect();
        percept(setting.scene, segment, looked.measured, models, named, stances, probabilities, unknown)
    }

    /// How probable each model is, and how it stands; `against` is the log of what else speaks against each as it stands, and as it lies
    /// either way.
    fn weigh(
        &self,
        models: &[ObjectModel],
        measured: &Measured,
        toppled: Option<&Toppled>,
        against: &[[f64; 3]],
    ) -> Weighed {
        let each = self.known / models.len().max(1) as f64;
        let mut stances = vec![Stance::Upright; models.len()];
        let log = |model: &ObjectModel, stance: Stance| self.model_log(model, stance, measured);
        let logs: Vec<f64> = models
            .iter()
            .zip(&mut stances)
            .zip(against)
            .map(|((model, stance), [against, lying @ ..])| {
                let up = (1.0 - self.upside_down).ln() + log(model, Stance::Upright);
                let down = self.upside_down.ln() + log(model, Stance::UpsideDown);
                if down > up {
                    *stance = Stance::UpsideDown;
                }
                let stands = each.ln() + log_sum(&[up, down]) + against;
                let lies = self.lying_logs(toppled, |m| self.model_log(model, Stance::Upright, m));
                let lies: Vec<f64> =
                    lies.iter().zip(lying).map(|(log, against)| each.ln() + log + against).collect();
                if lies.iter().any(|log| *log > stands) {
                    *stance = Stance::Lying;
                }
                log_sum(&[&[stands], lies.as_slice()].concat())
            })
            .collect();
        let families = FAMILIES.iter().flat_map(|family| {
            let share = ((1.0 - self.known) * family.share).ln();
            let log = |m: &Measured| share + stranger_log(family, models, m) + self.family_log(family, m);
            // What has no axis is the same however it lies.
            let lies = match family.shape {
                Some(Shape::Round) => self.lying_logs(toppled, log),
                _ => Vec::new(),
            };
            std::iter::once(log(measured)).chain(lies)
        });
        let alike = models.iter().flat_map(|model| {
            let share = (each * self.look_alikes).ln();
            let log = |m: &Measured| share + self.look_alike_log(model, models, m);
            let lies = match model.shape {
                Shape::Round => self.lying_logs(toppled, log),
                Shape::Box => Vec::new(),
            };
            std::iter::once(log(measured)).chain(lies)
        });
        let rest: Vec<f64> = families.chain(alike).collect();
        let total = log_sum(&[logs.as_slice(), &rest].concat());
        let share = |log: &f64| if total.is_finite() { (log - total).exp() } else { 0.0 };
        Weighed { probabilities: logs.iter().map(share).collect(), stances }
    }

    /// Log likelihoods of what may lie, with either end for its foot, which is closed; none if it cannot lie.
    fn lying_logs(&self, toppled: Option<&Toppled>, log: impl Fn(&Measured) -> f64) -> Vec<f64> {
        let Some(toppled) = toppled else { return Vec::new() };
        let ways = toppled.ways.each_ref().map(|way| &way.measured);
        let way =
            |rim: &Measured, foot: &Measured| (0.5 * self.lying).ln() + log(rim) + top_log(Top::Closed, foot);
        vec![way(ways[0], ways[1]), way(ways[1], ways[0])]
    }

    fn model_log(&self, model: &ObjectModel, stance: Stance, m: &Measured) -> f64 {
        let size = height_log(Some(model.height_m), HEIGHTS, m);
        let (top, taper) = match (stance, model.top) {
            (Stance::UpsideDown, _) => {
                (Top::Closed, Range { low: 1.0 / model.taper.high, high: 1.0 / model.taper.low })
            }
            (_, top) => (top, model.taper),
        };
        let wide = match model.shape {
            Shape::Round => round_log(model.diameter_m, m) + taper_log(Some(taper), m),
            Shape::Box => sides_log(model.width_m.zip(model.depth_m), m) + form_log(Some(Shape::Box), m),
        };
        self.temper * (size + wide) + top_log(top, m) + handle_log(model.handle, m)
    }

    /// The things made like a model but for one feature; sizes are like the model's within a tenth.
    fn look_alike_log(&self, model: &ObjectModel, models: &[ObjectModel], m: &Measured) -> f64 {
        /// How alike: by so much of a size, or of a taper, things made like a known one differ. From: chosen.
        const ALIKE: f64 = 0.1;
        /// What a range is wider than its standard deviation by. From: derived, the root of 12, as of any uniform distribution.
        const UNIFORM: f64 = 3.46;
        /// Shares of things alike: with a handle, with a lid, with flat sides, of another taper, of other sides. From: chosen, a guess.
        const HANDLED: f64 = 0.5;
        const LIDDED: f64 = 0.3;
        const FLAT: f64 = 0.2;
        const TAPERED: f64 = 0.3;
        const LONGER: f64 = 0.3;
        let near = |r: Range| (r.middle(), ALIKE.hypot((r.high / r.low).ln() / UNIFORM));
        let height = near(model.height_m);
        let width = model.diameter_m.or(model.width_m).map_or(WIDTHS, near);
        let family = |share: f64, shape: Shape, top: Top, handle: Handle| {
            let family = Family { share, shape: Some(shape), top, handle, height, width };
            share.ln() + stranger_log(&family, models, m) + self.family_log(&family, m)
        };
        let mut logs = Vec::new();
        if model.handle == Handle::None {
            logs.push(family(HANDLED, model.shape, model.top, Handle::One));
        }
        if model.top != Top::Closed {
            logs.push(family(LIDDED, model.shape, Top::Closed, Handle::None));
        }
        if model.shape == Shape::Round {
            logs.push(family(FLAT, Shape::Box, Top::Closed, Handle::None));
            logs.push(
                family(TAPERED, Shape::Round, model.top, model.handle)
                    + other_taper_log(model.taper, ALIKE, m),
            );
        }
        if let Some(sides) = model.width_m.zip(model.depth_m).filter(|_| model.shape == Shape::Box) {
            // Cartons come in all sizes: one that is a little longer or lower is another.
            let metric = height_log(None, height, m)
                + alike_sides_log([near(sides.0), near(sides.1)], m)
                + form_log(Some(Shape::Box), m);
            logs.push(
                LONGER.ln() + self.temper * metric + top_log(model.top, m) + handle_log(model.handle, m),
            );
        }
        log_sum(&logs)
    }

    fn family_log(&self, family: &Family, m: &Measured) -> f64 {
        let wide = match family.shape {
            Some(Shape::Round) => diameter_log(None, family.width, m) + taper_log(None, m),
            _ => sides_log(None, m),
        };
        let metric = height_log(None, family.height, m) + wide + form_log(family.shape, m);
        self.temper * metric + top_log(family.top, m) + handle_log(family.handle, m)
    }
}

/// Standard deviation of where a thing stands that no circle fits, metres, and what it is for others at the least. From: chosen.
pub(super) const UNPLACED_SIGMA_M: f64 = 0.02;
const LEAST_PLACE_SIGMA_M: f64 = 0.001;
/// No density and no chance is taken to be less. From: chosen.
const LEAST_DENSITY: f64 = 1e-12;
const LEAST_CHANCE: f64 = 1e-6;
/// Share of a family's things of the measured size that are of a known kind all the same, at the least. From: chosen.
const STRANGER: f64 = 0.05;

/// Log of the chance that a thing of a family, as measured, is of none of the known kinds.
fn stranger_log(family: &Family, models: &[ObjectModel], m: &Measured) -> f64 {
    let known = models.iter().map(|model| covers(model, family, m)).fold(0.0, f64::max);
    (1.0 - known).max(STRANGER).ln()
}

/// The chance that a thing of a family, as measured, is just what a model of a kind describes, so that it is no stranger:
/// of the same make, and its sizes within the model's ranges. A single object, without ranges, describes no others.
fn covers(model: &ObjectModel, family: &Family, m: &Measured) -> f64 {
    let same_make =
        family.shape == Some(model.shape) && model.top == family.top && model.handle == family.handle;
    let Some(width) = model.diameter_m.filter(|_| same_make && m.round.is_some() && !m.top_hidden) else {
        return 0.0;
    };
    inside(m.height_m, m.height_sigma_m, model.height_m)
        * inside(2.0 * m.evidence.radius_m, diameter_sigma_m(m), width)
}

/// The chance that what was measured lies within a range; none for a single value.
fn inside(value: f64, sigma: f64, r: Range) -> f64 {
    normal_cdf((value - r.low) / sigma) - normal_cdf((value - r.high) / sigma)
}

#[allow(clippy::too_many_arguments)]
fn percept(
    scene: &Scene,
    segment: &Segment,
    measured: Measured,
    models: &[ObjectModel],
    named: Option<usize>,
    stances: Vec<Stance>,
    probabilities: Vec<(String, f64)>,
    unknown: f64,
) -> Percept {
    let kinds = kinds(models, &probabilities);
    let stance = named.map_or(Stance::Unknown, |i| stances[i]);
    let stands = measured.round.filter(|_| stance != Stance::Lying);
    let round_fits =
        stands.filter(|_| form_log(Some(Shape::Round), &measured) > form_log(Some(Shape::Box), &measured));
    let (x, y) = round_fits.map_or((measured.middle[0], measured.middle[1]), |r| (r.x, r.y));
    let sigma = round_fits.map_or(UNPLACED_SIGMA_M, |r| r.place_sigma_m.max(LEAST_PLACE_SIGMA_M));
    Percept {
        label: named.map(|i| models[i].name.clone()),
        kind: named.map(|i| models[i].kind.clone()),
        probabilities,
        kinds,
        unknown: unknown.max(0.0),
        position_m: scene.surface.surface_from_world.inverse() * Point3::new(x, y, segment.base_m),
        position_sigma_m: sigma,
        size_m: [measured.footprint_m[0], measured.footprint_m[1], measured.height_m],
        stance,
        points: segment.indices.len(),
        seen_fraction: measured.seen_fraction,
        evidence: measured.evidence,
        indices: segment.indices.clone(),
    }
}

/// Sums the models' probabilities by kind, in order of first mention.
pub(super) fn kinds(models: &[ObjectModel], probabilities: &[(String, f64)]) -> Vec<(String, f64)> {
    let mut kinds: Vec<(String, f64)> = Vec::new();
    for (model, (_, p)) in models.iter().zip(probabilities) {
        match kinds.iter_mut().find(|(kind, _)| *kind == model.kind) {
            Some((_, sum)) => *sum += p,
            None => kinds.push((model.kind.clone(), *p)),
        }
    }
    kinds
}

/// How often a measurement goes wrong altogether: flat tails.
/// From: chosen, a tenth of it was tried, and with it a real mug that narrows was no mug.
const ASTRAY: f64 = 0.002;

/// Density of a measure under a range: a uniform, blurred by the measurement.
fn within_density(value: f64, sigma: f64, r: Range) -> f64 {
    /// Of the spread of a measurement: a range that is no wider is a single value. From: chosen.
    const NARROW: f64 = 0.2;
    let width = r.high - r.low;
    if width > NARROW * sigma {
        inside(value, sigma, r) / width
    } else {
        normal_density(value - r.middle(), sigma)
    }
}

/// Log density of a measure under a range (uniform, blurred by the measurement) or, without one, under everyday sizes (log-normal).
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
const HEIGHTS: (f64, f64) = (0.11, 0.6);
/// The same of their widths. From: chosen, a guess; nothing was measured.
const WIDTHS: (f64, f64) = (0.10, 0.6);
/// The same of their tapers, which have no unit. From: chosen, a guess; nothing was measured.
const TAPERS: (f64, f64) = (0.95, 0.25);
/// What is left of the error of a taper however well the side is measured. From: chosen.
const RATIO_SIGMA: f64 = 0.05;

fn height_log(range: Option<Range>, everyday: (f64, f64), m: &Measured) -> f64 {
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

fn diameter_log(range: Option<Range>, everyday: (f64, f64), m: &Measured) -> f64 {
    if m.round.is_none() {
        /// How well a footprint tells a diameter, metres. From: chosen.
        const SIGMA_M: f64 = 0.02;
        // No circle fits; were it round, its footprint would be its diameter.
        return measure_log(m.footprint_m[0], SIGMA_M, range, everyday);
    }
    measure_log(2.0 * m.evidence.radius_m, diameter_sigma_m(m), range, everyday)
}

/// Diameter and form of a round body together: a circle that is not as wide as the body is no circle of its side, and then its
/// roundness says nothing for it.
fn round_log(range: Option<Range>, m: &Measured) -> f64 {
    let form = form_log(Some(Shape::Round), m);
    let Some(r) = range.filter(|_| m.round.is_some()) else { return diameter_log(range, WIDTHS, m) + form };
    let (value, sigma) = (2.0 * m.evidence.radius_m, diameter_sigma_m(m));
    let fits = (1.0 - ASTRAY) * within_density(value, sigma, r);
    let astray = ASTRAY * everyday_density(value, WIDTHS);
    log_sum(&[fits.max(LEAST_DENSITY).ln() + form, astray.max(LEAST_DENSITY).ln() + form.min(LEAST_FORM)])
}

fn diameter_sigma_m(m: &Measured) -> f64 {
    /// What is left of the error however good the camera, metres. From: chosen.
    const LEAST_M: f64 = 0.003;
    (2.0 * m.evidence.radius_sigma_m).hypot(LEAST_M)
}

fn taper_log(range: Option<Range>, m: &Measured) -> f64 {
    let (taper, sigma) = taper(m);
    measure_log(taper, sigma, range, TAPERS)
}

/// Log of the chance that the taper lies outside a range by more than a margin: a thing that is alike but for its side.
fn other_taper_log(range: Range, margin: f64, m: &Measured) -> f64 {
    let (taper, sigma) = taper(m);
    (1.0 - inside(taper, sigma, Range { low: range.low - margin, high: range.high + margin }))
        .max(STRANGER)
        .ln()
}

/// The taper and its standard deviation.
fn taper(m: &Measured) -> (f64, f64) {
    /// Of what no circle fits. From: chosen.
    const UNKNOWN: (f64, f64) = (1.0, 0.2);
    /// No radius is less, metres. From: chosen.
    const LEAST_M: f64 = 0.005;
    let Some(round) = m.round else { return UNKNOWN };
    let sigma = m.height_m * round.slope_sigma / round.radius_m.max(LEAST_M);
    (m.evidence.taper, sigma.hypot(RATIO_SIGMA))
}

/// Spread of a measured side of a footprint, metres.
fn side_sigma_m(m: &Measured) -> f64 {
    /// What is left of the error however good the camera, metres. From: chosen.
    const LEAST_M: f64 = 0.005;
    LEAST_M.hypot(2.0 * m.sigma_m)
}

/// A footprint is measured only as far as it was seen: a side may be longer than it looks.
fn sides_log(ranges: Option<(Range, Range)>, m: &Measured) -> f64 {
    let sigma = side_sigma_m(m);
    match ranges {
        Some((width, depth)) => {
            measure_log(m.footprint_m[0], sigma, Some(width), WIDTHS)
                + measure_log(m.footprint_m[1], sigma, Some(depth), WIDTHS)
        }
        // One side only, as for a round body: densities of as many measures must be compared.
        None => {
            measure_log(m.footprint_m[0], sigma, None, WIDTHS) + measure_log(1.0, RATIO_SIGMA, None, TAPERS)
        }
    }
}

/// The same for the sides of things alike: median and log-normal spread of the longer and of the shorter, blurred by the measurement.
fn alike_sides_log(near: [(f64, f64); 2], m: &Measured) -> f64 {
    let sides = m.footprint_m.iter().zip(near);
    sides
        .map(|(side, (median, spread))| {
            measure_log(*side, side_sigma_m(m), None, (median, spread.hypot(side_sigma_m(m) / median)))
        })
        .sum()
}

/// However many points: what the forms leave out (rounded boxes, bulging cups) bounds what they tell. From: chosen.
const LEAST_FORM: f64 = -12.0;

/// How well the side keeps to the form, against the form it keeps to best, and whether it is there at all. `None` is a form that is
/// neither round nor a box.
fn form_log(shape: Option<Shape>, m: &Measured) -> f64 {
    /// Log by which each share of the side that was looked through, beyond what may be an accident, speaks against it. From: chosen.
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

/// However well a circle fits a part of the side: a round body has nothing beside it but a handle, and what views blur.
fn beside_log(m: &Measured) -> f64 {
    /// So far a handle, or views that lie beside each other, reach out of the body, metres. From: chosen.
    const REACH_M: f64 = 0.04;
    /// Spread of how far beyond that what belongs to the body reaches, metres. From: chosen.
    const SIGMA_M: f64 = 0.01;
    /// However far something reaches out, it may be a view that lies wrongly: no log is lower. From: chosen.
    const LEAST: f64 = -20.0;
    let Some(round) = m.round else { return 0.0 };
    let beside_m = (m.footprint_m[0] - 2.0 * round.radius_m - REACH_M).max(0.0);
    (-0.5 * (beside_m / SIGMA_M).powi(2)).max(LEAST)
}

fn raw_form_log(shape: Option<Shape>, m: &Measured) -> f64 {
    /// Irregular things miss both forms by about this much, metres. From: chosen.
    const IRREGULAR_M: f64 = 0.006;
    /// The miss of what no circle fits at all. From: chosen.
    const NONE_M: f64 = 0.02;
    let miss = match shape {
        Some(Shape::Round) => m.round.map_or(NONE_M, |r| r.spread_m),
        Some(Shape::Box) => m.rectangle.map_or(NONE_M, |r| r.residual_m),
        None => IRREGULAR_M,
    };
    miss_log(miss, m)
}

/// Log likelihood of a side that misses a form by so much, metres.
fn miss_log(miss_m: f64, m: &Measured) -> f64 {
    /// Views that lie so far apart tell a form half as sharply as they would if only the noise of each point counted, metres. From: chosen.
    const SHARED_M: f64 = 0.003;
    /// No form is measured more sharply than this, metres, and this share of the spread of a measurement. From: chosen.
    const SHARPEST_M: f64 = 0.0015;
    const OF_SIGMA: f64 = 0.7;
    let apart = m.apart_m();
    let floor = SHARPEST_M.hypot(OF_SIGMA * m.sigma_m).hypot(apart);
    // What lies beside each other by an error that whole views share tells the same again and again.
    let independent = m.independent / (1.0 + (apart / SHARED_M).powi(2));
    -independent * miss_m.hypot(floor).ln()
}

fn top_log(top: Top, m: &Measured) -> f64 {
    /// A lid or an inside is missed, or seen where there is none, about this often. From: chosen.
    const ASTRAY_TOP: f64 = 0.01;
    let open = ASTRAY_TOP + (1.0 - 2.0 * ASTRAY_TOP) / (1.0 + (-m.upper.open_log).exp());
    match top {
        Top::Open => open.ln(),
        Top::Closed => (1.0 - open).ln(),
        Top::Any => 0.5_f64.ln(),
    }
}

fn handle_log(handle: Handle, m: &Measured) -> f64 {
    /// What sticks out no farther than the first is what views that lie beside each other leave of a side; as far as the second it is a
    /// handle, metres. From: chosen, the first is the least reach of a handle.
    const REACHES_M: (f64, f64) = (HANDLE_M.0, 0.022);
    /// How often a handle in view is missed and found, and one out of view is found all the same. From: chosen.
    const MISSED: f64 = 0.04;
    const FOUND: f64 = 0.9;
    const STRAY: f64 = 0.02;
    /// How often none is found where there is none, and one is. From: chosen.
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

fn log_sum(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.iter().map(|l| (l - most).exp()).sum::<f64>().ln()
}
