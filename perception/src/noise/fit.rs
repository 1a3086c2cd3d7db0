//! Estimates a camera's noise from plane surfaces, on which inverse depth is linear in the pixel coordinates.

use super::Sensor;
use crate::pool;
use crate::quantile::quantile;
use crate::surface::level::Surface;
use crate::surface::outline::Outline;
use crate::visibility::DepthMap;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Side of the blocks of pixels whose residuals are used, pixels. From: chosen.
const BLOCK_PX: usize = 24;
/// Side of the smaller cells whose means show the error correlation of neighbouring pixels, pixels. From: chosen.
pub(crate) const CELL_PX: usize = 8;
/// Maximum number of blocks used of a view. From: work.
const BLOCKS: usize = 24;
/// Minimum share of a block's pixels on the surface. From: chosen.
const COVERED: f64 = 0.8;
/// Maximum distance of a return from the surface, as a share of the depth. From: chosen.
const NEAR_SHARE: f64 = 0.012;
/// Minimum distance of a block's centre from the surface's outline, metres. From: chosen.
const INSIDE_M: f64 = 0.02;
/// Residual, in standard deviations of the block, beyond which a pixel is an outlier. From: chosen.
const OUTLIER: f64 = 4.0;
/// Minimum number of blocks for an estimate. From: chosen.
const FEWEST: usize = 4;
/// Weight of the assumed noise in the estimate, in blocks. From: chosen.
const ASSUMED: f64 = 4.0;
/// Minimum and maximum of the estimated noise, as multiples of the assumed noise. From: chosen.
const BETWEEN: (f64, f64) = (0.5, 6.0);
/// Minimum of either noise term, as a share of the assumed term scaled to the measured noise. From: chosen.
const LEAST: f64 = 0.2;
/// Number of parameters of a plane. From: derived, two slopes and a height.
const PLANE: f64 = 3.0;

/// Residuals of several views' returns at plane surfaces.
#[derive(Clone, Debug, Default)]
pub struct Residuals {
    blocks: Vec<Block>,
}

/// Block of pixels on a surface in one view.
#[derive(Clone, Copy, Debug)]
struct Block {
    depth_m: f64,
    /// Standard deviation of a return along its ray, metres.
    sigma_m: f64,
    /// Number of independent returns that a cell of 8 by 8 pixels counts for.
    looks: f64,
}

impl Residuals {
    /// Adds the residuals of a view's returns at a surface.
    pub fn add(&mut self, map: &DepthMap, surface: &Surface) {
        let (width, height) = (map.intrinsics.width, map.intrinsics.height);
        let camera_from_surface = map.camera_from_world * surface.surface_from_world.inverse();
        let normal = camera_from_surface.rotation * Vector3::z();
        let offset_m = normal.dot(&camera_from_surface.translation.vector);
        let outline = surface.outline();
        let corners: Vec<(usize, usize)> = (0..height / BLOCK_PX)
            .flat_map(|j| (0..width / BLOCK_PX).map(move |i| (i * BLOCK_PX, j * BLOCK_PX)))
            .filter(|&(u, v)| is_on(map, &outline, (u + BLOCK_PX / 2, v + BLOCK_PX / 2), &normal, offset_m))
            .collect();
        let step = corners.len().div_ceil(BLOCKS).max(1);
        let corners: Vec<_> = corners.into_iter().step_by(step).collect();
        self.blocks.extend(pool::filter(corners.len(), 1, |n| block(map, corners[n], &normal, offset_m)));
    }

    /// Estimates the sensor's noise; parameters without evidence stay as assumed.
    pub fn fit(&self, assumed: &Sensor) -> Sensor {
        if self.blocks.len() < FEWEST {
            return *assumed;
        }
        let mut times: Vec<f64> =
            self.blocks.iter().map(|b| b.sigma_m / assumed.frontal_sigma_m(b.depth_m)).collect();
        let times = quantile(&mut times, 0.5).clamp(BETWEEN.0, BETWEEN.1);
        // Both terms at once; where all lies at one depth their proportion stays.
        let prior = Vector2::new(assumed.axial_m, assumed.growth_per_m) * times;
        let scale = Vector2::new(1.0 / prior.x, 1.0 / prior.y);
        let mut normal = Matrix2::from_diagonal(&scale.component_mul(&scale)) * ASSUMED;
        let mut right = normal * prior;
        for block in &self.blocks {
            let row = Vector2::new(1.0, (block.depth_m - assumed.range_m.0).powi(2));
            let weight = (times * assumed.frontal_sigma_m(block.depth_m)).powi(-2);
            normal += row * row.transpose() * weight;
            right += row * (block.sigma_m * weight);
        }
        let found = normal.cholesky().map_or(prior, |c| c.solve(&right));
        let mut looks: Vec<f64> = self.blocks.iter().map(|b| b.looks).collect();
        Sensor {
            axial_m: found.x.max(LEAST * prior.x),
            growth_per_m: found.y.max(LEAST * prior.y),
            looks: quantile(&mut looks, 0.5).clamp(1.0, (CELL_PX * CELL_PX) as f64),
            ..*assumed
        }
    }
}

