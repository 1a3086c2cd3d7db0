//! The recogniser of paper 004: similarity of size and share of cylinder inliers, averaged.

use super::Recogniser;
use super::evidence::{Setting, measure};
use super::model::{ObjectModel, Range, Shape};
use super::percept::{Percept, Stance, kinds};
use crate::noise::KINECT;
use crate::scale::APART_M;
use crate::segment::Scene;
use crate::visibility::Visibility;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// Published recogniser with its two parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Published {
    /// Size difference that lowers the similarity to 1/e, metres (α). From: chosen, paper 004 does
    /// not state it.
    pub alpha_m: f64,
    /// Minimum score at which a segment is labelled as a known object (θ). From: paper, 004 names
    /// it; its value is that of the code that its authors published (fawkes).
    pub theta: f64,
}

impl Default for Published {
    fn default() -> Self {
        Published { alpha_m: 0.05, theta: 0.6 }
    }
}

impl Recogniser for Published {
    fn name(&self) -> &'static str {
        "published"
    }

    fn recognise(&self, scene: &Scene, seen: &Visibility, models: &[ObjectModel]) -> Vec<Percept> {
        let setting = Setting::of(scene, KINECT, &[]);
        scene
            .segments
            .iter()
            .map(|segment| {
                let measured = measure(&setting, segment, seen).measured;
                let size = [measured.footprint.sides_m[0], measured.footprint.sides_m[1], measured.height_m];
                let shape = measured.evidence.round_inliers;
                let probabilities: Vec<(String, f64)> = models
                    .iter()
                    .map(|m| (m.name.clone(), 0.5 * (self.size_similarity(m, &size) + shape)))
                    .collect();
                let best = (0..models.len())
                    .max_by(|&a, &b| probabilities[a].1.total_cmp(&probabilities[b].1).then(b.cmp(&a)))
                    .filter(|&b| probabilities[b].1 >= self.theta);
                let place = Point3::new(measured.footprint.x, measured.footprint.y, segment.base_m);
                let score = best.map_or(0.0, |b| probabilities[b].1);
                Percept {
                    label: best.map(|b| models[b].name.clone()),
                    kind: best.map(|b| models[b].kind.clone()),
                    kinds: kinds(models, probabilities.iter().map(|(_, p)| *p)),
                    probabilities,
                    unknown: 1.0 - score,
                    colours: measured.painted.names(),
                    position_m: scene.surface.surface_from_world.inverse() * place,
                    position_sigma_m: APART_M,
                    size_m: size,
                    stance: if best.is_some() { Stance::Upright } else { Stance::Unknown },
                    points: segment.indices.len(),
                    seen_fraction: measured.seen_fraction,
                    evidence: measured.evidence,
                    indices: segment.indices.clone(),
                }
            })
            .collect()
    }
}

impl Published {
    /// Size similarity: the product of e^(−|d′ − d| / α) over the three dimensions of the bounding
    /// box, with d′ measured and d the model's nearest value.
    fn size_similarity(&self, model: &ObjectModel, size_m: &[f64; 3]) -> f64 {
        let [width, depth] = match model.shape {
            Shape::Round => [model.diameter_m; 2],
            Shape::Box => [model.width_m, model.depth_m],
        };
        let miss = |value: f64, range: Option<Range>| {
            range.map_or(0.0, |r| (value - value.clamp(r.low, r.high)).abs())
        };
        let sum = miss(size_m[0], width) + miss(size_m[1], depth) + miss(size_m[2], Some(model.height_m));
        (-sum / self.alpha_m).exp()
    }
}
