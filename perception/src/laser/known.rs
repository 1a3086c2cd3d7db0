//! Recognition in two stages: hull features preselect known shapes, model alignment decides.

use super::features::{HullFeatures, USUAL_SPREAD};
use super::fit::{FitOptions, ModelFit, Start, fit, fit_scans, localise};
use super::scan::direction;
use super::shape::{ObjectScan, ShapeModel};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Violation at which a coarse fit is given up, in multiples of `other_m`.
const HOPELESS: f64 = 3.0;
/// Number of directions for measuring a shape's width.
const WIDTHS: usize = 18;

/// Shape model with a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Named")]
pub struct KnownShape {
    /// Name; several shapes may share one.
    pub name: String,
    /// Model of the shape.
    pub model: ShapeModel,
    /// Features of the model's hull, computed once.
    #[serde(skip)]
    features: HullFeatures,
}

/// Serialised form of [`KnownShape`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Named {
    name: String,
    model: ShapeModel,
}

impl From<Named> for KnownShape {
    fn from(named: Named) -> KnownShape {
        KnownShape::new(named.name, named.model)
    }
}

impl KnownShape {
    /// Creates a known shape from a model and a name.
    pub fn new(name: impl Into<String>, model: ShapeModel) -> KnownShape {
        KnownShape { name: name.into(), features: model.features(), model }
    }

    /// Features of the model's hull.
    pub fn features(&self) -> &HullFeatures {
        &self.features
    }
}

/// Options of recognition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecogniseOptions {
    /// Maximum distance of features or width, in standard deviations, at which a shape is aligned with the scans:
    /// measured at most 5.8 for the same object, scanned from three to nine sides; see
    /// `experiments/measure/src/shapes`.
    pub gate: f64,
    /// Maximum looseness of the outline, metres, at which hull features are compared; see [`recognise_scans`].
    pub tight_m: f64,
    /// Maximum looseness of the outline, metres, at which the scans determine each other's poses and are fitted
    /// together; above it, each scan is fitted to a shape separately.
    pub rigid_m: f64,
    /// Maximum root boundary violation per pair of scans at which a shape fits, metres: reached by
    /// 97 % of scans of the same object.
    pub same_m: f64,
    /// Minimum root boundary violation per pair of scans that rules a shape out, metres, the precision of the paper's
    /// laser: measured at most 5.5 mm for the same object, at least 8.9 mm for another of the paper's. Between `same_m`
    /// and this, the shape remains possible.
    pub other_m: f64,
    /// Options for aligning models.
    pub fit: FitOptions,
}

impl Default for RecogniseOptions {
    fn default() -> Self {
        RecogniseOptions {
            gate: 6.0,
            tight_m: 0.01,
            rigid_m: 0.16,
            same_m: 0.0025,
            other_m: 0.01,
            fit: FitOptions::default(),
        }
    }
}

impl RecogniseOptions {
    /// Options for aligning models, given up as soon as a misfit is certain.
    fn fits(&self) -> FitOptions {
        FitOptions { hopeless_m: self.fit.hopeless_m.min(HOPELESS * self.other_m), ..self.fit }
    }
}

/// Known shape that neither features nor width rule out.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeCandidate {
    /// Index in the list of known shapes.
    pub index: usize,
    /// Distance of features or width from those of the known shape, in standard deviations.
    pub distance: f64,
    /// Fit of the scans on the known shape's model.
    pub fit: ModelFit,
}

/// Identity of a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Exactly one name fits.
    Is(String),
    /// Several names fit, or none fits and these are not ruled out; more scans or other features are needed to decide.
    OneOf(Vec<String>),
    /// Every known shape is ruled out.
    Unknown,
}

/// Result of recognition: the verdict, with the compared shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct Recognition {
    /// Identity of the shape.
    pub verdict: Verdict,
    /// Known shapes that were aligned, the best fit first.
    pub candidates: Vec<ShapeCandidate>,
    /// Number of known shapes that features or width ruled out.
    pub ruled_out: usize,
    /// Names that are not ruled out, best fit first.
    pub may_be: Vec<String>,
}

/// Recognises a shape among the known ones.
pub fn recognise(instance: &ShapeModel, known: &[KnownShape], options: &RecogniseOptions) -> Recognition {
    let _span = tracing::debug_span!("recognise", known = known.len()).entered();
    let features = instance.features();
    let mut candidates: Vec<ShapeCandidate> = Vec::new();
    for (index, shape) in known.iter().enumerate() {
        let distance = apart(&features, &shape.features);
        if distance <= options.gate {
            candidates.push(ShapeCandidate {
                index,
                distance,
                fit: fit(&shape.model, instance, &options.fits()),
            });
        }
    }
    decide(candidates, known, options)
}

