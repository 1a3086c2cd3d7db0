//! Noise of a Kinect on an ideal frame: after Nguyen, Izadi and Lovell 2012, quantised disparity,
//! lost pixels.
//!
//! Every pixel draws from its own hash of (seed, frame, pixel), so the result does not depend on threads.

use crate::sim::frame::Frame;
use rayon::prelude::*;
use std::sync::OnceLock;

/// Parameters of a depth camera's noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthNoise {
    /// Distance between projector and camera, metres; points that the projector does not light are lost in
    /// shadow.
    pub baseline_m: f64,
    /// Number of disparity steps in one pixel.
    pub disparity_steps: f64,
    /// Share of pixels lost beside a depth edge.
    pub edge_loss: f64,
    /// Factor on both standard deviations of the depth noise; 0 leaves quantisation and lost pixels.
    pub scale: f64,
    /// Share of the returns that are lost in patches, at steep faces and depth edges first.
    pub holes: f64,
}

impl Default for DepthNoise {
    /// A Kinect of the first kind.
    fn default() -> Self {
        DepthNoise { baseline_m: 0.075, disparity_steps: 8.0, edge_loss: 0.5, scale: 1.0, holes: 0.0 }
    }
}

/// Incidence angle beyond which nothing returns, degrees.
const STEEPEST_DEG: f64 = 85.0;
/// Relative depth difference of neighbouring pixels from which there is a depth edge.
const EDGE_SHARE: f32 = 0.02;
/// Size of the patches of lost returns, pixels.
const PATCH_PX: usize = 10;

/// θ/(90° − θ) for the incidence angle θ with this cosine; infinite beyond `STEEPEST_DEG`.
fn steepness(cosine: f32) -> f32 {
    const CELLS: usize = 2048;
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let entry = |i: usize| {
            let deg = (i as f64 / CELLS as f64).min(1.0).acos().to_degrees();
            if deg > STEEPEST_DEG { f32::INFINITY } else { (deg / (90.0 - deg)) as f32 }
        };
        (0..=CELLS).map(entry).collect()
    });
    table[((cosine * CELLS as f32) as usize).min(CELLS)]
}

/// A standard normal number from 21 bits, by the quantiles of the distribution (interpolated, cut at 3.3 σ).
pub fn normal(bits: u64) -> f32 {
    const CELLS: usize = 2048;
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let share = |i: usize| (i as f64).clamp(1.0, CELLS as f64 - 1.0) / CELLS as f64;
        (0..=CELLS).map(|i| quantile(share(i)) as f32).collect()
    });
    let at = (bits & 0x1f_ffff) as f32 / 1024.0;
    let cell = (at as usize).min(CELLS - 1);
    let within = at - cell as f32;
    table[cell] + within * (table[cell + 1] - table[cell])
}

