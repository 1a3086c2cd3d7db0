//! Removal of stray points.

use crate::neighbours::Neighbours;

/// Result of the outlier filter [`statistical`].
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// Indices of the kept points, ascending; missing returns are dropped.
    pub indices: Vec<u32>,
    /// Mean over all points of the mean distance to their neighbours, metres.
    pub mean_m: f64,
    /// Standard deviation of that mean distance over all points, metres.
    pub sigma_m: f64,
    /// Mean distance to the neighbours beyond which points are dropped, metres.
    pub limit_m: f64,
}

/// Keeps the points whose mean distance to their `k` nearest points (themselves included) is below the cloud's mean
/// plus `sigmas` standard deviations (Rusu et al. 2008, section 4.1). In a cloud of fewer than `k` points, all of them
/// count as neighbours.
pub fn statistical(tree: &Neighbours, k: usize, sigmas: f64) -> Kept {
    let _span = tracing::debug_span!("statistical outliers", points = tree.len(), k).entered();
    let means = tree.map_all(k, f32::NAN, |_, near| {
        near.distances_sq().iter().map(|d| d.sqrt()).sum::<f32>() / near.len() as f32
    });
    let valid = || means.iter().filter(|m| !m.is_nan()).map(|&m| f64::from(m));
    let count = valid().count() as f64;
    let mean_m = if count > 0.0 { valid().sum::<f64>() / count } else { 0.0 };
    let square = valid().map(|m| (m - mean_m).powi(2)).sum::<f64>();
    let sigma_m = if count > 1.0 { (square / (count - 1.0)).sqrt() } else { 0.0 };
    let limit_m = mean_m + sigmas * sigma_m;
    let stays = |m: f32| f64::from(m) < limit_m || (sigma_m == 0.0 && f64::from(m) <= limit_m);
    let indices = (0u32..).zip(&means).filter(|(_, m)| stays(**m)).map(|(i, _)| i).collect();
    Kept { indices, mean_m, sigma_m, limit_m }
}
