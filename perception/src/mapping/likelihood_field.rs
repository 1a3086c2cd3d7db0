//! Likelihood field: log density of a mixture of Gaussians around the points of a plan, on a grid.

use super::station::Spot;
use nalgebra::{Isometry2, Point2, Vector2};

/// Maximum distance of an inlier from its plan point, in standard deviations.
pub(super) const REACH: f64 = 3.0;
/// Density of outliers relative to that of a plan point of mean weight: a Gaussian at `REACH` standard deviations.
pub(super) const OUTLIERS: f64 = 0.011;

/// Log densities at the corners of grid cells.
pub(super) struct Field {
    low: Point2<f64>,
    per_m: f64,
    width: usize,
    height: usize,
    logs: Vec<f32>,
    /// For each corner, true if observed; empty if not recorded.
    seen: Vec<bool>,
    /// Log density far from all plan points.
    nothing: f64,
}

impl Field {
    /// Computes the field around plan points with a standard deviation, metres; `None` without points.
    pub fn of(spots: &[Spot], sigma_m: f64) -> Option<Field> {
        let first = spots.first()?.at;
        let (low, high) = spots.iter().fold((first, first), |(l, h), s| (l.inf(&s.at), h.sup(&s.at)));
        let reach_m = REACH * sigma_m;
        let per_m = 2.0 / sigma_m;
        let low = low - Vector2::repeat(reach_m);
        let cells = |from: f64, to: f64| ((to - from + reach_m) * per_m).ceil() as usize + 2;
        let (width, height) = (cells(low.x, high.x), cells(low.y, high.y));
        let usual = spots.iter().map(|s| s.weight).sum::<f64>() / spots.len() as f64;
        let mut sums = vec![OUTLIERS as f32; width * height];
        for spot in spots {
            let middle = (spot.at - low) * per_m;
            let span = |c: f64, count: usize| {
                (c - REACH * 2.0).ceil().max(0.0) as usize..count.min((c + REACH * 2.0) as usize + 1)
            };
            for row in span(middle.y, height) {
                for column in span(middle.x, width) {
                    let off = (Vector2::new(column as f64, row as f64) - middle) / (per_m * sigma_m);
                    sums[row * width + column] +=
                        (spot.weight / usual * (-0.5 * off.norm_squared()).exp()) as f32;
                }
            }
        }
        sums.iter_mut().for_each(|s| *s = s.ln());
        Some(Field { low, per_m, width, height, logs: sums, seen: Vec::new(), nothing: OUTLIERS.ln() })
    }

    /// Bilinearly interpolated log density at a place.
    fn at(&self, place: &Point2<f64>) -> f64 {
        let (x, y) = ((place.x - self.low.x) * self.per_m, (place.y - self.low.y) * self.per_m);
        if !(x >= 0.0 && y >= 0.0 && x < (self.width - 1) as f64 && y < (self.height - 1) as f64) {
            return self.nothing;
        }
        let (column, row) = (x as usize, y as usize);
        let (u, v) = (x - column as f64, y - row as f64);
        let at = row * self.width + column;
        let [a, b, c, d] =
            [at, at + 1, at + self.width, at + self.width + 1].map(|i| f64::from(self.logs[i]));
        (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v
    }

    /// Weighted mean log density at plan points transformed by `pose`: how well they match the field.
    pub fn mean(&self, spots: &[Spot], pose: &Isometry2<f64>) -> f64 {
        let (sum, weight) = spots.iter().fold((0.0, 0.0), |(sum, weight), s| {
            (sum + s.weight * self.at(&(pose * s.at)), weight + s.weight)
        });
        sum / weight.max(f64::MIN_POSITIVE)
    }

    /// Records which part of the field was observed; [`Field::mean_of_seen`] ignores the rest.
    pub fn look(&mut self, is_seen: impl Fn(&Point2<f64>) -> bool) {
        self.seen = (0..self.logs.len())
            .map(|i| {
                let corner = Vector2::new((i % self.width) as f64, (i / self.width) as f64);
                is_seen(&(self.low + corner / self.per_m))
            })
            .collect();
    }

    /// Weighted mean log density at the transformed plan points in the observed part; `None` if these have at most half
    /// of the weight.
    pub fn mean_of_seen(&self, spots: &[Spot], pose: &Isometry2<f64>) -> Option<f64> {
        let (mut sum, mut weight, mut all) = (0.0, 0.0, 0.0);
        for spot in spots {
            all += spot.weight;
            let corner = ((pose * spot.at - self.low) * self.per_m).map(f64::round);
            let inside = corner.x >= 0.0
                && corner.y >= 0.0
                && corner.x < self.width as f64
                && corner.y < self.height as f64;
            if inside {
                let at = corner.y as usize * self.width + corner.x as usize;
                if self.seen[at] {
                    sum += spot.weight * f64::from(self.logs[at]);
                    weight += spot.weight;
                }
            }
        }
        (weight > 0.5 * all).then(|| sum / weight)
    }

    /// Share, by weight, of transformed plan points within two standard deviations of a point of the field.
    pub fn explained(&self, spots: &[Spot], pose: &Isometry2<f64>) -> f64 {
        let limit = (OUTLIERS + (-2.0_f64).exp()).ln();
        let (near, all) = spots.iter().fold((0.0, 0.0), |(near, all), s| {
            let is_near = self.at(&(pose * s.at)) >= limit;
            (near + if is_near { s.weight } else { 0.0 }, all + s.weight)
        });
        near / f64::max(all, f64::MIN_POSITIVE)
    }
}
