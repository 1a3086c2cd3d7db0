//! Noise model of a depth camera, as stated and as fitted to recordings.

mod fit;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

pub(crate) use fit::CELL_PX;
pub use fit::Residuals;

/// Maximum angle between ray and normal at which a surface gives a return, degrees. From: chosen.
pub const STEEPEST_DEG: f64 = 85.0;

/// Coefficient of the additional noise along the ray on steep surfaces, metres at unit depth. From: sensor, Nguyen et
/// al. 2012, the term for steep angles.
const STEEP_M: f64 = 0.0001;
/// Coefficient of the additional noise across the ray on steep surfaces, pixels. From: sensor, Nguyen et al. 2012, eq.
/// 1.
const STEEP_PX: f64 = 0.034;
/// A quarter turn, degrees. From: derived, a surface seen edge on.
const EDGE_ON_DEG: f64 = 90.0;

/// Range and noise of a depth camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Standard deviation along the ray of a return from a surface that faces the camera, at the nearest depth, metres.
    pub axial_m: f64,
    /// Growth of the noise along the ray with the square of the depth beyond the nearest, metres per square metre.
    pub growth_per_m: f64,
    /// Minimum and maximum depth that is measured, metres.
    pub range_m: (f64, f64),
    /// Standard deviation across the ray, pixels.
    pub lateral_px: f64,
    /// Maximum angle between ray and normal at which a surface gives a return, degrees.
    pub steepest_deg: f64,
    /// Share of stray returns, which are unrelated to the surface on their ray.
    pub stray: f64,
    /// Number of independent measurements that a block of 8 by 8 pixels counts for, as neighbouring
    /// errors are correlated.
    pub looks: f64,
}

/// Structured-light camera (Nguyen, Izadi, Lovell: Modeling Kinect Sensor Noise, 2012, eq. 1 and 2). The `looks` are
/// those of a table in eleven frames of such a camera; the share of strays is set by hand. From: sensor, as said.
pub const KINECT: Sensor = Sensor {
    axial_m: 0.0012,
    growth_per_m: 0.0019,
    range_m: (0.4, 6.0),
    lateral_px: 0.8,
    steepest_deg: STEEPEST_DEG,
    stray: 0.01,
    looks: 2.3,
};

impl Sensor {
    /// Standard deviation along the ray, metres, of a return at depth `z_m` from a surface that faces the camera.
    #[inline(always)]
    pub fn frontal_sigma_m(&self, z_m: f64) -> f64 {
        let beyond_m = z_m - self.range_m.0;
        self.axial_m + self.growth_per_m * (beyond_m * beyond_m)
    }

    /// Standard deviation along the ray, metres, at depth `z_m` on a surface whose normal makes `angle_rad` with the
    /// ray (eq. 2 and the steep-angle term); `None` beyond the steepest angle, where there is no return.
    pub fn axial_sigma_m(&self, z_m: f64, angle_rad: f64) -> Option<f64> {
        let degrees = angle_rad.abs().to_degrees();
        (degrees <= self.steepest_deg && z_m > 0.0).then(|| {
            let steep = STEEP_M * degrees * degrees / (z_m.sqrt() * (EDGE_ON_DEG - degrees).powi(2));
            self.frontal_sigma_m(z_m) + steep
        })
    }

    /// Standard deviation across the ray, metres, at depth `z_m` for focal length `focal_px` (eq. 1: pixels times depth
    /// over focal length); `None` beyond the steepest angle.
    pub fn lateral_sigma_m(&self, z_m: f64, angle_rad: f64, focal_px: f64) -> Option<f64> {
        let degrees = angle_rad.abs().to_degrees();
        (degrees <= self.steepest_deg && z_m > 0.0)
            .then(|| (self.lateral_px + STEEP_PX * degrees / (EDGE_ON_DEG - degrees)) * z_m / focal_px)
    }
}

/// Noise along the ray of the [`KINECT`], as of [`Sensor::axial_sigma_m`], for callers without a camera model.
pub fn axial_sigma_m(z_m: f64, angle_rad: f64) -> Option<f64> {
    KINECT.axial_sigma_m(z_m, angle_rad)
}

/// Noise across the ray of the [`KINECT`], as of [`Sensor::lateral_sigma_m`].
pub fn lateral_sigma_m(z_m: f64, angle_rad: f64, focal_px: f64) -> Option<f64> {
    KINECT.lateral_sigma_m(z_m, angle_rad, focal_px)
}

/// Noise along the ray of the [`KINECT`] on surfaces that face it, as of [`Sensor::frontal_sigma_m`].
#[inline(always)]
pub fn frontal_sigma_m(z_m: f32) -> f32 {
    let beyond_m = z_m - KINECT.range_m.0 as f32;
    KINECT.axial_m as f32 + KINECT.growth_per_m as f32 * (beyond_m * beyond_m)
}

/// Standard normal distribution function.
pub fn normal_cdf(x: f64) -> f64 {
    libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2) / 2.0
}

/// Standard deviation, metres, of the range of a depth camera (Nguyen et al.) at a distance, metres.
pub(crate) fn range_sigma_m(distance_m: f64) -> f64 {
    if distance_m > 0.0 { KINECT.frontal_sigma_m(distance_m) } else { KINECT.axial_m }
}

/// Standard deviation, metres, of the measurement of a point from the nearest viewpoint; at 1 m without viewpoints.
pub(crate) fn nearest_sigma_m(p: &Point3<f64>, viewpoints: &[Point3<f64>]) -> f64 {
    range_sigma_m(viewpoints.iter().map(|v| (p - v).norm()).min_by(f64::total_cmp).unwrap_or(1.0))
}