/// True if a pixel shows the surface, well inside its outline; `normal`, `offset_m`: the surface's plane in the camera
/// frame.
fn is_on(
    map: &DepthMap,
    outline: &Outline,
    (u, v): (usize, usize),
    normal: &Vector3<f64>,
    offset_m: f64,
) -> bool {
    let z = f64::from(map.depths_m[v * map.intrinsics.width + u]);
    let p = map.intrinsics.unproject(u as f64, v as f64, z);
    z.is_finite()
        && (normal.dot(&p.coords) - offset_m).abs() < NEAR_SHARE * z
        && outline.covers(&map.camera_from_world.inverse_transform_point(&p), -INSIDE_M)
}

/// Noise of a block of pixels, from residuals of inverse depth, which is linear in the pixels; `None` if too few pixels
/// are on the surface.
fn block(map: &DepthMap, (left, top): (usize, usize), normal: &Vector3<f64>, offset_m: f64) -> Option<Block> {
    let mut seen: Vec<(usize, Vector3<f64>, f64)> = Vec::with_capacity(BLOCK_PX * BLOCK_PX);
    let mut depth_m = 0.0;
    for (j, i) in (0..BLOCK_PX).flat_map(|j| (0..BLOCK_PX).map(move |i| (j, i))) {
        let (u, v) = (left + i, top + j);
        let z = f64::from(map.depths_m[v * map.intrinsics.width + u]);
        let p = map.intrinsics.unproject(u as f64, v as f64, z);
        if z.is_finite() && (normal.dot(&p.coords) - offset_m).abs() < NEAR_SHARE * z {
            let [x, y] = [i, j].map(|k| k as f64 / BLOCK_PX as f64 - 0.5);
            seen.push((i / CELL_PX + BLOCK_PX / CELL_PX * (j / CELL_PX), Vector3::new(1.0, x, y), 1.0 / z));
            depth_m += z;
        }
    }
    if (seen.len() as f64) < COVERED * (BLOCK_PX * BLOCK_PX) as f64 {
        return None;
    }
    depth_m /= seen.len() as f64;
    let (mut sigma, mut residuals) = (f64::INFINITY, Vec::new());
    let mut gate = vec![true; seen.len()];
    for _ in 0..2 {
        let line = fit_plane(
            seen.iter().zip(&gate).filter(|(_, within)| **within).map(|((_, row, q), _)| (*row, *q)),
        )?;
        residuals = seen.iter().map(|(_, row, q)| q - row.dot(&line)).collect();
        let within = residuals.iter().zip(&gate).filter(|(_, within)| **within);
        let (n, squares) = within.fold((0.0, 0.0), |(n, s), (r, _)| (n + 1.0, s + r * r));
        sigma = (squares / (n - PLANE).max(1.0)).sqrt();
        gate = residuals.iter().map(|r| r.abs() <= OUTLIER * sigma).collect();
    }
    Some(Block { depth_m, sigma_m: sigma * depth_m * depth_m, looks: looks(&seen, &residuals, &gate, sigma) })
}

/// Least-squares coefficients of inverse depth as a linear function of the rows; `None` if singular.
fn fit_plane(rows: impl Iterator<Item = (Vector3<f64>, f64)>) -> Option<Vector3<f64>> {
    let (normal, right) = rows.fold((Matrix3::zeros(), Vector3::zeros()), |(n, r), (row, q)| {
        (n + row * row.transpose(), r + row * q)
    });
    normal.cholesky().map(|c| c.solve(&right))
}

/// Number of independent errors among a cell's returns: variance of a return divided by variance of the cells' means.
fn looks(seen: &[(usize, Vector3<f64>, f64)], residuals: &[f64], gate: &[bool], sigma: f64) -> f64 {
    /// Number of cells in a block. From: derived, the square of their number per side.
    const CELLS: usize = (BLOCK_PX / CELL_PX) * (BLOCK_PX / CELL_PX);
    let mut sums = [(0.0, 0.0); CELLS];
    for ((cell, ..), (r, _)) in
        seen.iter().map(|s| (s.0, s.1)).zip(residuals.iter().zip(gate).filter(|g| *g.1))
    {
        sums[cell].0 += r;
        sums[cell].1 += 1.0;
    }
    // A plane was fitted to as few cells: three of them are not free.
    let squares: f64 = sums.iter().filter(|s| s.1 > 0.0).map(|(sum, n)| (sum / n).powi(2)).sum();
    sigma * sigma / (squares / (CELLS as f64 - PLANE)).max(f64::MIN_POSITIVE)
}
