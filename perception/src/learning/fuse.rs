//! Fusion of all views into one cloud, in which each point is the most certain measurement of its cube (section V-C).

use super::error::LearningError;
use super::frame::Frame;
use super::grow;
use super::mask::Mask;
use crate::cloud::{Cloud, is_finite};
use crate::neighbours::Neighbours;
use crate::noise::{axial_sigma_m, lateral_sigma_m};
use crate::pool;
use crate::voxel;
use nalgebra::{Point3, Vector3};

/// Additional standard deviation at distance d from a depth edge: σ_e = k·exp(−d²/D²), with k and D in metres.
const EDGE_M: (f64, f64) = (1.0, 0.002);
/// Relative depth difference of neighbouring pixels above which there is an edge between them.
const EDGE_SHARE: f32 = 0.015;
/// Distance from an edge beyond which its effect is neglected, metres.
const EDGE_REACH_M: f32 = 0.008;
/// Length scale along the surface, metres, with which measurements around a point lose weight when smoothing.
const SMOOTH_M: f32 = 0.004;
/// Radius around a point, metres, within which measurements smooth it.
const DEEP_M: f32 = 0.01;
/// Maximum number of measurements used for smoothing; more do not improve the result.
const ASKED: usize = 60_000;
/// Standard deviation of a model from one encounter, metres.
const MADE_M: f64 = 0.001;
/// Minimum cosine between normals of one surface.
const SAME_SIDE: f32 = 0.6;

/// Measured points of the object, from all views so far.
#[derive(Default)]
pub(super) struct Measured {
    cloud: Cloud,
    /// Variance of each point, σ_z² + σ_L² + σ_e², square metres.
    variances: Vec<f64>,
}

impl Measured {
    /// Adds a view's pixels in the mask, with their variances.
    pub fn add(&mut self, frame: &Frame, mask: &Mask) {
        let edges = edges(frame);
        let focal = frame.map.intrinsics.fx;
        self.cloud.append(&frame.cloud(mask));
        self.variances.extend(mask.pixels().map(|i| {
            let (z, angle) = (frame.depth_m(i), frame.angle_rad(i));
            let sigma = |sigma: Option<f64>| sigma.unwrap_or(EDGE_M.0);
            let edge = EDGE_M.0 * (-edge_distance_sq(frame, &edges, i) / (EDGE_M.1 * EDGE_M.1)).exp();
            sigma(axial_sigma_m(z, angle)).powi(2)
                + sigma(lateral_sigma_m(z, angle, focal)).powi(2)
                + edge * edge
        }));
    }

    /// Adds a model from earlier encounters, weighted by their number.
    pub fn carry(&mut self, made: &Cloud, meetings: u32) {
        let part = Cloud {
            points: made.points.clone(),
            normals: made.normals.clone(),
            colours: made.colours.clone(),
            ..Cloud::default()
        };
        self.cloud.append(&part);
        let variance = MADE_M * MADE_M / f64::from(meetings);
        self.variances.extend(std::iter::repeat_n(variance, part.len()));
    }

    /// Fused cloud: the point of least variance in each cube; if `smooth`, each point is first moved along its normal
    /// to the mean of the surrounding measurements. Outliers are removed.
    pub fn fused(&self, cube_m: f32, smooth: bool) -> Result<Cloud, LearningError> {
        let mut chosen = self.least(&self.cloud, &self.variances, cube_m)?;
        if smooth {
            let smoothed = self.smoothed(&chosen)?;
            let variances: Vec<f64> = chosen.iter().map(|&i| self.variances[i as usize]).collect();
            chosen = self.least(&smoothed, &variances, cube_m)?;
            let thinned = smoothed.select(&chosen);
            return Ok(thinned.select(&grow::kept(&thinned.points)?));
        }
        let fused = self.cloud.select(&chosen);
        Ok(fused.select(&grow::kept(&fused.points)?))
    }

    /// Index of the point of least variance in each cube, ascending.
    fn least(&self, cloud: &Cloud, variances: &[f64], cube_m: f32) -> Result<Vec<u32>, LearningError> {
        let assigned = voxel::assign(&cloud.points, cube_m)?;
        let mut best = vec![u32::MAX; assigned.voxels];
        for (i, &voxel) in assigned.voxel.iter().enumerate().filter(|(_, v)| **v != voxel::NONE) {
            let best = &mut best[voxel as usize];
            if *best == u32::MAX || variances[i] < variances[*best as usize] {
                *best = i as u32;
            }
        }
        best.sort_unstable();
        Ok(best)
    }

    /// Chosen points, each moved along its normal to the variance-weighted mean of the surrounding measurements. Two
    /// views misaligned by less than the sensor noise thus give one surface instead of two.
    fn smoothed(&self, chosen: &[u32]) -> Result<Cloud, LearningError> {
        let mut cloud = self.cloud.select(chosen);
        let Some(normals) = &self.cloud.normals else { return Ok(cloud) };
        let stride = self.cloud.len().div_ceil(ASKED).max(1);
        let asked: Vec<Point3<f32>> = self.cloud.points.iter().step_by(stride).copied().collect();
        let tree = Neighbours::new(&asked)?;
        let place = |&i: &u32| {
            let (mut at, mut normal) = (self.cloud.points[i as usize], normals[i as usize]);
            for _ in 0..2 {
                let (mut weight, mut off, mut mean) = (0.0_f32, 0.0_f32, Vector3::zeros());
                tree.within(&at, DEEP_M, |near| {
                    let k = near.index as usize * stride;
                    let apart = self.cloud.points[k] - at;
                    let height = apart.dot(&normal);
                    let aside_sq = near.distance_sq - height * height;
                    let w = (-aside_sq / (SMOOTH_M * SMOOTH_M)).exp() / self.variances[k] as f32;
                    if aside_sq < 4.0 * SMOOTH_M * SMOOTH_M && normals[k].dot(&normal) > SAME_SIDE {
                        (weight, off, mean) = (weight + w, off + w * height, mean + normals[k] * w);
                    }
                });
                if weight > 0.0 {
                    at += normal * (off / weight);
                    normal = mean.try_normalize(1e-12).unwrap_or(normal);
                }
            }
            (at, normal)
        };
        let places: Vec<_> = pool::map(chosen, 1, place);
        cloud.points = places.iter().map(|p| p.0).collect();
        cloud.normals = Some(places.iter().map(|p| p.1).collect());
        Ok(cloud)
    }
}

/// Pixels beside a depth edge.
fn edges(frame: &Frame) -> Mask {
    let width = frame.grid.width;
    let depths = &frame.map.depths_m;
    let step = |&i: &usize| {
        [i.wrapping_sub(1), i + 1, i.wrapping_sub(width), i + width].iter().any(|&j| {
            depths.get(j).is_none_or(|z| z.is_nan() || (z - depths[i]).abs() > EDGE_SHARE * depths[i])
        })
    };
    Mask::of(frame.grid, frame.near.iter().map(|&i| i as usize).filter(step))
}

/// Squared distance from a pixel's point to the nearest edge, square metres; infinite if none is near.
fn edge_distance_sq(frame: &Frame, edges: &Mask, pixel: usize) -> f64 {
    let at = frame.points[pixel];
    let mut nearest = f32::INFINITY;
    frame.around(pixel, EDGE_REACH_M, |other| {
        if edges.set[other] && is_finite(&frame.points[other]) {
            nearest = nearest.min((frame.points[other] - at).norm_squared());
        }
    });
    f64::from(nearest)
}
