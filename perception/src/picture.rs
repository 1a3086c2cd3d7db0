//! Pictures of clouds: PNG images shaded by depth, with one colour per label.

use crate::cloud::{Cloud, is_finite};
use image::{ImageEncoder, Rgb, RgbImage};
use nalgebra::{Isometry3, Point3, Vector3};
use std::io::Cursor;

/// Viewpoint and size of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureOptions {
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Position of the camera, metres.
    pub eye: Point3<f64>,
    /// Point that the camera looks at, metres.
    pub target: Point3<f64>,
    /// Up direction in the picture.
    pub up: Vector3<f64>,
    /// Vertical opening angle of the camera, radians.
    pub opening_rad: f64,
    /// Side of the square drawn for a point, metres.
    pub point_m: f64,
}

impl Default for PictureOptions {
    fn default() -> Self {
        PictureOptions {
            width: 960,
            height: 640,
            eye: Point3::new(1.2, -1.2, 1.8),
            target: Point3::new(0.0, 0.0, 0.75),
            up: Vector3::z(),
            opening_rad: 0.7,
            point_m: 0.004,
        }
    }
}

/// Reason why a picture cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PictureError {
    /// The camera is at the target or looks along `up`, or the size or the opening angle is zero.
    #[error(
        "eye {eye:?} and target {target:?} give no view of {width} x {height} pixels: move the eye, or give a size"
    )]
    View {
        /// Position of the camera, metres.
        eye: [f64; 3],
        /// Point that the camera looks at, metres.
        target: [f64; 3],
        /// Number of columns.
        width: u32,
        /// Number of rows.
        height: u32,
    },
    /// There is not one label per point.
    #[error("{labels} labels for {points} points: give one a point")]
    Labels {
        /// Number of labels.
        labels: usize,
        /// Number of points.
        points: usize,
    },
    /// Encoding as PNG failed, for the given reason.
    #[error("the picture could not be encoded: {0}")]
    Encode(String),
}

/// Colour-blind-safe palette (after Okabe and Ito); label 0 is grey.
const COLOURS: [[f32; 3]; 9] = [
    [150.0, 150.0, 150.0],
    [230.0, 120.0, 0.0],
    [60.0, 150.0, 230.0],
    [0.0, 158.0, 115.0],
    [240.0, 215.0, 50.0],
    [0.0, 90.0, 190.0],
    [213.0, 60.0, 0.0],
    [204.0, 90.0, 160.0],
    [120.0, 200.0, 60.0],
];

/// Renders a cloud as PNG. `labels` select colours (0 is grey); nearer points are lighter, and points whose normals
/// face the camera too.
///
/// # Errors
/// If the options give no view, or labels and points differ in number.
pub fn png(cloud: &Cloud, labels: &[u32], options: &PictureOptions) -> Result<Vec<u8>, PictureError> {
    if labels.len() != cloud.len() {
        return Err(PictureError::Labels { labels: labels.len(), points: cloud.len() });
    }
    let view = Isometry3::look_at_rh(&options.eye, &options.target, &options.up);
    let sound = view.to_homogeneous().iter().all(|x| x.is_finite());
    let aside = (options.target - options.eye).cross(&options.up).norm() > 1e-9;
    if !sound || !aside || options.width == 0 || options.height == 0 || options.opening_rad <= 0.0 {
        return Err(PictureError::View {
            eye: options.eye.coords.into(),
            target: options.target.coords.into(),
            width: options.width,
            height: options.height,
        });
    }
    let mut canvas = Canvas::new(options);
    for (i, p) in cloud.points.iter().enumerate().filter(|(_, p)| is_finite(p)) {
        let q = view * p.cast::<f64>();
        let shade = cloud.normals.as_ref().map_or(1.0, |n| {
            let facing = (view.rotation * n[i].cast::<f64>()).z;
            if facing.is_finite() { 0.45 + 0.55 * facing.abs() } else { 0.8 }
        });
        canvas.put(&q, labels[i], shade as f32);
    }
    canvas.encode()
}

struct Canvas {
    image: RgbImage,
    depths: Vec<f32>,
    focal: f64,
    point_m: f64,
    middle_m: f64,
}

impl Canvas {
    fn new(o: &PictureOptions) -> Canvas {
        Canvas {
            image: RgbImage::from_pixel(o.width, o.height, Rgb([18, 20, 26])),
            depths: vec![f32::INFINITY; o.width as usize * o.height as usize],
            focal: 0.5 * f64::from(o.height) / (0.5 * o.opening_rad).tan(),
            point_m: o.point_m,
            middle_m: (o.target - o.eye).norm(),
        }
    }

    /// Draws a point as a square; `q`: the point in a camera frame that looks along −z, metres.
    fn put(&mut self, q: &Point3<f64>, label: u32, shade: f32) {
        let depth = -q.z;
        if depth < 0.05 {
            return;
        }
        let (width, height) = self.image.dimensions();
        let (u, v) = (
            0.5 * f64::from(width) + self.focal * q.x / depth,
            0.5 * f64::from(height) - self.focal * q.y / depth,
        );
        let half = (0.5 * self.focal * self.point_m / depth).clamp(0.5, 20.0);
        let span = |at: f64, end: u32| {
            let low = (at - half).round().clamp(0.0, f64::from(end)) as u32;
            let high = (at + half).round().clamp(0.0, f64::from(end)) as u32;
            low..high.max((low + 1).min(end))
        };
        let near = (1.0 - 0.5 * (depth - self.middle_m) / self.middle_m).clamp(0.35, 1.25) as f32;
        let index = if label == 0 { 0 } else { 1 + (label as usize - 1) % (COLOURS.len() - 1) };
        let colour = COLOURS[index].map(|c| (c * near * shade).clamp(0.0, 255.0) as u8);
        if !(0.0..f64::from(width)).contains(&u) || !(0.0..f64::from(height)).contains(&v) {
            return;
        }
        for row in span(v, height) {
            for column in span(u, width) {
                let at = row as usize * width as usize + column as usize;
                if (depth as f32) < self.depths[at] {
                    self.depths[at] = depth as f32;
                    self.image.put_pixel(column, row, Rgb(colour));
                }
            }
        }
    }

    fn encode(self) -> Result<Vec<u8>, PictureError> {
        let mut bytes = Cursor::new(Vec::new());
        let (width, height) = self.image.dimensions();
        image::codecs::png::PngEncoder::new(&mut bytes)
            .write_image(self.image.as_raw(), width, height, image::ExtendedColorType::Rgb8)
            .map_err(|e| PictureError::Encode(e.to_string()))?;
        Ok(bytes.into_inner())
    }
}
