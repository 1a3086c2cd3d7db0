//! Results of recognition: percepts with evidence. A percept has no identity over time.

use super::colour::coloured;
use super::model::ObjectModel;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// Side on which an object rests on its support: upright, upside down, lying, or unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stance {
    /// The base of the object is down.
    Upright,
    /// The top of the object is down.
    UpsideDown,
    /// The axis of the object lies in the plane of the surface.
    Lying,
    /// Undetermined, as for every object without a label.
    #[default]
    Unknown,
}

/// Result of looking for a feature of an object (handle, open inside).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sighting {
    /// The feature was seen.
    Seen,
    /// The feature is absent: all its possible places were seen empty.
    Absent,
    /// Undecided: some possible places of the feature were not seen.
    #[default]
    Unseen,
}

/// Measures of an object that are evidence for or against each model. Shares are between 0 and 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Largest radius of the best-fitting upright round body, metres; 0 if none was fitted.
    pub radius_m: f64,
    /// Standard deviation of the radius, metres.
    pub radius_sigma_m: f64,
    /// Diameter of the round body at its base over that at its top; 1 is a cylinder.
    pub taper: f64,
    /// Root mean square distance of the side's points from the round body, metres.
    pub round_residual_m: f64,
    /// Share of the side's points that lie on the round body.
    pub round_inliers: f64,
    /// Share of the circumference at which the round body's side was measured.
    pub arc: f64,
    /// Root mean square distance of the side's points, seen from above, from the best-fitting
    /// rectangle, metres.
    pub box_residual_m: f64,
    /// Share of the rays into the upper end that ended below the rim's height, as in an open
    /// vessel.
    pub open: f64,
    /// Share of the rays into the upper end that ended at the rim's height, as on a lid or solid
    /// top.
    pub lid: f64,
    /// Result of looking for an inside behind an open rim.
    pub inside: Sighting,
    /// Result of looking for a handle.
    pub handle: Sighting,
    /// Share of the directions around the object in which a handle could hide unseen.
    pub handle_unseen: f64,
    /// Reach of the largest protrusion from the round body, metres; 0 without one.
    pub protrusion_m: f64,
    /// Number of views with the object's centre in the image, hidden or not.
    pub views: usize,
}

/// Percept of one object on the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Percept {
    /// Name of the most likely known object; `None` if no model is likely enough.
    pub label: Option<String>,
    /// Kind of the labelled object; `None` without a label.
    pub kind: Option<String>,
    /// Probability of each model, in model order; with `unknown` they sum to one. (The published
    /// recogniser gives similarity scores here, which are no probabilities.)
    pub probabilities: Vec<(String, f64)>,
    /// Probability of each kind: the sum over its models and (with `Descry`) over objects that
    /// match them in all but colour; in order of first mention.
    pub kinds: Vec<(String, f64)>,
    /// Probability that the object is none of the models.
    pub unknown: f64,
    /// Probability of each basic colour; the rest to one is that of several colours. Empty if no
    /// colour was seen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub colours: Vec<(String, f64)>,
    /// Position, world frame, metres: centre of the body's footprint on its support.
    pub position_m: Point3<f64>,
    /// Standard deviation of each coordinate of the position within the cloud, metres, without
    /// localisation errors.
    pub position_sigma_m: f64,
    /// Longer and shorter side of the footprint, and height above the support, metres.
    pub size_m: [f64; 3],
    /// Side on which the object rests.
    pub stance: Stance,
    /// Number of cloud points of the object.
    pub points: usize,
    /// Share of the object's sides and top that some view measured or saw past.
    pub seen_fraction: f64,
    /// Measures that are evidence for or against each model.
    pub evidence: Evidence,
    /// Points of the object: indices into the cloud that was segmented.
    #[serde(skip)]
    pub indices: Vec<u32>,
}

impl Percept {
    /// Raises the probability of each model and kind to at least that in the percept `part`, then
    /// normalises.
    pub(super) fn at_least(mut self, part: &Percept) -> Percept {
        for ((_, own), (_, part)) in self.probabilities.iter_mut().zip(&part.probabilities) {
            *own = own.max(*part);
        }
        for ((_, own), (_, part)) in self.kinds.iter_mut().zip(&part.kinds) {
            *own = own.max(*part);
        }
        let all = self.probabilities.iter().map(|(_, p)| p).sum::<f64>() + self.unknown;
        self.probabilities.iter_mut().chain(&mut self.kinds).for_each(|(_, p)| *p /= all);
        self.unknown /= all;
        self
    }

    /// Probability of the most likely known object.
    pub(super) fn known(&self) -> f64 {
        self.probabilities.iter().map(|(_, p)| *p).fold(0.0, f64::max)
    }

    /// Probability that the object is `name`: a model or kind, possibly after a colour ("red cup");
    /// 0 for names without a model.
    pub fn probability_of(&self, name: &str) -> f64 {
        probability_of(name, [&self.probabilities, &self.kinds], &self.colours)
    }
}

/// Probability of a requested colour if no colour of the object was seen. From: derived, a question
/// with two answers.
const UNSEEN_COLOUR: f64 = 0.5;

/// Probability of `name`, or of a colour and a name ("red cup"), given the probabilities of models,
/// of kinds and of colours; 0 for an unknown name.
pub fn probability_of(name: &str, names: [&[(String, f64)]; 2], colours: &[(String, f64)]) -> f64 {
    let of = |list: &[(String, f64)], name: &str| list.iter().find(|(n, _)| n == name).map(|&(_, p)| p);
    let named = |name: &str| names.into_iter().find_map(|list| of(list, name));
    let coloured = || {
        let (colour, rest) = coloured(name)?;
        Some(named(rest)? * of(colours, colour).unwrap_or(UNSEEN_COLOUR))
    };
    named(name).or_else(coloured).unwrap_or(0.0)
}

/// Sums the models' probabilities by kind, in order of first mention.
pub(super) fn kinds(models: &[ObjectModel], probabilities: impl Iterator<Item = f64>) -> Vec<(String, f64)> {
    let mut kinds: Vec<(String, f64)> = Vec::new();
    for (model, p) in models.iter().zip(probabilities) {
        match kinds.iter_mut().find(|(kind, _)| *kind == model.kind) {
            Some((_, sum)) => *sum += p,
            None => kinds.push((model.kind.clone(), p)),
        }
    }
    kinds
}
