//! How a structured-light depth camera errs (Nguyen, Izadi, Lovell: Modeling Kinect Sensor Noise, 2012).

/// Steepest angle between ray and normal that still returns, degrees. From: chosen.
pub const STEEPEST_DEG: f64 = 85.0;

/// Standard deviation along the ray at the nearest depth, metres, and what it grows by with the square of the depth beyond it. From: sensor,
/// Nguyen et al. 2012, eq. 2.
pub(crate) const LEAST_AXIAL_M: f64 = 0.0012;
const AXIAL_GROWTH_PER_M: f64 = 0.0019;
const NEAREST_M: f64 = 0.4;
/// What is added as a surface steepens, metres at a depth of one. From: sensor, Nguyen et al. 2012, the term for
/// steep angles.
const STEEP_M: f64 = 0.0001;
/// Standard deviation across the ray of a surface that faces the camera, pixels, and what is added as it steepens. From: sensor,
/// Nguyen et al. 2012, eq. 1.
const LATERAL_PX: f64 = 0.8;
const STEEP_PX: f64 = 0.034;
/// A quarter turn, degrees. From: derived, a surface seen edge on.
const EDGE_ON_DEG: f64 = 90.0;

/// Standard deviation along the ray, metres, of a return at depth `z_m` from a surface whose normal makes `angle_rad` with the ray (eq. 2 and the
/// steep-angle term); `None` beyond the steepest angle, where there is no return.
pub fn axial_sigma_m(z_m: f64, angle_rad: f64) -> Option<f64> {
    let degrees = angle_rad.abs().to_degrees();
    (degrees <= STEEPEST_DEG && z_m > 0.0).then(|| {
        let steep = STEEP_M * degrees * degrees / (z_m.sqrt() * (EDGE_ON_DEG - degrees).powi(2));
        LEAST_AXIAL_M + AXIAL_GROWTH_PER_M * (z_m - NEAREST_M).powi(2) + steep
    })
}

/// The same of a surface that faces the camera, without a branch.
#[inline(always)]
pub(crate) fn frontal_sigma_m(z_m: f32) -> f32 {
    let beyond_m = z_m - NEAREST_M as f32;
    LEAST_AXIAL_M as f32 + AXIAL_GROWTH_PER_M as f32 * (beyond_m * beyond_m)
}

/// Standard deviation across the ray, metres, at depth `z_m` for focal length `focal_px` (eq. 1: pixels times depth over focal length).
pub fn lateral_sigma_m(z_m: f64, angle_rad: f64, focal_px: f64) -> Option<f64> {
    let degrees = angle_rad.abs().to_degrees();
    (degrees <= STEEPEST_DEG && z_m > 0.0)
        .then(|| (LATERAL_PX + STEEP_PX * degrees / (EDGE_ON_DEG - degrees)) * z_m / focal_px)
}

/// Standard normal distribution function.
pub fn normal_cdf(x: f64) -> f64 {
    libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grows_with_depth_and_angle_and_ends() {
        let axial = |z, degrees: f64| axial_sigma_m(z, degrees.to_radians());
        assert!((axial(0.4, 0.0).unwrap() - 0.0012).abs() < 1e-12);
        assert!(axial(2.0, 0.0) > axial(1.0, 0.0) && axial(1.0, 80.0) > axial(1.0, 20.0));
        assert_eq!((axial(1.0, 86.0), lateral_sigma_m(1.0, 1.5, 525.0)), (None, None));
        assert!((f64::from(frontal_sigma_m(1.7)) - axial(1.7, 0.0).unwrap()).abs() < 1e-8);
        assert!((lateral_sigma_m(1.0, 0.0, 525.0).unwrap() - 0.8 / 525.0).abs() < 1e-12);
    }
}
