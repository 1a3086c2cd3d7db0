//! Recall, precision and distance as defined in the paper (section VII).

use crate::household::{Body, CAMERA};
use crate::runs::{Run, apart, truth};
use descry_perception::learning::LearnedModel;
use descry_perception::nalgebra::{Isometry3, Point3};
use descry_perception::register::{Method, Prepared, RegisterOptions, align};
use descry_perception::{Cloud, Neighbours};

/// Maximum distance of a measured point from a visible true point, metres.
const VISIBLE_M: f32 = 0.01;
/// Maximum distance of a learned point from an explained true point, metres, as in the paper.
const EXPLAINED_M: f32 = 0.02;
/// Distance in place of [`EXPLAINED_M`] in the strict score, stricter than the paper's, metres.
const STRICT_M: f32 = 0.006;

/// Scores of a run; `first`, `model` and `strict` are recall and precision.
#[derive(Clone, Copy, Debug)]
pub struct Score {
    pub first: (f64, f64),
    pub model: (f64, f64),
    pub strict: (f64, f64),
    /// Mean distance of the model's points from the true surface, metres.
    pub distance_m: f64,
    /// Mean relative pose error of the used keyframes, metres and radians.
    pub poses: (f64, f64),
    pub used: usize,
    pub looks: usize,
}

/// Recall and precision: shares of `truth` within `radius_m` of `found`, and of `found` within
/// `radius_m` of `truth`.
fn recall_precision(truth: &Cloud, found: &Cloud, radius_m: f32) -> (f64, f64) {
    let share = |of: &Cloud, within: &Neighbours| {
        let near = of.points.iter().filter(|p| within.nearest(p, radius_m).is_some()).count();
        near as f64 / of.len().max(1) as f64
    };
    let (to_truth, to_found) = (tree(truth), tree(found));
    (share(truth, &to_found), share(found, &to_truth))
}

fn tree(cloud: &Cloud) -> Neighbours {
    Neighbours::new(&cloud.points).expect("few points")
}

/// True points measured in a run's views, from their true poses.
fn visible(run: &Run, truth: &Cloud, views: impl Iterator<Item = usize> + Clone) -> Cloud {
    truth.filter(|p| {
        views.clone().any(|k| {
            let q = run.truths[k].inverse() * p.cast::<f64>();
            let pixel = CAMERA.project(&q).and_then(|(u, v)| CAMERA.pixel(u, v));
            pixel.is_some_and(|i| (run.views[k].cloud.points[i].z - q.z as f32).abs() < VISIBLE_M)
        })
    })
}

/// Registers a learned cloud onto the truth, as the paper does before the comparison.
pub fn onto(found: &Cloud, truth: &Cloud) -> Isometry3<f64> {
    let source = Prepared::new(&found.points).expect("few points");
    let target = Prepared::with_normals(&truth.points, 15).expect("few points");
    let options = RegisterOptions {
        method: Method::PointToPlane,
        within_m: 0.03,
        robust_m: Some(0.005),
        ..RegisterOptions::default()
    };
    match align(&source, &target, &options) {
        Ok(fit) if fit.matched * 2 > fit.of => fit.target_from_source,
        _ => Isometry3::identity(),
    }
}

/// A model moved to its true pose: by the first view, whose localisation error is common to all, then by
/// registering the surfaces.
pub fn aligned(model: &LearnedModel, registered: bool, run: &Run, truth: &Cloud) -> Cloud {
    let first = if registered { run.keyframes[0].world_from_camera } else { run.views[0].world_from_camera };
    let true_from_stated = run.truths[0] * first.inverse();
    let found = model.cloud.transformed(&(true_from_stated * model.world_from_model));
    found.transformed(&onto(&found, truth))
}

