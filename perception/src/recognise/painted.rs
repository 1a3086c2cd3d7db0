//! Pixels of a body, and their likelihood given colours under changing light.
//!
//! Shading and the brightness of the light change lightness alone, mostly downwards. Coloured light
//! shifts saturation and hue, as a vector, equally everywhere, so that the hue of nearly grey
//! pixels says nothing.

use super::colour::{BASIC, CIRCLE_DEG, Colour, ColourRange};
use super::likelihood::{log_sum, within_density};
use super::model::Range;
use crate::scale::PLACE_M;
use crate::visibility::{DepthMap, Seen, Visibility};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

/// Mean and standard deviation of the logarithm of a surface's lightness over its lightness in
/// direct light: shading, dim light, exposure. From: chosen, of five pairs that were tried on
/// painted patches under simulated light.
const SHADE: (f64, f64) = (-0.25, 0.3);
/// Standard deviation of the saturation from coloured light. From: chosen, white cups of real
/// recordings lie 0.07 to 0.09 from grey.
const CAST: f64 = 0.05;
/// Standard deviation of the saturation from sensor noise at lightness 1; it grows as lightness
/// falls. From: chosen.
const DARK: f64 = 0.02;
/// Share of a body's pixels that show a highlight, a shadow's edge, a print or a neighbour. From: chosen.
const OTHERS: f64 = 0.1;
/// Probability density of the pixels of [`OTHERS`]: uniform over the logarithm of lightness, saturation and hue
/// (degrees). From: derived, the logarithm of lightness spans 3, and saturations on a screen reach
/// 0.7.
const OTHERS_DENSITY: f64 = 1.0 / (3.0 * 0.7 * CIRCLE_DEG);
/// Number of pixels from which a view has full weight: light and print are common to all pixels of
/// a view. From: chosen.
const WHOLE: f64 = 8.0;
/// Correlation of the errors of two views: both see the same body in the same room. From: chosen, ten views tell as much as three
/// independent ones.
const SHARED: f64 = 0.3;
/// Maximum number of a body's points whose pixels are used. From: work.
const POINTS: usize = 48;

/// Colour of a pixel in Oklab, polar form.
#[derive(Clone, Copy, Debug)]
struct Pixel {
    lightness: f64,
    saturation: f64,
    hue_deg: f64,
}

/// Straight part of the sRGB curve: upper end and slope. From: sensor, IEC 61966-2-1.
const STRAIGHT: (f64, f64) = (0.040_45, 12.92);
/// Curved part of the sRGB curve: offset and exponent. From: sensor, IEC 61966-2-1.
const BENT: (f64, f64) = (0.055, 2.4);
/// Matrix from linear sRGB to cone responses. From: paper, Ottosson (2020), "A perceptual color space for image processing".
const CONES_FROM_RGB: Matrix3<f64> = Matrix3::new(
    0.412_221_470_8,
    0.536_332_536_3,
    0.051_445_992_9,
    0.211_903_498_2,
    0.680_699_545_1,
    0.107_396_956_6,
    0.088_302_461_9,
    0.281_718_837_6,
    0.629_978_700_5,
);
/// Matrix from cube roots of cone responses to Oklab. From: paper, the same.
const LAB_FROM_CONES: Matrix3<f64> = Matrix3::new(
    0.210_454_255_3,
    0.793_617_785_0,
    -0.004_072_046_8,
    1.977_998_495_1,
    -2.428_592_205_0,
    0.450_593_709_9,
    0.025_904_037_1,
    0.782_771_766_2,
    -0.808_675_766_0,
);
/// Lower limit of lightness and saturation in logarithms and divisions, which keeps both finite.
/// From: chosen.
const DARKEST: f64 = 0.05;

impl Pixel {
    fn of(rgb: [u8; 3]) -> Pixel {
        let linear = |c: u8| match f64::from(c) / f64::from(u8::MAX) {
            c if c <= STRAIGHT.0 => c / STRAIGHT.1,
            c => ((c + BENT.0) / (1.0 + BENT.0)).powf(BENT.1),
        };
        let cones = CONES_FROM_RGB * Vector3::from(rgb.map(linear));
        let lab = LAB_FROM_CONES * cones.map(f64::cbrt);
        let hue_deg = lab.z.atan2(lab.y).to_degrees().rem_euclid(CIRCLE_DEG);
        Pixel { lightness: lab.x, saturation: lab.y.hypot(lab.z) / lab.x.max(DARKEST), hue_deg }
    }

