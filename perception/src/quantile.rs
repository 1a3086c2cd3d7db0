//! Quantiles.

/// Quantiles of a segment's point heights that define its lower edge and its top, excluding noise. From: chosen.
pub const POINT_ENDS: (f64, f64) = (0.01, 0.99);
/// Lower and upper quantile that bound the voxels of a part, and protrusions of a body. From: chosen.
pub(crate) const VOXEL_ENDS: (f64, f64) = (0.03, 0.97);

/// Value at the given share of the sorted values; 0 if there are none. Reorders the values.
pub fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(rank(values.len(), share), f64::total_cmp).1
}

/// Median of the values; 0 if there are none.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(&mut values.collect::<Vec<f64>>(), 0.5)
}

fn rank(count: usize, share: f64) -> usize {
    ((count - 1) as f64 * share).round() as usize
}

/// Number of sampled values from which a bound of the quantile is estimated. From: work.
const SAMPLE: usize = 64;
/// Minimum number of values for which a bound is estimated from a sample. From: work.
const WORTH_IT: usize = 4 * SAMPLE;

/// [`quantile`], fast for shares near 0 and 1, without reordering the values.
pub fn end(values: &[f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = rank(values.len(), share);
    if share < 0.5 { lowest(values, rank, |v| v) } else { -lowest(values, values.len() - 1 - rank, |v| -v) }
}

/// Value of a rank (0 is the minimum) among the values mapped by `way`; sorts only those up to an estimated limit.
fn lowest(values: &[f64], rank: usize, way: impl Fn(f64) -> f64) -> f64 {
    /// Number of values that are skipped together. From: work.
    const BLOCK: usize = 16;
    let mut kept: Vec<f64> = Vec::new();
    if values.len() >= WORTH_IT {
        let limit = limit(values, rank, &way);
        // Neighbours in an image have like values: most blocks have none up to the limit.
        for block in values.chunks(BLOCK) {
            if block.iter().fold(false, |any, v| any | (way(*v) <= limit)) {
                kept.extend(block.iter().map(|v| way(*v)).filter(|v| *v <= limit));
            }
        }
    }
    if kept.len() <= rank {
        kept.clear();
        kept.extend(values.iter().map(|v| way(*v)));
    }
    *kept.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// Estimate, from a sample, of a value that probably more than `rank` of the mapped values do not exceed.
fn limit(values: &[f64], rank: usize, way: &impl Fn(f64) -> f64) -> f64 {
    /// Number of standard deviations added to a sampled rank as a safety margin. From: work.
    const SAFE: f64 = 3.0;
    let stride = values.len() / SAMPLE;
    let mut sample: [f64; SAMPLE] = std::array::from_fn(|i| way(values[i * stride]));
    let expected = (rank + 1) as f64 * SAMPLE as f64 / values.len() as f64;
    let safe = expected + SAFE * expected.sqrt() + 1.0;
    *sample.select_nth_unstable_by((safe as usize).min(SAMPLE - 1), f64::total_cmp).1
}