/// Compares the models of a run with the true surface.
pub fn score(run: &Run, body: &Body) -> Score {
    let truth = truth(body, &run.world_from_body);
    let seen = visible(run, &truth, std::iter::once(0));
    let pixels: Vec<u32> = (0..run.mask.len()).filter(|&i| run.mask[i]).map(|i| i as u32).collect();
    let first = run.views[0].cloud.select(&pixels).finite().transformed(&run.truths[0]);
    let used: Vec<usize> = (0..run.views.len()).filter(|&k| run.model.looks[k].pixels > 0).collect();
    let seen_by_all = visible(run, &truth, used.iter().copied());
    let found = aligned(&run.model, true, run, &truth);
    let to_truth = tree(&truth);
    let distances = found
        .points
        .iter()
        .map(|p| to_truth.nearest(p, 1.0).map_or(1.0, |n| f64::from(n.distance_sq).sqrt()));
    Score {
        first: recall_precision(&seen, &first, EXPLAINED_M),
        model: recall_precision(&seen_by_all, &found, EXPLAINED_M),
        strict: recall_precision(&seen_by_all, &found, STRICT_M),
        distance_m: distances.sum::<f64>() / found.len().max(1) as f64,
        poses: pose_error(run, &used),
        used: used.len(),
        looks: run.views.len(),
    }
}

/// Pose error of the used keyframes relative to the first: mean at the object, metres, and radians.
fn pose_error(run: &Run, used: &[usize]) -> (f64, f64) {
    let object = Point3::from(run.world_from_body.translation.vector);
    let errors: Vec<Isometry3<f64>> =
        used.iter().map(|&k| run.keyframes[k].world_from_camera * run.truths[k].inverse()).collect();
    let places: Vec<Point3<f64>> = errors.iter().map(|e| e * object).collect();
    let n = errors.len().max(1) as f64;
    let mean =
        Point3::from(places.iter().map(|p| p.coords).sum::<descry_perception::nalgebra::Vector3<f64>>() / n);
    let metres = places.iter().map(|p| (p - mean).norm()).sum::<f64>() / n;
    let turns = errors.iter().map(|e| apart(&errors[0], e).1).sum::<f64>() / n;
    (metres, turns)
}

/// Minimum gap along the normal between two layers of a doubled wall, metres.
const GAP_M: f32 = 0.005;
/// Maximum offset of a layer's point across the normal, metres.
const ASIDE_M: f32 = 0.004;
/// Search radius for the layers, metres.
const DEEP_M: f32 = 0.03;

/// Mean distance of a model's points from the true surface and its 95th percentile, metres, and the share of
/// the surface that is doubled.
pub fn doubled(model: &LearnedModel, registered: bool, body: &Body, run: &Run) -> (f64, f64, f64) {
    let truth = truth(body, &run.world_from_body);
    let found = aligned(model, registered, run, &truth);
    let to_truth = tree(&truth);
    let off = |p: &Point3<f32>| to_truth.nearest(p, 1.0).map_or(1.0, |n| f64::from(n.distance_sq).sqrt());
    let mut distances: Vec<f64> = found.points.iter().map(off).collect();
    distances.sort_by(f64::total_cmp);
    let (normals, none) = (truth.normals.as_ref(), Vec::new());
    let (learned, to_found) = (found.normals.as_ref().unwrap_or(&none), tree(&found));
    let (mut seen, mut twice) = (0_usize, 0_usize);
    for (p, normal) in truth.points.iter().zip(normals.into_iter().flatten()) {
        let mut heights = Vec::new();
        to_found.within(p, DEEP_M, |near| {
            let k = near.index as usize;
            let height = (found.points[k] - p).dot(normal);
            let aside_sq = near.distance_sq - height * height;
            if aside_sq < ASIDE_M * ASIDE_M && learned[k].dot(normal) > 0.6 {
                heights.push(height);
            }
        });
        heights.sort_by(f32::total_cmp);
        seen += usize::from(!heights.is_empty());
        twice += usize::from(heights.windows(2).any(|pair| pair[1] - pair[0] >= GAP_M));
    }
    let n = distances.len().max(1);
    let within = distances.get(n * 95 / 100).copied().unwrap_or(f64::NAN);
    (distances.iter().sum::<f64>() / n as f64, within, twice as f64 / seen.max(1) as f64)
}

/// Formats mean and standard deviation of values, as `1.20±0.10`.
pub fn pair(values: impl Iterator<Item = f64>) -> String {
    let (mean, sigma) = spread(&values.collect::<Vec<f64>>());
    format!("{mean:.2}±{sigma:.2}")
}

/// Mean and (population) standard deviation of values.
pub fn spread(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt())
}

/// Median; the upper of the two middle values, NaN without values.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
