//! Orientations of walls: k-means of the directions of horizontal normals (section 4.2), as many as the histogram has
//! peaks.

use nalgebra::Vector2;
use std::f64::consts::{PI, TAU};

/// Options for the orientations of walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientationOptions {
    /// Number of orientations (the paper: two), at most eight; `None`: as many as stand out.
    pub count: Option<usize>,
    /// Maximum angle between a direction and its orientation, radians.
    pub within_rad: f64,
    /// Minimum share of all directions near an orientation.
    pub least_share: f64,
}

impl Default for OrientationOptions {
    fn default() -> Self {
        OrientationOptions { count: None, within_rad: 0.3, least_share: 0.04 }
    }
}

/// Orientations of walls, and the orientation of each given direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Orientations {
    /// Direction of each orientation's normal, modulo half a turn, radians from 0 to π.
    pub centres_rad: Vec<f64>,
    /// Index of the orientation of each given direction; `None` if the direction is far from all.
    pub of: Vec<Option<u32>>,
}

/// Number of histogram bins over half a turn.
const BINS: usize = 90;
/// Standard deviation of histogram smoothing, bins.
const SMOOTH: f64 = 2.0;
/// Minimum ratio of a peak to the histogram's median; a round room has no such peak.
const STANDS_OUT: f64 = 1.7;
const MOST: usize = 8;
const ROUNDS: usize = 30;

/// Groups directions of horizontal normals (radians) into orientations; opposite directions are equal.
pub fn orientations(directions_rad: &[f64], options: &OrientationOptions) -> Orientations {
    let mut starts = peaks(directions_rad, options);
    starts.truncate(options.count.unwrap_or(MOST).min(MOST));
    let vectors: Vec<Vector2<f64>> = directions_rad.iter().map(|d| doubled(*d)).collect();
    let mut centres: Vec<Vector2<f64>> = starts.into_iter().map(doubled).collect();
    let within = (2.0 * options.within_rad).cos();
    let nearest = |centres: &[Vector2<f64>], v: &Vector2<f64>| {
        let best = (0..centres.len()).max_by(|&a, &b| centres[a].dot(v).total_cmp(&centres[b].dot(v)));
        best.filter(|&c| centres[c].dot(v) >= within).map(|c| c as u32)
    };
    let mut of = vec![None; vectors.len()];
    for _ in 0..ROUNDS {
        let found: Vec<Option<u32>> = vectors.iter().map(|v| nearest(&centres, v)).collect();
        let same = found == of;
        of = found;
        if same {
            break;
        }
        let mut sums = vec![Vector2::zeros(); centres.len()];
        of.iter().zip(&vectors).for_each(|(c, v)| {
            if let Some(c) = c {
                sums[*c as usize] += v;
            }
        });
        for (centre, sum) in centres.iter_mut().zip(sums) {
            *centre = sum.try_normalize(1e-9).unwrap_or(*centre);
        }
    }
    let centres_rad = centres.iter().map(|c| (0.5 * c.y.atan2(c.x)).rem_euclid(PI)).collect();
    Orientations { centres_rad, of }
}

/// Unit vector of the doubled angle, for averaging directions modulo half a turn.
fn doubled(direction_rad: f64) -> Vector2<f64> {
    let (sin, cos) = (2.0 * direction_rad).sin_cos();
    Vector2::new(cos, sin)
}

/// Directions at the peaks of the smoothed histogram, the highest first.
fn peaks(directions_rad: &[f64], options: &OrientationOptions) -> Vec<f64> {
    let mut histogram = [0.0; BINS];
    for direction in directions_rad.iter().filter(|d| d.is_finite()) {
        histogram[((direction.rem_euclid(PI) / PI * BINS as f64) as usize).min(BINS - 1)] += 1.0;
    }
    let all: f64 = histogram.iter().sum();
    let reach = (3.0 * SMOOTH) as i64;
    let around = |bin: usize, by: i64| (bin as i64 + by).rem_euclid(BINS as i64) as usize;
    let smooth: Vec<f64> = (0..BINS)
        .map(|bin| {
            let weight = |by: i64| (-0.5 * (by as f64 / SMOOTH).powi(2)).exp() / (SMOOTH * TAU.sqrt());
            (-reach..=reach).map(|by| weight(by) * histogram[around(bin, by)]).sum()
        })
        .collect();
    let half = (options.within_rad / PI * BINS as f64) as i64;
    let share = |bin: usize| (-half..=half).map(|by| histogram[around(bin, by)]).sum::<f64>() / all;
    let mut sorted = smooth.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[BINS / 2];
    let is_peak = |bin: &usize| {
        let height = smooth[*bin];
        let highest = (-half..=half).all(|by| {
            let other = smooth[around(*bin, by)];
            other < height || (other == height && by >= 0)
        });
        highest && height > STANDS_OUT * median && share(*bin) >= options.least_share
    };
    let mut found: Vec<usize> = (0..BINS).filter(is_peak).collect();
    found.sort_by(|&a, &b| smooth[b].total_cmp(&smooth[a]));
    found.into_iter().map(|bin| (bin as f64 + 0.5) / BINS as f64 * PI).collect()
}
