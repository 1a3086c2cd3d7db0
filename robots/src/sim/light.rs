//! Light and colour errors of a camera on an ideal frame: brightness, cast, highlights, noise.
//!
//! Every pixel draws from its own hash of (seed, frame, pixel), so the result does not depend on threads.

use crate::sim::frame::Frame;
use crate::sim::noise::{mix, normal, share};
use serde::{Deserialize, Serialize};

/// Light of a scene, drawn by the seed. Without it, surfaces have the stated colours, shaded.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Minimum and maximum brightness; 1 shows the stated colours where light falls straight on a surface.
    #[serde(default = "default_gain")]
    pub gain: (f64, f64),
    /// Standard deviation of the logarithm of the gains of red and of blue relative to green: colour of
    /// lamps, errors of the white balance.
    #[serde(default)]
    pub cast: f64,
    /// Maximum share of white in a highlight, 0 to 1, reached where a surface faces the camera.
    #[serde(default)]
    pub gloss: f64,
    /// Standard deviation of the noise of each channel of each pixel, of 255.
    #[serde(default)]
    pub noise: f64,
}

fn default_gain() -> (f64, f64) {
    (1.0, 1.0)
}

/// Exponent of the cosine between ray and surface normal in a highlight, which sets its width.
const SHININESS: i32 = 40;

impl Light {
    /// Lights a frame of ideal colours.
    pub fn fall_on(&self, frame: &mut Frame, seed: u64, frame_number: u64) {
        let drawn = |n: u64| mix(mix(seed ^ 0x0116_4700) ^ n);
        let gain = self.gain.0 + share(drawn(0)) * (self.gain.1 - self.gain.0);
        let cast = |n: u64| gain * (self.cast * f64::from(normal(drawn(n)))).exp();
        let gains = [cast(1), gain, cast(2)];
        let key = mix(mix(seed ^ 0x0c01) ^ frame_number);
        for (here, (colour, cosine)) in frame.colour.iter_mut().zip(&frame.cosine).enumerate() {
            let white = self.gloss * f64::from(*cosine).powi(SHININESS);
            for (k, c) in colour.iter_mut().enumerate() {
                let linear = linear(f64::from(*c) / 255.0);
                let lit = curved(gains[k] * (linear + white * (1.0 - linear)));
                let off = self.noise * f64::from(normal(mix(key ^ (3 * here + k) as u64)));
                *c = (255.0 * lit + off).round().clamp(0.0, 255.0) as u8;
            }
        }
    }
}

/// Converts a channel of sRGB to linear light, both 0 to 1 (IEC 61966-2-1).
fn linear(c: f64) -> f64 {
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Converts linear light to a channel of sRGB, both 0 to 1.
fn curved(c: f64) -> f64 {
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}
