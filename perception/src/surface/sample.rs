//! A sample of the points of a cloud, with their spreads.

use crate::cloud::Cloud;
use crate::noise::nearest_sigma_m;
use crate::pool;
use nalgebra::Point3;

/// Maximum coordinate of a return, metres. From: chosen, beyond what cameras and lasers of robots
/// measure.
pub(super) const FARTHEST_M: f32 = 1000.0;
/// Number of points sampled for the plane search; more change nothing. From: chosen.
pub(super) const SAMPLE: usize = 16_000;
/// Number of points sampled of a single view, which shows less. From: chosen, on piles of things
/// and on recordings.
pub(super) const SAMPLE_OF_ONE: usize = 12_000;

#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub point: Point3<f64>,
    /// Standard deviation of the measurement along the ray, metres.
    pub sigma_m: f64,
}

/// Regular sample of a cloud's points in range; of a single view fewer points are taken.
pub(super) fn sample(cloud: &Cloud, viewpoints: &[Point3<f64>]) -> Vec<Sample> {
    /// Maximum standard deviation of a measurement, however far away, metres. From: chosen.
    const WORST_SIGMA_M: f64 = 0.02;
    let wanted = if viewpoints.len() > 1 { SAMPLE } else { SAMPLE_OF_ONE };
    let stride = (cloud.len() / wanted).max(1);
    // A stride that shares a factor with the rows would sample columns only.
    let stride = match cloud.grid {
        Some(grid) if stride > 1 && grid.width % stride == 0 => stride + 1,
        _ => stride,
    };
    let sample = |p: &Point3<f32>| {
        let point = p.cast::<f64>();
        let sigma_m = nearest_sigma_m(&point, viewpoints).min(WORST_SIGMA_M);
        Sample { point, sigma_m }
    };
    let half = (cloud.len() / 2).next_multiple_of(stride).min(cloud.len());
    let of = |points: &[Point3<f32>]| -> Vec<Sample> {
        points.iter().step_by(stride).filter(|p| is_in_reach(p)).map(sample).collect()
    };
    let (mut samples, more) = pool::join(|| of(&cloud.points[..half]), || of(&cloud.points[half..]));
    samples.extend(more);
    samples
}

/// True of a return that a sensor of a robot may have measured.
pub(super) fn is_in_reach(p: &Point3<f32>) -> bool {
    p.iter().all(|c| c.abs() <= FARTHEST_M)
}