/// Recognises the object of one scan among known shapes; candidates hold the laser's pose in the frame of the shape. A
/// single scan rarely determines the name.
///
/// Shapes too wide for the bounds of the scan, or too narrow for its readings, are not aligned. Hull features are not
/// compared, as they need more than one scan.
pub fn recognise_scan(scan: &ObjectScan, known: &[KnownShape], options: &RecogniseOptions) -> Recognition {
    let _span = tracing::debug_span!("recognise_scan", known = known.len()).entered();
    let mut candidates: Vec<ShapeCandidate> = Vec::new();
    for (index, shape) in known.iter().enumerate() {
        let distance = width_apart_m(scan, &shape.model) / USUAL_SPREAD.1;
        if distance <= options.gate {
            let fit = localise(&shape.model, scan, Start::AllAngles, &options.fits());
            candidates.push(ShapeCandidate { index, distance, fit });
        }
    }
    decide(candidates, known, options)
}

/// Recognises the object of several scans, possibly from one side only. `loose_m`: mean distance by which the object
/// may extend beyond the measured hull ([`super::ScanGain::looseness_m`]). If it is small, hull features are compared,
/// else only the width in each scan.
pub fn recognise_scans(
    scans: &ShapeModel,
    loose_m: f64,
    known: &[KnownShape],
    options: &RecogniseOptions,
) -> Recognition {
    let _span = tracing::debug_span!("recognise_scans", known = known.len()).entered();
    let features = (loose_m <= options.tight_m).then(|| scans.features());
    let fit = |shape: &KnownShape| match loose_m <= options.rigid_m {
        true => fit_scans(&shape.model, scans, &options.fits()),
        false => worst_fit(&shape.model, scans, &options.fits()),
    };
    let mut candidates: Vec<ShapeCandidate> = Vec::new();
    for (index, shape) in known.iter().enumerate() {
        let apart_m = scans.scans().iter().map(|s| width_apart_m(&s.scan, &shape.model)).fold(0.0, f64::max);
        let by_features = features.as_ref().map_or(0.0, |f| apart(f, &shape.features));
        let distance = by_features.max(apart_m / USUAL_SPREAD.1);
        if distance <= options.gate {
            candidates.push(ShapeCandidate { index, distance, fit: fit(shape) });
        }
    }
    decide(candidates, known, options)
}

/// Worst fit among the scans, each fitted to a model separately.
fn worst_fit(model: &ShapeModel, scans: &ShapeModel, options: &FitOptions) -> ModelFit {
    let each = scans.scans().iter().map(|posed| {
        let fit = localise(model, &posed.scan, Start::AllAngles, options);
        ModelFit { model_from_other: fit.model_from_other * posed.model_from_laser.inverse(), ..fit }
    });
    let worst = each.max_by(|a, b| a.between.per_pair_m().total_cmp(&b.between.per_pair_m()));
    worst.unwrap_or_else(|| fit_scans(model, scans, options))
}

/// Width by which a shape exceeds a scan's bounds or falls short of its readings, whatever the viewing direction,
/// metres; zero if it may fit.
fn width_apart_m(scan: &ObjectScan, model: &ShapeModel) -> f64 {
    let corners = model.hull().corners;
    let widths = (0..WIDTHS).map(|i| {
        let across = direction(PI * i as f64 / WIDTHS as f64);
        let along = corners.iter().map(|c| c.coords.dot(&across));
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    });
    let (least_m, most_m) = widths.fold((f64::INFINITY, 0.0_f64), |(l, h), w| (l.min(w), h.max(w)));
    let points = &scan.points;
    let apart_m = points.iter().flat_map(|p| points.iter().map(move |q| (p - q).norm()));
    // No part of the shape lies farther out than its greatest width behind the farthest reading.
    let farthest_m = points.iter().map(|p| p.coords.norm()).fold(0.0, f64::max) + most_m;
    let room_m = 2.0 * farthest_m * (0.5 * (scan.left_bound_rad - scan.right_bound_rad)).tan();
    (apart_m.fold(0.0, f64::max) - most_m).max(least_m - room_m).max(0.0)
}

/// Decides by the violation of the candidates which names fit and which are not ruled out.
fn decide(
    mut candidates: Vec<ShapeCandidate>,
    known: &[KnownShape],
    options: &RecogniseOptions,
) -> Recognition {
    let ruled_out = known.len() - candidates.len();
    candidates.sort_by(|a, b| a.fit.between.per_pair_m().total_cmp(&b.fit.between.per_pair_m()));
    let within = |limit_m: f64| {
        let mut names: Vec<String> = Vec::new();
        for candidate in candidates.iter().filter(|c| c.fit.between.per_pair_m() <= limit_m) {
            let name = &known[candidate.index].name;
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    };
    let may_be = within(options.other_m);
    let mut names = within(options.same_m);
    let verdict = match names.len() {
        0 if may_be.is_empty() => Verdict::Unknown,
        0 => Verdict::OneOf(may_be.clone()),
        1 => Verdict::Is(names.swap_remove(0)),
        _ => Verdict::OneOf(names),
    };
    Recognition { verdict, candidates, ruled_out, may_be }
}

/// Distance between the features of two models, in standard deviations of such a difference: the larger of the
/// distances in area and in perimeter.
fn apart(a: &HullFeatures, b: &HullFeatures) -> f64 {
    let area = (a.area_m2 - b.area_m2) / USUAL_SPREAD.0;
    let perimeter = (a.perimeter_m - b.perimeter_m) / USUAL_SPREAD.1;
    area.abs().max(perimeter.abs()) / std::f64::consts::SQRT_2
}