    /// Density of the pixel under a range of colours, blurred by the light and the sensor.
    fn density(&self, range: &ColourRange) -> f64 {
        /// Maximum standard deviation of a hue, degrees: the hue of a grey is open. From: derived,
        /// a third of it.
        const OPEN_DEG: f64 = CIRCLE_DEG / 3.0;
        let shaded = |lightness: f64| lightness.max(DARKEST).ln();
        let Range { low, high } = range.lightness;
        let lit = Range { low: shaded(low) + SHADE.0, high: shaded(high) + SHADE.0 };
        let cast = CAST.hypot(DARK / self.lightness.max(DARKEST));
        let turn_deg = (cast / self.saturation.max(DARKEST)).to_degrees().min(OPEN_DEG);
        // A saturation has no sign, and a hue no beginning.
        let grey = |s: f64| within_density(s, cast, range.saturation);
        let hue = |turns: f64| within_density(self.hue_deg + turns * CIRCLE_DEG, turn_deg, range.hue_deg);
        within_density(shaded(self.lightness), SHADE.1, lit)
            * (grey(self.saturation) + grey(-self.saturation))
            * (hue(-1.0) + hue(0.0) + hue(1.0))
    }
}

/// Colours of a body's pixels, by view.
#[derive(Clone, Debug, Default)]
pub(super) struct Painted {
    views: Vec<Vec<Pixel>>,
    /// Log likelihood of all pixels under each basic colour, then under all of them side by side;
    /// empty if no pixel was seen.
    logs: Vec<f64>,
}

impl Painted {
    /// The pixels at some points of a body, surface frame, in each view that shows them.
    pub(super) fn of(
        points: &[Point3<f64>],
        world_from_surface: &Isometry3<f64>,
        seen: &Visibility,
    ) -> Painted {
        let stride = points.len().div_ceil(POINTS).max(1);
        let points: Vec<_> = points.iter().step_by(stride).map(|p| world_from_surface * p).collect();
        let of_view = |map: &DepthMap| -> Option<Vec<Pixel>> {
            let colours = map.colours.as_ref()?;
            let shown = points.iter().filter(|p| map.look(p, PLACE_M) == Seen::Surface);
            let pixel = |p: &Point3<f64>| {
                let (u, v) = map.intrinsics.project(&(map.camera_from_world * p))?;
                Some(Pixel::of(*colours.get(map.intrinsics.pixel(u, v)?)?))
            };
            Some(shown.filter_map(pixel).collect())
        };
        let views = seen.maps.iter().filter_map(of_view).filter(|pixels| !pixels.is_empty()).collect();
        let mut painted = Painted { views, logs: Vec::new() };
        if !painted.views.is_empty() {
            let all = BASIC.map(|(name, ..)| Colour::Name(name));
            let each = all.iter().map(|one| painted.log(std::slice::from_ref(one)));
            painted.logs = each.chain([painted.log(&all)]).collect();
        }
        painted
    }

    /// Log likelihood of all pixels of a body that has exactly these colours; a view counts for one
    /// pixel at most.
    fn log(&self, colours: &[Colour]) -> f64 {
        let ranges: Vec<ColourRange> = colours.iter().map(Colour::range).collect();
        let of = |pixel: &Pixel| {
            let own = ranges.iter().map(|range| pixel.density(range)).sum::<f64>() / ranges.len() as f64;
            ((1.0 - OTHERS) * own + OTHERS * OTHERS_DENSITY).ln()
        };
        let voices = || self.views.iter().map(|pixels| (pixels.len() as f64 / WHOLE).min(1.0));
        let views = self.views.iter().zip(voices());
        let sum: f64 =
            views.map(|(px, voice)| voice * px.iter().map(of).sum::<f64>() / px.len() as f64).sum();
        sum / (1.0 + SHARED * (voices().sum::<f64>() - 1.0).max(0.0))
    }

    /// Log likelihoods of the pixels of a body with the stated colours, and of one with other
    /// colours, relative to a body of unknown colour; both are 0 if no colour is stated or no pixel
    /// was seen.
    pub(super) fn weigh(&self, stated: &[Colour]) -> [f64; 2] {
        if self.logs.is_empty() || stated.is_empty() {
            return [0.0; 2];
        }
        let is_other =
            |n: &usize| BASIC.get(*n).is_none_or(|(name, ..)| !stated.contains(&Colour::Name(name)));
        let others: Vec<f64> = (0..self.logs.len()).filter(is_other).map(|n| self.logs[n]).collect();
        let mean = |logs: &[f64]| log_sum(logs) - (logs.len() as f64).ln();
        [self.log(stated), mean(&others)].map(|log| log - mean(&self.logs))
    }

    /// Probability of each basic colour; the rest to one is that of several colours. Empty if no
    /// pixel was seen.
    pub(super) fn names(&self) -> Vec<(String, f64)> {
        let total = log_sum(&self.logs);
        BASIC.iter().zip(&self.logs).map(|((name, ..), log)| ((*name).into(), (log - total).exp())).collect()
    }
}
