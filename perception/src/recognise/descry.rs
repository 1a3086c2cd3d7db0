//! Our recogniser: compares hypotheses by the likelihood of the measurements, given their
//! visibility.
//!
//! Every known object, and every family of other everyday objects, is a hypothesis with a
//! likelihood for size, form, upper end and handle. A feature out of view has the same likelihood
//! under every hypothesis, so that doubt stays.

use super::Recogniser;
use super::evidence::{Looked, Measured, Setting, measure, rays_around};
use super::likelihood::{
    HEIGHTS, WIDTHS, alike_sides_log, box_sides_log, diameter_log, form_log, handle_log, height_log, log_sum,
    other_taper_log, round_log, sides_log, taper_log, top_log,
};
use super::model::{Handle, ObjectModel, Range, Shape, Top};
use super::necked::{self, Necked};
use super::parting::{Held, Standing, parted_log, within_log};
use super::percept::{Percept, Stance, kinds};
use super::rays::PIXELS;
use super::resting::{self, Resting};
use super::stranger::stranger_log;
use super::toppled::Toppled;
use super::verify::Own;
use crate::noise::{KINECT, Residuals, Sensor};
use crate::pool;
use crate::scale::APART_M;
use crate::segment::{Scene, Segment, middle};
use crate::surface::nearest_sigma_m;
use crate::visibility::Visibility;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// Our recogniser with its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Descry {
    /// Prior probability that an object on a table is one of the models. From: chosen.
    pub known: f64,
    /// Expected number of objects that differ from a known one in one feature (handle, lid, flat
    /// sides, taper), per known object; an unseen feature stays in doubt. From: fitted, with the
    /// chance of standing upside down, on 100 simulated arrangements: Brier score .0090, and .0098
    /// with 1.5 and .03; no other values were compared.
    pub look_alikes: f64,
    /// Probability that a known object stands upside down. From: fitted, with the look-alikes.
    pub upside_down: f64,
    /// Odds of a round object lying on its side rather than standing; five times higher for closed
    /// ones. From: chosen, as upside down.
    pub lying: f64,
    /// Minimum probability at which a percept is labelled with a model's name. From: chosen,
    /// likelier than not.
    pub least: f64,
    /// Exponent on the likelihoods of sizes and form; below 1 it softens them for effects outside
    /// the measurement model. From: chosen.
    pub temper: f64,
    /// Exponent on the likelihood ratios from rays, of a known object or of a box's lengths,
    /// against the object's own measures: real objects differ from their models. From: chosen.
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

/// Family of everyday objects: prior share, form, upper end and handle, with broad sizes.
pub(super) struct Family {
    share: f64,
    /// Form of the body; `None` is neither round nor a box.
    pub(super) shape: Option<Shape>,
    pub(super) top: Top,
    pub(super) handle: Handle,
    /// Median, metres, and log-normal spread of the height.
    height: (f64, f64),
    /// Median, metres, and log-normal spread of the width.
    width: (f64, f64),
}

/// Families of objects on tables besides the known ones: a prior that only sets the initial
/// scepticism. From: chosen, a guess; nothing was counted.
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
        pool::within(tracing::debug_span!("recognise", segments = scene.segments.len()), || {
            let setting = Setting::of(scene, fitted(scene, seen), models);
            let judge = |segment: &Segment| self.judge(&setting, segment, seen, models);
            let percepts = pool::heaviest_first(&scene.segments, |segment| segment.indices.len(), judge);
            self.explained(&setting, seen, models, percepts)
        })
    }
}

