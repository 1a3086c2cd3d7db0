//! Depth images of 16 bits: PNG and PGM.

use super::error::{FileError, Place};

/// Depth image: depths along the optical axis, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthImage {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Depths, metres; NaN where nothing was measured.
    pub depths_m: Vec<f32>,
}

/// Reads a 16-bit depth image (PNG or PGM); `metres_per_unit`: 0.001 for millimetres. Values 0 and 65535 mean that
/// nothing was measured.
///
/// # Errors
/// If the file is no PNG or PGM image, or has no single grey channel of 16 bits.
pub fn read(bytes: &[u8], metres_per_unit: f64) -> Result<DepthImage, FileError> {
    let start = Place::Byte(0);
    let decoded = image::load_from_memory(bytes).map_err(|e| {
        FileError::new(
            start,
            "a PNG or PGM image",
            e.to_string(),
            "give a grey image of 16 bits (millimetres)",
        )
    })?;
    let image::DynamicImage::ImageLuma16(grey) = decoded else {
        let found = format!("pixels of kind {:?}", decoded.color());
        return Err(FileError::new(
            start,
            "one grey channel of 16 bits",
            found,
            "a colour image is no depth image",
        ));
    };
    let to_metres = |&raw: &u16| match raw {
        0 | u16::MAX => f32::NAN,
        raw => (f64::from(raw) * metres_per_unit) as f32,
    };
    let (width, height) = (grey.width() as usize, grey.height() as usize);
    Ok(DepthImage { width, height, depths_m: grey.as_raw().iter().map(to_metres).collect() })
}
