//! Light and colour errors of a camera on an ideal frame: brightness, cast, highlights, noise.
//!
//! Every pixel draws from its own hash of (seed, frame, pixel), so the result does not depend on threads.

use crate::sim::frame::Frame;
use crate::sim::noise::{mix, normal, share};
use serde::{Deserialize, Serialize};

/// Light of a scene, drawn by the seed. Without one, colours are as stated, but shaded.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Least and greatest brightness; 1 shows colours as stated where light falls straight.
    #[serde(default = "default_gain")]
    pub gain: (f64, f64),
    /// Standard deviation of the logarithm of the gains of red and of blue beside green: lamps, and a white balance that errs.
    #[serde(default)]
    pub cast: f64,
    /// Greatest share of white in a highlight, where a surface faces the camera.
    #[serde(default)]
    pub gloss: f64,
    /// Standard deviation of each channel of each pixel, of 255.
    #[serde(default)]
    pub noise: f64,
}

fn default_gain() -> (f64, f64) {
    (1.0, 1.0)
}

/// Exponent of the cosine between ray and surface in a highlight: its width.
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

/// Linear light of a channel of sRGB, 0 to 1 (IEC 61966-2-1).
fn linear(c: f64) -> f64 {
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Channel of sRGB of linear light, 0 to 1.
fn curved(c: f64) -> f64 {
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}