impl Descry {
    /// Percepts after alternative explanations of each segment: a known body on or in another
    /// object, or a body with a neck.
    ///
    /// The percepts of an alternative replace those of the segment if the pixels are far likelier
    /// under the alternative, and if the alternative's body is more probably a known object than
    /// the whole segment is.
    fn explained(
        &self,
        setting: &Setting,
        seen: &Visibility,
        models: &[ObjectModel],
        percepts: Vec<Percept>,
    ) -> Vec<Percept> {
        let rounds = resting::Rounds::of(models);
        let viewpoints = seen.viewpoints();
        let segments = &setting.scene.segments;
        let world_from_surface = setting.scene.surface.surface_from_world.inverse();
        let other = |n: usize| {
            let (segment, percept) = (&segments[n], &percepts[n]);
            let [x, y] = middle(&segment.points);
            let sigma_m =
                nearest_sigma_m(&(world_from_surface * Point3::new(x, y, segment.base_m)), &viewpoints);
            let better = |all: Vec<Percept>| {
                let known = |p: &Vec<Percept>| p.first().map_or(0.0, Percept::known);
                (known(&all) > self.least.max(percept.known())).then_some(all)
            };
            let necked = necked::necked(setting.scene, n, models, sigma_m).and_then(|necked| {
                Some((better(vec![self.judge_necked(setting, &necked, seen, models)])?, necked.pieces))
            });
            if necked.is_some() {
                return necked;
            }
            if let Some(body) = within(setting, n, sigma_m, seen) {
                return Some((vec![self.judge(setting, &body, seen, models)], vec![n]));
            }
            let resting = resting::seek(segment, &rounds, sigma_m).into_iter();
            let parted = resting.map(|resting| self.judge_parts(setting, segment, &resting, seen, models));
            let parted = parted.filter(|parted| parted.log >= FAR);
            let Parted { body, rest, .. } =
                parted.max_by(|a, b| a.body.known().total_cmp(&b.body.known()))?;
            let all = better(vec![body.clone()]).map(|mut all| {
                all.push(rest);
                all
            });
            let all = all.unwrap_or_else(|| vec![percept.clone().at_least(&body)]);
            Some((all, vec![n]))
        };
        let others: Vec<usize> = (0..segments.len()).collect();
        let others = pool::map(&others, 1, |n| other(*n));
        let mut explained: Vec<Vec<Percept>> = percepts.into_iter().map(|percept| vec![percept]).collect();
        for (all, pieces) in others.into_iter().flatten() {
            pieces.iter().for_each(|&piece| explained[piece].clear());
            explained[pieces[0]] = all;
        }
        explained.into_iter().flatten().collect()
    }

    /// Judges both parts of a split segment: percepts, and log likelihood ratio of two bodies
    /// against one.
    fn judge_parts(
        &self,
        setting: &Setting,
        whole: &Segment,
        Resting { body, rest, is_within }: &Resting,
        seen: &Visibility,
        models: &[ObjectModel],
    ) -> Parted {
        let [own, upper, lower] = [whole, body, rest].map(|part| measure(setting, part, seen));
        let asker = setting.asker(whole, seen, &own.measured);
        let (place, half_m) = own.measured.footprint_reach();
        let rays =
            rays_around((place, half_m, PIXELS), whole, (&whole.points, &own.measured), &asker, setting);
        let held = Held {
            body: Standing::at(&upper.measured, body.base_m),
            holder: Standing::at(&lower.measured, rest.base_m),
            is_within: *is_within,
        };
        let log = parted_log(&rays, Standing::at(&own.measured, whole.base_m), held);
        let judge = |part, looked| self.judge_looked(setting, part, looked, seen, models);
        Parted { body: judge(body, upper), rest: judge(rest, lower), log }
    }

    /// Judges a body with a neck by the sizes of the whole body and the form of its part below the
    /// shoulder.
    fn judge_necked(
        &self,
        setting: &Setting,
        necked: &Necked,
        seen: &Visibility,
        models: &[ObjectModel],
    ) -> Percept {
        let mut measured = measure(setting, &necked.body, seen).measured;
        measured.height_m = necked.height_m;
        measured.evidence.taper = necked.taper;
        measured.upper = Default::default();
        measured.sides = None;
        let weighed = self.weigh(models, &measured, None, &vec![[0.0; 3]; models.len()]);
        self.named(setting, &necked.whole, measured, models, weighed)
    }
}

