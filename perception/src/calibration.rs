//! Calibration of stated probabilities: Brier score and reliability diagram.

use serde::Serialize;

/// Claim: stated probability, and true if the claim was right.
pub type Claim = (f64, bool);

/// Bin of a reliability diagram: claims of similar stated probability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// Lower edge of the bin (inclusive).
    pub low: f64,
    /// Upper edge of the bin (exclusive except in the last bin).
    pub high: f64,
    /// Number of claims in the bin.
    pub count: usize,
    /// Mean stated probability of the claims.
    pub stated: f64,
    /// Share of the claims that were right.
    pub came_true: f64,
}

/// Reliability of the stated probabilities of some claims.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reliability {
    /// Mean squared difference between stated probability and truth (Brier 1950): 0 is perfect, always stating the base
    /// rate gives `base × (1 − base)`.
    pub brier: f64,
    /// Brier score of always stating the base rate.
    pub brier_of_base_rate: f64,
    /// Expected calibration error: mean difference between stated probability and true share, weighted by the bins'
    /// counts.
    pub expected_error: f64,
    /// Number of claims.
    pub count: usize,
    /// Bins of equal width, ascending.
    pub bins: Vec<Bin>,
}

/// Scores claims in `bins` (at least one) bins of equal width; probabilities that are not finite are skipped, others
/// clamped to [0, 1].
pub fn reliability(claims: &[Claim], bins: usize) -> Reliability {
    let bins = bins.max(1);
    let sound: Vec<Claim> =
        claims.iter().filter(|(p, _)| p.is_finite()).map(|&(p, t)| (p.clamp(0.0, 1.0), t)).collect();
    let n = sound.len().max(1) as f64;
    let hit = |t: bool| f64::from(u8::from(t));
    let brier = sound.iter().map(|&(p, t)| (p - hit(t)).powi(2)).sum::<f64>() / n;
    let base = sound.iter().map(|&(_, t)| hit(t)).sum::<f64>() / n;
    let mut sums = vec![(0_usize, 0.0, 0.0); bins];
    for &(p, t) in &sound {
        let bin = &mut sums[((p * bins as f64) as usize).min(bins - 1)];
        *bin = (bin.0 + 1, bin.1 + p, bin.2 + hit(t));
    }
    let bins: Vec<Bin> = sums
        .iter()
        .enumerate()
        .map(|(i, &(count, stated, came_true))| Bin {
            low: i as f64 / bins as f64,
            high: (i + 1) as f64 / bins as f64,
            count,
            stated: stated / count.max(1) as f64,
            came_true: came_true / count.max(1) as f64,
        })
        .collect();
    let expected_error =
        bins.iter().map(|b| b.count as f64 * (b.stated - b.came_true).abs()).sum::<f64>() / n;
    Reliability { brier, brier_of_base_rate: base * (1.0 - base), expected_error, count: sound.len(), bins }
}
