//! Quantiles.

/// Quantiles of a segment's point heights that define its lower edge and its top, excluding noise.
/// From: chosen.
pub const POINT_ENDS: (f64, f64) = (0.01, 0.99);
/// Quantiles for the voxels of a part, and for protrusions of a body. From: chosen.
pub(crate) const VOXEL_ENDS: (f64, f64) = (0.03, 0.97);

/// Quantile of the values; 0 if empty. Reorders them.
pub fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(rank(values.len(), share), f64::total_cmp).1
}

/// Value in the middle; 0 for none.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(&mut values.collect::<Vec<f64>>(), 0.5)
}

fn rank(count: usize, share: f64) -> usize {
    ((count - 1) as f64 * share).round() as usize
}

/// Size of the sample for choosing a limit, and minimum number of values for sampling. From: work.
const SAMPLE: usize = 64;
const WORTH_IT: usize = 4 * SAMPLE;

/// [`quantile`] for shares near 0 and 1, without reordering all values.
pub fn end(values: &[f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = rank(values.len(), share);
    if share < 0.5 { lowest(values, rank, |v| v) } else { -lowest(values, values.len() - 1 - rank, |v| -v) }
}

/// Value of a rank (0 is the minimum) among mapped values; sorts only those up to a sampled limit.
fn lowest(values: &[f64], rank: usize, way: impl Fn(f64) -> f64) -> f64 {
    /// Values that are passed over together. From: work.
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

/// Upper limit from a sample, below which at least about `rank` of the values lie.
fn limit(values: &[f64], rank: usize, way: &impl Fn(f64) -> f64) -> f64 {
    /// Standard deviations added to a sampled rank as a safety margin. From: work.
    const SAFE: f64 = 3.0;
    let stride = values.len() / SAMPLE;
    let mut sample: [f64; SAMPLE] = std::array::from_fn(|i| way(values[i * stride]));
    let expected = (rank + 1) as f64 * SAMPLE as f64 / values.len() as f64;
    let safe = expected + SAFE * expected.sqrt() + 1.0;
    *sample.select_nth_unstable_by((safe as usize).min(SAMPLE - 1), f64::total_cmp).1
}
