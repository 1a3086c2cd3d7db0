//! Recognition without alignment: area and perimeter of the hull (section IV), with the spread of each class.

use super::shape::ShapeModel;
use nalgebra::{Matrix2, Point2, Vector2};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Pose-invariant features of a shape's convex hull, and its centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HullFeatures {
    /// Area of the hull, square metres.
    pub area_m2: f64,
    /// Perimeter of the hull, metres.
    pub perimeter_m: f64,
    /// Centre of mass of the hull in the model's frame, metres.
    pub centre: Point2<f64>,
}

impl HullFeatures {
    fn vector(&self) -> Vector2<f64> {
        Vector2::new(self.area_m2, self.perimeter_m)
    }
}

/// Standard deviations of area (square metres) and perimeter (metres) between models of one object from seven scans:
/// the middle of the paper's Fig. 7.
pub(super) const USUAL_SPREAD: (f64, f64) = (0.0044, 0.017);

/// Feature distribution of a class of shapes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeatureClass {
    /// Name of the class.
    pub name: String,
    /// Number of training instances.
    pub instances: usize,
    /// Mean area (square metres) and perimeter (metres).
    pub mean: Vector2<f64>,
    /// Covariance of the instances, shrunk towards that of all classes when instances are few.
    pub covariance: Matrix2<f64>,
}

impl FeatureClass {
    /// Mahalanobis distance of features from the class mean.
    pub fn distance(&self, features: &HullFeatures) -> f64 {
        let off = features.vector() - self.mean;
        let inverse = self.covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
        (off.transpose() * inverse * off)[0].max(0.0).sqrt()
    }
}

/// Nearest class to some features.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest<'a> {
    /// Nearest class.
    pub class: &'a FeatureClass,
    /// Mahalanobis distance from the mean of the nearest class.
    pub distance: f64,
    /// Mahalanobis distance from the mean of the second-nearest class; infinite if there is none.
    pub second: f64,
}

/// Learns a class for each name from the models of that name; sorted by name.
pub fn classes<'a>(named: impl IntoIterator<Item = (&'a str, &'a ShapeModel)>) -> Vec<FeatureClass> {
    let mut instances: BTreeMap<&str, Vec<Vector2<f64>>> = BTreeMap::new();
    for (name, model) in named {
        instances.entry(name).or_default().push(model.features().vector());
    }
    let mean = |of: &[Vector2<f64>]| of.iter().sum::<Vector2<f64>>() / of.len() as f64;
    let scatter = |of: &[Vector2<f64>]| {
        let middle = mean(of);
        of.iter().map(|v| (v - middle) * (v - middle).transpose()).sum::<Matrix2<f64>>()
    };
    let usual = Matrix2::new(USUAL_SPREAD.0.powi(2), 0.0, 0.0, USUAL_SPREAD.1.powi(2));
    // One instance's worth of the usual spread, so that what few instances happen to share is not taken for certain.
    let all = instances.values().map(|of| scatter(of)).sum::<Matrix2<f64>>();
    let free: usize = instances.values().map(|of| of.len() - 1).sum();
    let pooled = (all + usual) / (free + 1) as f64;
    instances
        .into_iter()
        .map(|(name, of)| FeatureClass {
            name: name.to_owned(),
            instances: of.len(),
            mean: mean(&of),
            covariance: (scatter(&of) + pooled) / of.len() as f64,
        })
        .collect()
}

/// Class with the smallest Mahalanobis distance, however far; `None` without classes.
pub fn nearest<'a>(classes: &'a [FeatureClass], features: &HullFeatures) -> Option<Nearest<'a>> {
    let mut ranked: Vec<(f64, &FeatureClass)> = classes.iter().map(|c| (c.distance(features), c)).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let second = ranked.get(1).map_or(f64::INFINITY, |r| r.0);
    ranked.first().map(|&(distance, class)| Nearest { class, distance, second })
}

/// Indices of models grouped into unnamed categories: groups with a mean distance below `apart` usual deviations are
/// joined, nearest first (average linkage). Indices ascend, categories by first index.
pub fn groups(models: &[HullFeatures], apart: f64) -> Vec<Vec<usize>> {
    let scaled: Vec<Vector2<f64>> = models
        .iter()
        .map(|f| Vector2::new(f.area_m2 / USUAL_SPREAD.0, f.perimeter_m / USUAL_SPREAD.1))
        .collect();
    let mut groups: Vec<Vec<usize>> = (0..models.len()).map(|i| vec![i]).collect();
    let distance = |a: &[usize], b: &[usize]| {
        let sum: f64 = a
            .iter()
            .flat_map(|&i| b.iter().map(move |&j| (i, j)))
            .map(|(i, j)| (scaled[i] - scaled[j]).norm())
            .sum();
        sum / (a.len() * b.len()) as f64
    };
    loop {
        let pairs = (0..groups.len()).flat_map(|i| (i + 1..groups.len()).map(move |j| (i, j)));
        let nearest =
            pairs.map(|(i, j)| (distance(&groups[i], &groups[j]), i, j)).min_by(|a, b| a.0.total_cmp(&b.0));
        match nearest {
            Some((d, i, j)) if d < apart => {
                let joined = groups.remove(j);
                groups[i].extend(joined);
                groups[i].sort_unstable();
            }
            _ => return groups,
        }
    }
}