/// Segment `of` moved onto the bottom of the vessel around it; `None` unless the rays make that far
/// likelier than a foot on top of the vessel.
fn within(setting: &Setting, of: usize, sigma_m: f64, seen: &Visibility) -> Option<Segment> {
    let (body, vessel) = resting::in_vessel(setting.scene, of, sigma_m)?;
    let segments = &setting.scene.segments;
    let (segment, holder) = (&segments[of], &segments[vessel]);
    let [own, around] = [segment, holder].map(|part| measure(setting, part, seen).measured);
    let whole = segment.with(holder);
    let asker = setting.asker(&whole, seen, &own);
    let (place, half_m) = around.footprint_reach();
    let height_m = (segment.base_m + own.height_m - whole.base_m).max(around.height_m);
    let all = Measured { height_m, ..around.clone() };
    let rays = rays_around((place, half_m, PIXELS), &whole, (&whole.points, &all), &asker, setting);
    let stands = Standing::at(&own, segment.base_m);
    let on = Held { body: stands, holder: Standing::at(&around, holder.base_m), is_within: false };
    let within = Held { body: Standing { base_m: body.base_m, ..stands }, is_within: true, ..on };
    (within_log(&rays, within, on) >= FAR).then_some(body)
}

/// Sensor model whose noise is fitted to the residuals of the supporting surface.
fn fitted(scene: &Scene, seen: &Visibility) -> Sensor {
    let mut residuals = Residuals::default();
    seen.maps.iter().for_each(|map| residuals.add(map, &scene.surface));
    residuals.fit(&KINECT)
}

/// Expected number of objects that match a known object of stated colours in all but colour, per
/// such object. From: chosen, as many as have another handle.
const OTHER_COLOUR: f64 = 0.5;

/// Result of weighing the models, with one entry per model.
struct Weighed {
    /// Probability that the object is the model.
    probabilities: Vec<f64>,
    /// Probability that the object matches the model in all but colour.
    recoloured: Vec<f64>,
    /// Likeliest stance of the object if it is the model.
    stances: Vec<Stance>,
}

/// Probability from the measures above which a model is verified by rays too. From: chosen.
const DOUBT: f64 = 0.1;
/// Minimum log likelihood ratio of two bodies against one for splitting a segment. From: derived,
/// one more round body has five sizes, each told to one part in fifty.
const FAR: f64 = 20.0;

/// Percepts of both parts of a segment, and the log likelihood ratio of the parts against one body.
struct Parted {
    body: Percept,
    rest: Percept,
    log: f64,
}

/// Factor by which closed objects (tins, jars, rolls, boxes) lie on their side more often than open
/// ones. From: chosen.
const CLOSED_LIES: f64 = 5.0;

impl Descry {
    fn judge(
        &self,
        setting: &Setting,
        segment: &Segment,
        seen: &Visibility,
        models: &[ObjectModel],
    ) -> Percept {
        self.judge_looked(setting, segment, measure(setting, segment, seen), seen, models)
    }

