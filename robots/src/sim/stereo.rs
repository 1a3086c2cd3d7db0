//! Noise of a stereo camera on an ideal frame: disparity errors, and no depth on bare surfaces.
//!
//! Every pixel draws from its own hash of (seed, frame, pixel), so the result does not depend on threads.
//! Bare spots of a surface are fixed by position, so they are bare from every viewpoint.

use crate::sim::frame::Frame;
use crate::sim::noise::{mix, normal, share};
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A stereo camera with the depth noise σ_z = z²·σ_d/(f·b).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stereo {
    /// Baseline (b), metres.
    pub baseline_m: f64,
    /// Standard deviation of the disparity (σ_d), pixels.
    pub disparity_sigma_px: f64,
    /// Share of the spots on floor and walls with enough texture for matching.
    pub textured: f64,
    /// Minimum and maximum depth, metres.
    #[serde(default = "default_range_m")]
    pub range_m: (f64, f64),
}

fn default_range_m() -> (f64, f64) {
    (0.45, 6.0)
}

/// Side of a textured or bare spot, metres.
const SPOT_M: f64 = 0.15;
/// Minimum cosine of the incidence angle at which a surface is matched: that of 85 degrees.
const STEEPEST: f32 = 0.087;

impl Stereo {
    /// Simulates depths along z, metres, NaN without a match. `is_bare` is true for the labels of surfaces
    /// that have spots without texture.
    pub fn observe(
        &self,
        frame: &Frame,
        map_from_camera: &Isometry3<f64>,
        is_bare: impl Fn(u16) -> bool + Sync,
        seed: u64,
        frame_number: u64,
    ) -> Vec<f32> {
        let camera = &frame.intrinsics;
        let key = mix(mix(seed) ^ frame_number);
        let measured = |here: usize| {
            let z = f64::from(frame.depth_m[here]);
            if !z.is_finite() || frame.cosine[here] < STEEPEST {
                return f32::NAN;
            }
            let (u, v) = ((here % camera.width) as f64, (here / camera.width) as f64);
            let at = map_from_camera
                * Point3::new((u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z);
            if is_bare(frame.label[here]) && spot(&at) >= self.textured {
                return f32::NAN;
            }
            let off_px = self.disparity_sigma_px * f64::from(normal(mix(key ^ here as u64)));
            let disparity_px = camera.fx * self.baseline_m / z + off_px;
            let z = camera.fx * self.baseline_m / disparity_px;
            if z >= self.range_m.0 && z <= self.range_m.1 { z as f32 } else { f32::NAN }
        };
        (0..frame.depth_m.len()).into_par_iter().map(measured).collect()
    }
}

/// A number in [0, 1) for the surface spot around a point. An offset keeps the coordinates of walls away from
/// spot borders, against rounding.
fn spot(at: &Point3<f64>) -> f64 {
    let whole = at.map(|c| ((c + 0.013) / SPOT_M).floor() as i64 as u64);
    share(mix(mix(mix(whole.x) ^ whole.y) ^ whole.z))
}
