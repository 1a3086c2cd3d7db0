//! Image of the simulated camera before noise.

use crate::body::Stamp;
use descry_perception::Intrinsics;
use image::RgbImage;

/// Image of an ideal camera, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Intrinsics of the camera.
    pub intrinsics: Intrinsics,
    /// Time stamp, nanoseconds.
    pub stamp_ns: Stamp,
    /// Depth along z, metres; infinite without a hit.
    pub depth_m: Vec<f32>,
    /// Cosine of the angle between each pixel's ray and the normal of the surface that it hits.
    pub cosine: Vec<f32>,
    /// Label of the surface that each pixel's ray hits, as in [`world`](crate::sim::world).
    pub label: Vec<u16>,
    /// Red, green, blue, shaded.
    pub colour: Vec<[u8; 3]>,
}

impl Frame {
    /// The colours as an image.
    pub fn image(&self) -> RgbImage {
        let width = self.intrinsics.width;
        RgbImage::from_fn(width as u32, self.intrinsics.height as u32, |u, v| {
            image::Rgb(self.colour[v as usize * width + u as usize])
        })
    }
}
