//! Picture of a segmented cloud with each object tinted and labelled: the camera image, or a view from above if the
//! cloud is unorganised.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use descry_perception::Cloud;
use descry_perception::recognise::Percept;
use descry_perception::surface::Surface;
use image::{ImageFormat, Rgb, RgbImage};

use crate::escaped;
use descry_agent::exit::CommandError;

/// Minimum size of a pixel in a view from above, metres.
const PIXEL_M: f64 = 0.002;
/// Maximum number of pixels along a side of a view from above.
const MOST_PIXELS: f64 = 1200.0;
/// Margin drawn around the surface, metres.
const BESIDE_M: f64 = 0.15;
/// Minimum probability at which a label mentions an object that the percept may be.
const LEAST_TOLD: f64 = 0.05;
/// Tints of the objects, used in turn.
const TINTS: [[u8; 3]; 6] =
    [[230, 85, 30], [40, 120, 220], [30, 160, 80], [190, 60, 180], [215, 160, 0], [0, 160, 175]];

/// Renders the picture as SVG: an image with labels over it.
///
/// # Errors
/// [`CommandError::Bug`] if the pixels cannot be encoded.
pub fn svg(cloud: &Cloud, surface: &Surface, percepts: &[Percept]) -> Result<String, CommandError> {
    let (width, height, places) = places(cloud, surface);
    let mut pixels = RgbImage::from_pixel(width, height, Rgb([24, 26, 30]));
    let shade = shade(cloud);
    for (n, at) in places.iter().enumerate() {
        if let Some((u, v)) = *at {
            pixels.put_pixel(u, v, Rgb(shade(n)));
        }
    }
    let mut names = String::new();
    for (n, percept) in percepts.iter().enumerate() {
        let tint = TINTS[n % TINTS.len()];
        let mine: Vec<(u32, u32)> = percept.indices.iter().filter_map(|&i| places[i as usize]).collect();
        for &(u, v) in &mine {
            let Rgb(under) = *pixels.get_pixel(u, v);
            let mixed = std::array::from_fn(|k| u8::midpoint(under[k], tint[k]));
            pixels.put_pixel(u, v, Rgb(mixed));
        }
        let count = mine.len().max(1) as f64;
        let x = mine.iter().map(|p| f64::from(p.0)).sum::<f64>() / count;
        let top = mine.iter().map(|p| p.1).min().unwrap_or(0);
        let name = named(percept);
        let [r, g, b] = tint;
        names += &format!(
            "<text x=\"{x:.0}\" y=\"{}\" fill=\"rgb({r},{g},{b})\">{}</text>\n",
            f64::from(top).max(16.0) - 4.0,
            escaped(&name),
        );
    }
    let mut packed = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut packed, ImageFormat::Png).map_err(|e| CommandError::Bug(e.to_string()))?;
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\">\n\
         <image width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{}\"/>\n\
         <g font-family=\"system-ui, sans-serif\" font-size=\"14\" font-weight=\"600\" text-anchor=\"middle\" \
         stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\">\n{names}</g>\n</svg>\n",
        STANDARD.encode(packed.into_inner()),
    ))
}

/// Label of a percept with its probability: the known object, else the kind with the objects that it may be, else
/// `unknown`.
fn named(percept: &Percept) -> String {
    let kind = percept.kinds.iter().max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, p)| *p > percept.unknown);
    match (&percept.label, kind) {
        (Some(label), _) => format!("{label} {:.2}", percept.probability_of(label)),
        (None, Some((kind, p))) => {
            let may_be: Vec<String> = percept
                .probabilities
                .iter()
                .filter(|(_, p)| *p >= LEAST_TOLD)
                .map(|(name, p)| format!("{name} {p:.2}"))
                .collect();
            format!("a {kind} {p:.2} ({})", may_be.join(", "))
        }
        (None, None) => format!("unknown {:.2}", percept.unknown),
    }
}

/// Width and height of the picture, pixels, and the pixel of each point: its own in an organised cloud, its projection
/// from above otherwise; `None` if the point is not in the picture.
fn places(cloud: &Cloud, surface: &Surface) -> (u32, u32, Vec<Option<(u32, u32)>>) {
    if let Some(grid) = cloud.grid {
        let at = |n: usize| {
            let is_measured = cloud.points[n].iter().all(|x| x.is_finite());
            is_measured.then(|| ((n % grid.width) as u32, (n / grid.width) as u32))
        };
        return (grid.width as u32, grid.height as u32, (0..cloud.points.len()).map(at).collect());
    }
    let corners: Vec<_> = surface.hull.iter().map(|p| surface.surface_from_world * p).collect();
    let least = |k: usize| corners.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min) - BESIDE_M;
    let most = |k: usize| corners.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + BESIDE_M;
    let [wide, deep] = [0, 1].map(|k| (most(k) - least(k)).max(PIXEL_M));
    let pixel_m = PIXEL_M.max(wide.max(deep) / MOST_PIXELS);
    let [width, height] = [wide, deep].map(|m| (m / pixel_m).ceil().max(1.0));
    let at = |p: &descry_perception::nalgebra::Point3<f32>| {
        let p = surface.surface_from_world * p.cast::<f64>();
        let (u, v) = ((p.x - least(0)) / pixel_m, (most(1) - p.y) / pixel_m);
        (u >= 0.0 && v >= 0.0 && u < width && v < height).then_some((u as u32, v as u32))
    };
    (width as u32, height as u32, cloud.points.iter().map(at).collect())
}

/// Colour of each point, by index; in a cloud without colours a grey, lighter for nearer points.
fn shade(cloud: &Cloud) -> impl Fn(usize) -> [u8; 3] + '_ {
    let far = cloud.points.iter().map(|p| p.coords.norm()).filter(|m| m.is_finite()).fold(1e-3, f32::max);
    move |n| match &cloud.colours {
        Some(colours) => colours[n],
        None => [(230.0 - 170.0 * cloud.points[n].coords.norm() / far) as u8; 3],
    }
}
