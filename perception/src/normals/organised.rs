//! Normals of organised clouds from the pixels around each point: no tree.

use super::Normals;
use crate::cloud::{Cloud, Grid, is_finite};
use crate::spread;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// How far to look around a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrganisedOptions {
    /// Pixels to each side: 2 looks at 5 x 5.
    pub reach: usize,
    /// A neighbour counts if its depth differs by no more than this part of the depth (and `base_m`): beyond is another surface.
    pub depth_step_share: f32,
    /// Least depth difference that separates surfaces, metres.
    pub base_m: f32,
    /// Fewest neighbours for a normal.
    pub least: usize,
}

impl Default for OrganisedOptions {
    fn default() -> Self {
        OrganisedOptions { reach: 2, depth_step_share: 0.02, base_m: 0.005, least: 6 }
    }
}

/// Normals from the window around each pixel, turned towards the camera; `None` if the cloud has no grid that fits its points.
/// Expects the camera's optical frame (depth along z).
pub fn organised(cloud: &Cloud, options: &OrganisedOptions) -> Option<Normals> {
    let Grid { width, height } = cloud.grid.filter(|_| cloud.check().is_ok())?;
    let _span = tracing::debug_span!("organised normals", points = cloud.len()).entered();
    let mut found = vec![[f32::NAN; 4]; cloud.len()];
    found.par_chunks_mut(width.max(1)).enumerate().for_each(|(row, out)| {
        for (column, out) in out.iter_mut().enumerate() {
            let rows = row.saturating_sub(options.reach)..(row + options.reach + 1).min(height);
            let columns = column.saturating_sub(options.reach)..(column + options.reach + 1).min(width);
            let window =
                rows.flat_map(|v| cloud.points[v * width + columns.start..v * width + columns.end].iter());
            *out = surface(&cloud.points[row * width + column], window, options);
        }
    });
    Some(Normals {
        normals: found.iter().map(|v| Vector3::new(v[0], v[1], v[2])).collect(),
        variation: found.iter().map(|v| v[3]).collect(),
    })
}

fn surface<'a>(
    at: &Point3<f32>,
    window: impl Iterator<Item = &'a Point3<f32>>,
    options: &OrganisedOptions,
) -> [f32; 4] {
    let none = [f32::NAN; 4];
    if !is_finite(at) {
        return none;
    }
    let step = options.base_m.max(options.depth_step_share * at.z.abs());
    let (mut count, mut sum, mut products) = (0usize, [0f32; 3], [0f32; 6]);
    for p in window.filter(|p| (p.z - at.z).abs() <= step) {
        let [x, y, z] = [p.x - at.x, p.y - at.y, p.z - at.z];
        count += 1;
        sum = [sum[0] + x, sum[1] + y, sum[2] + z];
        let terms = [x * x, x * y, x * z, y * y, y * z, z * z];
        (0..6).for_each(|i| products[i] += terms[i]);
    }
    if count < options.least.max(3) {
        return none;
    }
    let covariance = spread::covariance(count as f64, sum.map(f64::from), products.map(f64::from));
    let Some(least) = spread::least(&covariance) else { return none };
    let n = least.normal.map(|v| v as f32);
    let sign = if n[0] * at.x + n[1] * at.y + n[2] * at.z > 0.0 { -1.0 } else { 1.0 };
    [sign * n[0], sign * n[1], sign * n[2], least.share as f32]
}
