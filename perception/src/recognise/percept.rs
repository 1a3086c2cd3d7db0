//! Results of recognition: percepts with evidence. Identities over time are assigned in memory.

use super::colour::coloured;
use super::model::ObjectModel;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// The stance of the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stance {
    /// The base of the object is down.
    Upright,
    /// The top of the object is down.
    UpsideDown,
    /// The axis of the object lies in the plane of the surface.
    Lying,
    /// Not determined by the views.
    #[default]
    Unknown,
}

/// Sighting of a feature: seen, absent, or not everywhere observed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sighting {
    /// The feature was seen.
    Seen,
    /// All possible places were looked through: absent.
    Absent,
    /// Some possible places have not been seen.
    #[default]
    Unseen,
}

/// Evidence for and against each model. Fractions are between 0 and 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Radius of the best upright round body at its widest, metres; 0 if none was fitted.
    pub radius_m: f64,
    /// Standard deviation of the radius.
    pub radius_sigma_m: f64,
    /// Diameter at the base over diameter at the top.
    pub taper: f64,
    /// Root mean square distance of the points from that body, metres.
    pub round_residual_m: f64,
    /// Share of the points on the round body.
    pub round_inliers: f64,
    /// Share of the circumference where the side was measured.
    pub arc: f64,
    /// Root mean square distance of the outline from the best rectangle, metres.
    pub box_residual_m: f64,
    /// Share of the top that was looked into below the rim.
    pub open: f64,
    /// Share of the top with a measured lid or face.
    pub lid: f64,
    /// The open rim with an inside.
    pub inside: Sighting,
    /// The handle.
    pub handle: Sighting,
    /// Share of the directions in which a handle could still hide.
    pub handle_unseen: f64,
    /// Reach of the largest protrusion, metres.
    pub protrusion_m: f64,
    /// Number of views that looked at the object.
    pub views: usize,
}

/// Percept of one object on the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Percept {
    /// Name of the most likely known object; `None`: *unknown*.
    pub label: Option<String>,
    /// Most likely kind.
    pub kind: Option<String>,
    /// Probability of each model, in model order; with `unknown` they sum to one. (The published
    /// recogniser gives similarity scores here, which are no probabilities.)
    pub probabilities: Vec<(String, f64)>,
    /// Probability of each kind: the sum over its models, in order of first mention.
    pub kinds: Vec<(String, f64)>,
    /// Probability that the object is none of the models.
    pub unknown: f64,
    /// Probability of each basic colour; the rest is that it has several. Empty: colour not seen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub colours: Vec<(String, f64)>,
    /// Position, world frame, metres: centre of the body's footprint on its support.
    pub position_m: Point3<f64>,
    /// Standard deviation of each coordinate of the position within the cloud, metres, without
    /// localisation errors.
    pub position_sigma_m: f64,
    /// Longer and shorter side of the footprint, and height, metres, including the part cut off by
    /// the plane.
    pub size_m: [f64; 3],
    /// The stance of the object.
    pub stance: Stance,
    /// Number of cloud points of the object.
    pub points: usize,
    /// Share of the visible hull (sides and top) that some view saw or looked past.
    pub seen_fraction: f64,
    /// Evidence for and against each model.
    pub evidence: Evidence,
    /// Points of the object: indices into the cloud that was segmented.
    #[serde(skip)]
    pub indices: Vec<u32>,
}

impl Percept {
    /// Raises the probability of each known object to at least its probability in a part's percept.
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

    /// Probability that the object is, or is of the kind, `name`, which may begin with a colour; 0 for
    /// names without a model.
    pub fn probability_of(&self, name: &str) -> f64 {
        probability_of(name, [&self.probabilities, &self.kinds], &self.colours)
    }
}

/// Probability of a colour that was asked for and not seen: as likely as not. From: derived, a question with two answers.
const UNSEEN_COLOUR: f64 = 0.5;

/// Probability of a name, or of a colour and a name ("red cup"), by lists of names and the probabilities of colours.
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
