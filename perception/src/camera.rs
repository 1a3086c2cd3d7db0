//! Pinhole camera. Optical frame: x right, y down, z forward; pixel centres at whole coordinates.

use crate::cloud::{Cloud, Grid};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// Intrinsics of a pinhole camera without distortion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Intrinsics {
    /// Number of columns of the image.
    pub width: usize,
    /// Number of rows of the image.
    pub height: usize,
    /// Focal length along x, pixels.
    pub fx: f64,
    /// Focal length along y, pixels.
    pub fy: f64,
    /// Column of the principal point, pixels.
    pub cx: f64,
    /// Row of the principal point, pixels.
    pub cy: f64,
}

/// Reason why a camera or a depth image cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// The depth image has another size than the camera.
    #[error("the depth image has {found} pixels where a {width} x {height} camera has {}: check the intrinsics", width * height)]
    Size {
        /// Number of pixels of the depth image.
        found: usize,
        /// Number of columns of the camera.
        width: usize,
        /// Number of rows of the camera.
        height: usize,
    },
    /// A focal length is not positive.
    #[error("{name} is {value}: a focal length is a positive number of pixels")]
    Focal {
        /// Name of the focal length: `fx` or `fy`.
        name: &'static str,
        /// Given value.
        value: f64,
    },
}

impl Intrinsics {
    /// Projects a point of the optical frame, metres, to a pixel (column, row), possibly outside the image; `None`
    /// behind the camera.
    #[inline]
    pub fn project(&self, p: &Point3<f64>) -> Option<(f64, f64)> {
        (p.z > 0.0).then(|| (self.fx * p.x / p.z + self.cx, self.fy * p.y / p.z + self.cy))
    }

    /// Point of the optical frame, metres, at a pixel (column, row) and depth along z.
    pub fn unproject(&self, column: f64, row: f64, depth_m: f64) -> Point3<f64> {
        Point3::new((column - self.cx) / self.fx * depth_m, (row - self.cy) / self.fy * depth_m, depth_m)
    }

    /// Index, row by row, of the pixel nearest to (column, row); `None` outside the image.
    #[inline]
    pub fn pixel(&self, column: f64, row: f64) -> Option<usize> {
        let (u, v) = (column + 0.5, row + 0.5);
        // Signed, and of 32 bits: single instructions, where other numbers take several.
        let [width, height] = [self.width, self.height].map(|size| size as i64 as f64);
        let inside = u >= 0.0 && v >= 0.0 && u < width && v < height;
        inside.then(|| v as u32 as usize * self.width + u as u32 as usize)
    }

    /// Organised cloud in the optical frame from depths along z, metres, row by row. Depths that are not finite or not
    /// positive are missing returns (NaN).
    ///
    /// # Errors
    /// If the image has another size than the camera, or a focal length is not positive.
    pub fn cloud_from_depth(&self, depths_m: &[f32]) -> Result<Cloud, CameraError> {
        self.check()?;
        if self.width.checked_mul(self.height) != Some(depths_m.len()) {
            return Err(CameraError::Size { found: depths_m.len(), width: self.width, height: self.height });
        }
        let columns: Vec<f32> = (0..self.width).map(|u| ((u as f64 - self.cx) / self.fx) as f32).collect();
        let none = Point3::new(f32::NAN, f32::NAN, f32::NAN);
        let mut points = Vec::with_capacity(depths_m.len());
        for (v, row) in depths_m.chunks_exact(self.width.max(1)).enumerate() {
            let y = ((v as f64 - self.cy) / self.fy) as f32;
            points.extend(
                row.iter().zip(&columns).map(|(&z, &x)| {
                    if z.is_finite() && z > 0.0 { Point3::new(x * z, y * z, z) } else { none }
                }),
            );
        }
        let grid = Some(Grid { width: self.width, height: self.height });
        Ok(Cloud { points, grid, ..Cloud::default() })
    }

    fn check(&self) -> Result<(), CameraError> {
        for (name, value) in [("fx", self.fx), ("fy", self.fy)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(CameraError::Focal { name, value });
            }
        }
        Ok(())
    }
}
