//! Rates, means, differences and calibration, with 95 % intervals.
//!
//! Rates get Wilson's score interval. Everything else gets a percentile bootstrap that resamples whole
//! *groups* (all runs in one scene), since runs in the same scene are not independent; its seed is fixed, so
//! the same rows give the same interval. Fewer than [`LEAST_GROUPS`] groups get none. For shares of 0 or 1 the
//! bootstrap is degenerate; they get Wilson's interval with the number of groups as observations.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// 97.5 % quantile of the standard normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;
/// Number of bootstrap resamples.
const RESAMPLES: usize = 2000;
/// Minimum number of groups for a bootstrap interval. From: the first that has more distinct resamples
/// (6435, the multisets of 8 out of 8) than are drawn; with 2 there are 3, and no interval follows from them.
pub const LEAST_GROUPS: usize = 8;
/// Maximum number of groups whose signs are flipped in all combinations; beyond, [`FLIPS`] are drawn.
const MOST_EXACT: usize = 12;
/// Number of random combinations of signs.
const FLIPS: u32 = 10_000;
/// Seed of the bootstrap and of the random signs.
const SEED: u64 = 4;

/// Estimated value with its interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Estimate from all observations.
    pub value: f64,
    /// 95 % interval; `None` if there are too few groups.
    pub interval: Option<[f64; 2]>,
    /// Number of observations.
    pub n: usize,
}

/// A value observed in a group: a run in a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Group; observations of one group may be dependent.
    pub group: u64,
    /// Observed value.
    pub value: f64,
}

/// Two values observed under the same conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Group; pairs of one group may be dependent.
    pub group: u64,
    /// First value.
    pub a: f64,
    /// Second value.
    pub b: f64,
}

/// A share `hits / n` with Wilson's score interval; `None` for `n = 0`.
pub fn rate(hits: usize, n: usize) -> Option<Estimate> {
    if n == 0 {
        return None;
    }
    let (k, n_f) = (hits as f64, n as f64);
    let p = k / n_f;
    let z2 = Z_95 * Z_95;
    let middle = (p + z2 / (2.0 * n_f)) / (1.0 + z2 / n_f);
    let half = Z_95 / (1.0 + z2 / n_f) * (p * (1.0 - p) / n_f + z2 / (4.0 * n_f * n_f)).sqrt();
    Some(Estimate { value: p, interval: Some([(middle - half).max(0.0), (middle + half).min(1.0)]), n })
}

/// Mean with its bootstrap interval; `None` without observations.
pub fn mean(observations: &[Observation]) -> Option<Estimate> {
    let sums = sums(observations.iter().map(|o| (o.group, [o.value, 1.0])));
    estimate(observations.len(), &sums, |[total, n]| total / n)
}

/// The ratio of two sums over the same observations, such as hits by attempts; `None` if the second sum is zero.
pub fn ratio(pairs: &[Pair]) -> Option<Estimate> {
    let sums = sums(pairs.iter().map(|p| (p.group, [p.a, p.b])));
    let n = pairs.iter().map(|p| p.b).sum::<f64>() as usize;
    estimate(n, &sums, |[a, b]| a / b).map(|found| at_an_end(found, sums.len()))
}

/// Replaces the degenerate bootstrap interval of a share of 0 or 1 by Wilson's interval, each group counting
/// once.
fn at_an_end(found: Estimate, groups: usize) -> Estimate {
    let hits = match found.value {
        0.0 => 0,
        1.0 => groups,
        _ => return found,
    };
    Estimate { interval: rate(hits, groups).and_then(|e| e.interval), ..found }
}

/// Mean of `a - b` with its bootstrap interval; `None` without pairs.
pub fn difference(pairs: &[Pair]) -> Option<Estimate> {
    let sums = sums(pairs.iter().map(|p| (p.group, [p.a - p.b, 1.0])));
    estimate(pairs.len(), &sums, |[total, n]| total / n)
}

/// Share of `b` that `a` saves, `1 - mean(a) / mean(b)`; `None` if the mean of `b` is zero.
pub fn saving(pairs: &[Pair]) -> Option<Estimate> {
    let sums = sums(pairs.iter().map(|p| (p.group, [p.a, p.b])));
    estimate(pairs.len(), &sums, |[a, b]| 1.0 - a / b)
}

