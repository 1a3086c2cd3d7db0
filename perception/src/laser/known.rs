//! Recognition in two steps: hull features leave few of the known shapes, model alignment decides among these.

use super::features::{Features, USUAL_SPREAD};
use super::fit::{FitOptions, ModelFit, fit};
use super::shape::ShapeModel;
use serde::{Deserialize, Serialize};

/// A shape with a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Named")]
pub struct KnownShape {
    /// Its name; several may share one.
    pub name: String,
    /// Its model.
    pub model: ShapeModel,
    /// Features of the model's hull, kept so that many known shapes are gone through quickly.
    #[serde(skip)]
    features: Features,
}

/// A known shape as it stands in a file.
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
    /// A model under a name.
    pub fn new(name: impl Into<String>, model: ShapeModel) -> KnownShape {
        KnownShape { name: name.into(), features: model.features(), model }
    }

    /// Features of its hull.
    pub fn features(&self) -> &Features {
        &self.features
    }
}

/// How to recognise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecogniseOptions {
    /// Shapes whose area or perimeter differ by more are not aligned: spreads of such a difference.
    pub gate: f64,
    /// Most shapes that are aligned: those with the nearest features.
    pub aligned: usize,
    /// The same shape: the root of the boundary violation a pair of scans stays below, metres. The precision of the paper's laser.
    pub same_m: f64,
    /// How models are brought onto each other.
    pub fit: FitOptions,
}

impl Default for RecogniseOptions {
    fn default() -> Self {
        RecogniseOptions { gate: 5.0, aligned: 10, same_m: 0.01, fit: FitOptions::default() }
    }
}

/// A known shape that the features left.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Its place in the list of known shapes.
    pub index: usize,
    /// How far its features are, in spreads of such a difference.
    pub distance: f64,
    /// How the instance lies on it.
    pub fit: ModelFit,
}

/// What was recognised.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// One name fits.
    Is(String),
    /// Several names fit: more scans, or other features, must tell them apart.
    OneOf(Vec<String>),
    /// No known shape fits.
    Unknown,
}

/// What a shape was taken for, and what else it was held against.
#[derive(Clone, Debug, PartialEq)]
pub struct Recognition {
    /// What it is.
    pub verdict: Verdict,
    /// Those that were aligned, the best fit first.
    pub candidates: Vec<Candidate>,
    /// Known shapes that the features ruled out.
    pub ruled_out: usize,
    /// Known shapes that had like features but were one too many to be aligned; if any, a verdict may have missed one.
    pub left_over: usize,
}

/// Takes a shape for one of those known.
pub fn recognise(instance: &ShapeModel, known: &[KnownShape], options: &RecogniseOptions) -> Recognition {
    let _span = tracing::debug_span!("recognise", known = known.len()).entered();
    let features = instance.features();
    let mut near: Vec<(f64, usize)> =
        known.iter().enumerate().map(|(i, k)| (apart(&features, &k.features), i)).collect();
    near.retain(|(distance, _)| *distance <= options.gate);
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let ruled_out = known.len() - near.len();
    let left_over = near.len().saturating_sub(options.aligned);
    near.truncate(options.aligned);
    let mut candidates: Vec<Candidate> = near
        .into_iter()
        .map(|(distance, index)| Candidate {
            index,
            distance,
            fit: fit(&known[index].model, instance, &options.fit),
        })
        .collect();
    candidates.sort_by(|a, b| a.fit.between.per_pair_m().total_cmp(&b.fit.between.per_pair_m()));
    let mut names: Vec<String> = Vec::new();
    for candidate in candidates.iter().filter(|c| c.fit.between.per_pair_m() <= options.same_m) {
        let name = &known[candidate.index].name;
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    let verdict = match names.len() {
        0 => Verdict::Unknown,
        1 => Verdict::Is(names.swap_remove(0)),
        _ => Verdict::OneOf(names),
    };
    Recognition { verdict, candidates, ruled_out, left_over }
}

/// How far features of two models are apart, in spreads of such a difference: the larger of area's and perimeter's.
fn apart(a: &Features, b: &Features) -> f64 {
    let area = (a.area_m2 - b.area_m2) / USUAL_SPREAD.0;
    let perimeter = (a.perimeter_m - b.perimeter_m) / USUAL_SPREAD.1;
    area.abs().max(perimeter.abs()) / std::f64::consts::SQRT_2
}
