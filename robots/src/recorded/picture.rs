//! Depth and colour images on disk.

use crate::input::{self, InputError};
use image::{ColorType, DynamicImage, ImageDecoder, ImageReader, RgbImage};
use std::io::Cursor;
use std::path::Path;

/// Maximum size of an image file, bytes. From: chosen.
const MOST_IMAGE_BYTES: u64 = 256 << 20;

/// A depth image in the units of its file, row by row; NaN without a return.
#[derive(Clone, Debug, PartialEq)]
pub struct RawDepth {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Depth of each pixel along the optical axis.
    pub units: Vec<f32>,
}

impl RawDepth {
    /// Converts a depth image of 16 bits, whose least and greatest values mean "no return".
    pub(crate) fn of_16_bits(width: usize, height: usize, pixels: &[u16]) -> RawDepth {
        let unit = |&d: &u16| if matches!(d, 0 | u16::MAX) { f32::NAN } else { f32::from(d) };
        RawDepth { width, height, units: pixels.iter().map(unit).collect() }
    }
}

/// Reads a depth image of 16 bits.
pub(crate) fn depth(path: &Path) -> Result<RawDepth, InputError> {
    of_depth(&shown(path), decode(path)?)
}

/// Decodes a depth image of 16 bits from bytes; `place` names their origin in messages.
pub(crate) fn depth_within(place: &str, bytes: &[u8]) -> Result<RawDepth, InputError> {
    of_depth(place, within(place, bytes)?)
}

fn of_depth(place: &str, image: DynamicImage) -> Result<RawDepth, InputError> {
    let DynamicImage::ImageLuma16(image) = image else { return Err(no_depth(place, image.color())) };
    Ok(RawDepth::of_16_bits(image.width() as usize, image.height() as usize, image.as_raw()))
}

/// Reads a colour image.
pub(crate) fn colour(path: &Path) -> Result<RgbImage, InputError> {
    Ok(decode(path)?.into_rgb8())
}

/// Decodes a colour image from bytes; `place` names their origin in messages.
pub(crate) fn colour_within(place: &str, bytes: &[u8]) -> Result<RgbImage, InputError> {
    Ok(within(place, bytes)?.into_rgb8())
}

/// Columns and rows of a depth image, from its header alone.
pub(crate) fn size_of(path: &Path) -> Result<(usize, usize), InputError> {
    let head = open(path)?.into_decoder().map_err(|e| no_image(&shown(path), &e))?;
    if head.color_type() != ColorType::L16 {
        return Err(no_depth(&shown(path), head.color_type()));
    }
    let (columns, rows) = head.dimensions();
    Ok((columns as usize, rows as usize))
}

fn decode(path: &Path) -> Result<DynamicImage, InputError> {
    open(path)?.decode().map_err(|e| no_image(&shown(path), &e))
}

fn within(place: &str, bytes: &[u8]) -> Result<DynamicImage, InputError> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let reader = reader.map_err(|e| InputError::whole(place, format!("cannot be read: {e}"), EXPECTED))?;
    reader.decode().map_err(|e| no_image(place, &e))
}

const EXPECTED: &str = "an image is expected";

fn open(path: &Path) -> Result<ImageReader<Cursor<Vec<u8>>>, InputError> {
    let bytes = input::read_bytes(path, MOST_IMAGE_BYTES).map(Cursor::new);
    let reader = bytes.map(ImageReader::new).and_then(ImageReader::with_guessed_format);
    reader.map_err(|e| InputError::whole(shown(path), format!("cannot be read: {e}"), EXPECTED))
}

fn no_image(place: &str, e: &image::ImageError) -> InputError {
    InputError::whole(place, format!("is no image: {e}"), "store it again as PNG, JPEG or PGM")
}

fn no_depth(place: &str, found: ColorType) -> InputError {
    let problem = format!("{found:?} pixels, expected one channel of 16 bits");
    InputError::whole(place, problem, "store depth as 16-bit grey")
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}