/// Two-sided p-value of the sign-flip permutation test (Fisher's randomisation test) for a mean of `a - b` of
/// 0. The pairs of a group change their signs together; `None` without pairs.
pub fn sign_flip(pairs: &[Pair]) -> Option<f64> {
    let sums: Vec<f64> =
        sums(pairs.iter().map(|p| (p.group, [p.a - p.b, 0.0]))).iter().map(|[sum, _]| *sum).collect();
    let observed = sums.iter().sum::<f64>().abs() * (1.0 - 1e-9);
    let is_extreme = |flipped: &dyn Fn(usize) -> bool| {
        let flip = |(n, sum): (usize, &f64)| if flipped(n) { -sum } else { *sum };
        sums.iter().enumerate().map(flip).sum::<f64>().abs() >= observed
    };
    if sums.is_empty() {
        return None;
    }
    if sums.len() <= MOST_EXACT {
        let all = 1u32 << sums.len();
        let extreme = (0..all).filter(|signs| is_extreme(&|n| (signs >> n) & 1 == 1)).count();
        return Some(extreme as f64 / f64::from(all));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let extreme = (0..FLIPS).filter(|_| {
        let signs: Vec<bool> = sums.iter().map(|_| rng.random()).collect();
        is_extreme(&|n| signs[n])
    });
    // The observed signs are one of the combinations.
    Some((extreme.count() + 1) as f64 / f64::from(FLIPS + 1))
}

/// Median (the mean of the two middle values); none without values.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    match n {
        0 => None,
        n if n % 2 == 1 => Some(sorted[n / 2]),
        n => Some((sorted[n / 2 - 1] + sorted[n / 2]) / 2.0),
    }
}

/// Sums of the first and of the second numbers of each group, ordered by group number.
fn sums(values: impl Iterator<Item = (u64, [f64; 2])>) -> Vec<[f64; 2]> {
    let mut groups = std::collections::BTreeMap::<u64, [f64; 2]>::new();
    for (group, [a, b]) in values {
        let sum = groups.entry(group).or_insert([0.0; 2]);
        *sum = [sum[0] + a, sum[1] + b];
    }
    groups.into_values().collect()
}

fn total(sums: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    sums.fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y])
}

fn estimate(n: usize, groups: &[[f64; 2]], statistic: impl Fn([f64; 2]) -> f64) -> Option<Estimate> {
    let value = statistic(total(groups.iter().copied()));
    if groups.is_empty() || !value.is_finite() {
        return None;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut resampled: Vec<f64> = (0..RESAMPLES)
        .map(|_| statistic(total((0..groups.len()).map(|_| groups[rng.random_range(0..groups.len())]))))
        .filter(|v| v.is_finite())
        .collect();
    resampled.sort_by(f64::total_cmp);
    let at = |share: f64| resampled[(share * (resampled.len() - 1) as f64).round() as usize];
    let interval = (groups.len() >= LEAST_GROUPS && !resampled.is_empty()).then(|| [at(0.025), at(0.975)]);
    Some(Estimate { value, interval, n })
}

/// A stated probability, and true if the event occurred.
pub type Forecast = (f64, bool);

/// Brier score (1950), the mean squared difference between stated probabilities and outcomes: 0 is perfect, a
/// constant one half gives 0.25; `None` without forecasts.
pub fn brier(forecasts: &[Forecast]) -> Option<f64> {
    let squared = |&(p, happened): &Forecast| (p - f64::from(happened)).powi(2);
    (!forecasts.is_empty()).then(|| forecasts.iter().map(squared).sum::<f64>() / forecasts.len() as f64)
}

/// Bin of a reliability plot: the forecasts with stated probabilities in a range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bin {
    /// Lower bound of the bin.
    pub from: f64,
    /// Upper bound of the bin, which only the last bin includes.
    pub to: f64,
    /// Mean of the stated probabilities in the bin.
    pub stated: f64,
    /// Share of the forecasts that came true, with Wilson's interval.
    pub observed: Estimate,
}

/// Sorts forecasts into `bins` bins of equal width; returns the bins that are not empty.
pub fn reliability(forecasts: &[Forecast], bins: usize) -> Vec<Bin> {
    let bins = bins.max(1);
    let bin_of = |p: f64| ((p * bins as f64).floor().max(0.0) as usize).min(bins - 1);
    (0..bins)
        .filter_map(|b| {
            let inside: Vec<&Forecast> = forecasts.iter().filter(|(p, _)| bin_of(*p) == b).collect();
            let hits = inside.iter().filter(|(_, happened)| *happened).count();
            Some(Bin {
                from: b as f64 / bins as f64,
                to: (b + 1) as f64 / bins as f64,
                stated: inside.iter().map(|(p, _)| p).sum::<f64>() / inside.len() as f64,
                observed: rate(hits, inside.len())?,
            })
        })
        .collect()
}

/// Expected calibration error: the distance between stated and observed shares, weighted by the bins'
/// counts; `None` without forecasts.
pub fn calibration_error(forecasts: &[Forecast], bins: usize) -> Option<f64> {
    let weighted = |b: &Bin| b.observed.n as f64 * (b.stated - b.observed.value).abs();
    let sum: f64 = reliability(forecasts, bins).iter().map(weighted).sum();
    (!forecasts.is_empty()).then(|| sum / forecasts.len() as f64)
}