    /// Judges a segment from its measures.
    fn judge_looked(
        &self,
        setting: &Setting,
        segment: &Segment,
        mut looked: Looked,
        seen: &Visibility,
        models: &[ObjectModel],
    ) -> Percept {
        for side in looked.measured.sides.iter_mut().flatten() {
            side.soften(self.verified);
        }
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
            let against = pool::each(models.len(), 1, |n| match doubted[n] {
                true => against((&models[n], &weighed.stances[n])),
                false => [0.0; 3],
            });
            weighed = self.weigh(models, &looked.measured, toppled.as_ref(), &against);
        }
        self.named(setting, segment, looked.measured, models, weighed)
    }

    fn named(
        &self,
        setting: &Setting,
        segment: &Segment,
        measured: Measured,
        models: &[ObjectModel],
        Weighed { probabilities, recoloured, stances }: Weighed,
    ) -> Percept {
        let unknown = 1.0 - probabilities.iter().sum::<f64>();
        let best =
            (0..models.len()).max_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]).then(b.cmp(&a)));
        let named = best.filter(|&b| probabilities[b] >= self.least);
        let of_kind = |(p, other): (&f64, &f64)| p + other;
        let of_kinds = probabilities.iter().zip(&recoloured).map(of_kind);
        let kinds = kinds(models, of_kinds);
        let probabilities = models.iter().zip(probabilities).map(|(m, p)| (m.name.clone(), p)).collect();
        percept(setting.scene, segment, measured, models, named, stances, (probabilities, kinds), unknown)
    }

    /// Weighs the models. `against`: for each model, log likelihood ratios from rays if it stands,
    /// and if it lies with either end as foot.
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
        let shaped: Vec<f64> = models
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
                let lies = lies.iter().zip(lying).map(|(log, against)| log + against);
                let lies = lies.chain(self.turned_logs(model, |turned| log(turned, Stance::Upright)));
                let lies: Vec<f64> = lies.map(|log| each.ln() + log).collect();
                if lies.iter().any(|log| *log > stands) {
                    *stance = Stance::Lying;
                }
                log_sum(&[&[stands], lies.as_slice()].concat())
            })
            .collect();
        let coloured = models.iter().zip(&shaped).map(|(model, shaped)| {
            let [own, other] = measured.painted.weigh(&model.colours);
            let stated = !model.colours.is_empty();
            (shaped + own, if stated { OTHER_COLOUR.ln() + shaped + other } else { f64::NEG_INFINITY })
        });
        let (logs, recoloured): (Vec<f64>, Vec<f64>) = coloured.unzip();
        let families = FAMILIES.iter().flat_map(|family| {
            let share = ((1.0 - self.known) * family.share).ln();
            let log = |m: &Measured| share + stranger_log(family, models, m) + self.family_log(family, m);
            // What has no axis is the same however it lies.
            let often = if family.top == Top::Closed { CLOSED_LIES.ln() } else { 0.0 };
            let lies = match family.shape {
                Some(Shape::Round) => self.lying_logs(toppled, |m| often + log(m)),
                _ => Vec::new(),
            };
            std::iter::once(log(measured)).chain(lies)
        });
        let alike = models.iter().flat_map(|model| {
            let share = (each * self.look_alikes).ln();
            let log = |m: &Measured, lids: f64| share + self.look_alike_log(model, models, m, lids);
            let lies = match model.shape {
                Shape::Round => self.lying_logs(toppled, |m| log(m, CLOSED_LIES)),
                Shape::Box => self
                    .turned_logs(model, |turned| share + self.look_alike_log(turned, models, measured, 1.0)),
            };
            std::iter::once(log(measured, 1.0)).chain(lies)
        });
        let rest: Vec<f64> = families.chain(alike).collect();
        let total = log_sum(&[logs.as_slice(), &rest, &recoloured].concat());
        let share = |log: &f64| if total.is_finite() { (log - total).exp() } else { 0.0 };
        let [probabilities, recoloured] = [logs, recoloured].map(|logs| logs.iter().map(share).collect());
        Weighed { probabilities, recoloured, stances }
    }

    /// Log likelihoods of a lying round object with either end as foot; empty if it cannot lie.
    fn lying_logs(&self, toppled: Option<&Toppled>, log: impl Fn(&Measured) -> f64) -> Vec<f64> {
        let Some(toppled) = toppled else { return Vec::new() };
        let ways = toppled.ways.each_ref().map(|way| &way.measured);
        let way =
            |rim: &Measured, foot: &Measured| (0.5 * self.lying).ln() + log(rim) + top_log(Top::Closed, foot);
        vec![way(ways[0], ways[1]), way(ways[1], ways[0])]
    }

    /// Log likelihoods of a closed box on each of its other sides; empty for other objects.
    fn turned_logs(&self, model: &ObjectModel, log: impl Fn(&ObjectModel) -> f64) -> Vec<f64> {
        let way = |turned: &ObjectModel| (0.5 * CLOSED_LIES * self.lying).ln() + log(turned);
        model.on_other_sides().iter().map(way).collect()
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
            Shape::Box => box_sides_log(model.width_m.zip(model.depth_m), m) + form_log(Some(Shape::Box), m),
        };
        self.temper * (size + wide) + top_log(top, m) + handle_log(model.handle, m)
    }

    /// Log likelihood of objects that resemble a model except for one feature, with sizes within a
    /// tenth; `lids`: factor on the share of those with a lid.
    fn look_alike_log(&self, model: &ObjectModel, models: &[ObjectModel], m: &Measured, lids: f64) -> f64 {
        /// Relative deviation of a look-alike's size or taper from the known object's.
        /// From: chosen.
        const ALIKE: f64 = 0.1;
        /// Ratio of the width of a uniform distribution to its standard deviation. From: derived,
        /// the root of 12, as of any uniform distribution.
        const UNIFORM: f64 = 3.46;
        /// Share of look-alikes with a handle. From: chosen, a guess.
        const HANDLED: f64 = 0.5;
        /// Share of look-alikes with a lid. From: chosen, a guess.
        const LIDDED: f64 = 0.3;
        /// Share of look-alikes with flat sides. From: chosen, a guess.
        const FLAT: f64 = 0.2;
        /// Share of look-alikes with another taper. From: chosen, a guess.
        const TAPERED: f64 = 0.3;
        /// Share of look-alikes of a box with sides of other lengths. From: chosen, a guess.
        const LONGER: f64 = 0.3;
        /// Share of look-alikes of a box with one longer or shorter side; a hidden side leaves this
        /// in doubt. From: chosen, so that an end that no look showed leaves it in doubt.
        const OTHER_SIDE: f64 = 0.25;
        /// Difference in length of a look-alike box's deviating side, as a share of the length, at
        /// least [`APART_M`]. From: chosen.
        const BY: f64 = 0.2;
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
            logs.push(family(LIDDED * lids, model.shape, Top::Closed, Handle::None));
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
            let (shape, top, handle) = (Some(Shape::Box), model.top, model.handle);
            let alike = Family { share: LONGER, shape, top, handle, height, width };
            let as_made = top_log(top, m) + handle_log(handle, m);
            logs.push(alike.share.ln() + stranger_log(&alike, models, m) + self.temper * metric + as_made);
            // As wide a range as the known one, beyond either of its ends.
            let beyond = |r: Range| {
                let (by_m, width_m) = ((BY * r.middle()).max(APART_M), r.high - r.low);
                let (low, high) = (r.low - by_m, r.high + by_m);
                [Range { low: low - width_m, high: low }, Range { low: high, high: high + width_m }]
            };
            let wider = beyond(sides.0).map(|r| ObjectModel { width_m: Some(r), ..model.clone() });
            let deeper = beyond(sides.1).map(|r| ObjectModel { depth_m: Some(r), ..model.clone() });
            let log = |other: &ObjectModel| OTHER_SIDE.ln() + self.model_log(other, Stance::Upright, m);
            logs.extend(wider.iter().chain(&deeper).map(log));
        }
        log_sum(&logs)
    }

    fn family_log(&self, family: &Family, m: &Measured) -> f64 {
        let wide = match family.shape {
            Some(Shape::Round) => diameter_log(None, family.width, m) + taper_log(None, m),
            Some(Shape::Box) if m.sides.is_some() => alike_sides_log([family.width; 2], m),
            _ => sides_log(m),
        };
        let metric = height_log(None, family.height, m) + wide + form_log(family.shape, m);
        self.temper * metric + top_log(family.top, m) + handle_log(family.handle, m)
    }
}