/// Quantile of the standard normal distribution by bisection of its integral (Zelen and Severo 1964, 26.2.17, error below 1e-7).
fn quantile(share: f64) -> f64 {
    let below = |x: f64| {
        let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
        let series = t
            * (0.319_381_530
                + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
        let tail = (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt() * series;
        if x >= 0.0 { 1.0 - tail } else { tail }
    };
    let (mut low, mut high) = (-6.0, 6.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if below(middle) < share { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Sixty-four well-mixed bits for a key (the finaliser of SplitMix64).
pub fn mix(key: u64) -> u64 {
    let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [0, 1) from well-mixed bits.
pub fn share(bits: u64) -> f64 {
    (bits >> 11) as f64 / ((1u64 << 53) as f64)
}

/// Applies the camera's noise to an ideal frame: depths along z in metres, NaN without a return.
///
/// σ_axial = 1.2 mm + 1.9 mm/m²·(z − 0.4 m)² + 0.1 mm·θ²/(√z·(90° − θ)²), σ_lateral = 0.8 px + 0.034 px·θ/(90° − θ).
pub fn observe(
    frame: &Frame,
    noise: &DepthNoise,
    range_m: (f64, f64),
    seed: u64,
    frame_number: u64,
) -> Vec<f32> {
    let (width, height) = (frame.intrinsics.width.max(1), frame.intrinsics.height);
    let key = mix(mix(seed) ^ frame_number);
    let disparity = frame.intrinsics.fx * noise.baseline_m * noise.disparity_steps;
    let mut out = vec![f32::NAN; width * height];
    out.par_chunks_mut(width).enumerate().with_min_len(8).for_each_init(
        || vec![false; width],
        |shadow, (row, line)| {
            let start = row * width;
            cast_shadow(&frame.depth_m[start..start + width], frame.intrinsics.fx * noise.baseline_m, shadow);
            for (column, out) in line.iter_mut().enumerate() {
                if !shadow[column] {
                    *out = pixel(frame, noise, disparity, range_m, key, (column, row));
                }
            }
        },
    );
    if noise.holes > 0.0 {
        lose_patches(frame, noise.holes, key, &mut out);
    }
    out
}

/// Removes a share of the returns: those with the greatest sum of a random field smooth over `PATCH_PX`, the
/// steepness of the surface, and a bonus at depth edges.
fn lose_patches(frame: &Frame, holes: f64, key: u64, depths_m: &mut [f32]) {
    let width = frame.intrinsics.width.max(1);
    let corner = |column: usize, row: usize| normal(mix(mix(key ^ (column as u64) << 32) ^ row as u64));
    let score = |here: usize| {
        let (column, row) = (here % width, here / width);
        let (i, j) = (column / PATCH_PX, row / PATCH_PX);
        let [a, b] = [column, row].map(|at| (at % PATCH_PX) as f32 / PATCH_PX as f32);
        let patch = (1.0 - b) * ((1.0 - a) * corner(i, j) + a * corner(i + 1, j))
            + b * ((1.0 - a) * corner(i, j + 1) + a * corner(i + 1, j + 1));
        let at_edge = if is_edge(frame, column, row) { 1.5 } else { 0.0 };
        patch + 2.0 * (1.0 - frame.cosine[here]).powi(2) + at_edge
    };
    let mut scores: Vec<(f32, usize)> = (0..depths_m.len())
        .filter(|&here| depths_m[here].is_finite())
        .map(|here| (score(here), here))
        .collect();
    let lost = ((scores.len() as f64 * holes) as usize).min(scores.len());
    scores.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    scores[..lost].iter().for_each(|&(_, here)| depths_m[here] = f32::NAN);
}

#[inline]
fn pixel(
    frame: &Frame,
    noise: &DepthNoise,
    disparity: f64,
    range_m: (f64, f64),
    key: u64,
    (column, row): (usize, usize),
) -> f32 {
    let (width, height) = (frame.intrinsics.width, frame.intrinsics.height);
    let here = row * width + column;
    let bits = mix(key ^ here as u64);
    if is_edge(frame, column, row) && share(mix(bits)) < noise.edge_loss {
        return f32::NAN;
    }
    let scale = noise.scale as f32;
    let steep = steepness(frame.cosine[here]);
    let lateral_px = if steep.is_finite() { scale * (0.8 + 0.034 * steep) } else { 0.0 };
    let shifted =
        |at: usize, by: f32, size: usize| ((at as f32 + by).round().max(0.0) as usize).min(size - 1);
    let u = shifted(column, lateral_px * normal(bits), width);
    let v = shifted(row, lateral_px * normal(bits >> 21), height);
    let source = v * width + u;
    let (z, steep) = (frame.depth_m[source], steepness(frame.cosine[source]));
    if !z.is_finite() || !steep.is_finite() {
        return f32::NAN;
    }
    let axial_m = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4) + 0.0001 * steep * steep / z.sqrt();
    let noisy = f64::from(z + scale * axial_m * normal(bits >> 42));
    let steps = (disparity / noisy).round();
    let quantised = disparity / steps;
    if quantised >= range_m.0 && quantised <= range_m.1 { quantised as f32 } else { f32::NAN }
}

/// True if a horizontal or vertical neighbour differs in depth by [`EDGE_SHARE`].
#[inline]
fn is_edge(frame: &Frame, column: usize, row: usize) -> bool {
    let (width, height) = (frame.intrinsics.width, frame.intrinsics.height);
    let here = row * width + column;
    let z = frame.depth_m[here];
    let jumps = |other: usize| {
        let gap = (frame.depth_m[other] - z).abs();
        gap.is_nan() || gap > EDGE_SHARE * z.min(frame.depth_m[other])
    };
    (column > 0 && jumps(here - 1))
        || (column + 1 < width && jumps(here + 1))
        || (row > 0 && jumps(here - width))
        || (row + 1 < height && jumps(here + width))
}

/// Marks the pixels of a row that the projector, one baseline to the right, does not light because its ray
/// hits a nearer surface first.
fn cast_shadow(depth_m: &[f32], focal_baseline: f64, shadow: &mut [bool]) {
    let mut least = f64::INFINITY;
    for column in (0..depth_m.len()).rev() {
        let in_projector = column as f64 - focal_baseline / f64::from(depth_m[column]);
        // One pixel of slack: on a smooth surface the order never turns by more.
        shadow[column] = in_projector > least + 1.0;
        least = least.min(in_projector);
    }
}