/// Minimum standard deviation of an object's position, metres. From: chosen.
const LEAST_PLACE_SIGMA_M: f64 = 0.001;
#[allow(clippy::too_many_arguments)]
fn percept(
    scene: &Scene,
    segment: &Segment,
    measured: Measured,
    models: &[ObjectModel],
    named: Option<usize>,
    stances: Vec<Stance>,
    (probabilities, kinds): (Vec<(String, f64)>, Vec<(String, f64)>),
    unknown: f64,
) -> Percept {
    let stance = named.map_or(Stance::Unknown, |i| stances[i]);
    let stands = measured.round.filter(|_| stance != Stance::Lying);
    let round_fits =
        stands.filter(|_| form_log(Some(Shape::Round), &measured) > form_log(Some(Shape::Box), &measured));
    let (x, y) = round_fits.map_or((measured.footprint.x, measured.footprint.y), |r| (r.x, r.y));
    let sigma = round_fits.map_or(APART_M, |r| r.place_sigma_m.max(LEAST_PLACE_SIGMA_M));
    Percept {
        label: named.map(|i| models[i].name.clone()),
        kind: named.map(|i| models[i].kind.clone()),
        probabilities,
        kinds,
        unknown: unknown.max(0.0),
        colours: measured.painted.names(),
        position_m: scene.surface.surface_from_world.inverse() * Point3::new(x, y, segment.base_m),
        position_sigma_m: sigma,
        size_m: [measured.footprint.sides_m[0], measured.footprint.sides_m[1], measured.height_m],
        stance,
        points: segment.indices.len(),
        seen_fraction: measured.seen_fraction,
        evidence: measured.evidence,
        indices: segment.indices.clone(),
    }
}
