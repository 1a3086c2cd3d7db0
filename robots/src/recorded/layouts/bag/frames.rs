//! Decoding of the pixels of image messages.

use super::cdr::{Cdr, Image};
use crate::input::InputError;
use crate::recorded::picture::{self, RawDepth};
use image::RgbImage;

/// Length of the head of `compressedDepth` before its PNG, bytes: a format and two numbers.
const HEAD: usize = 12;

/// Content of an image message, with the unit of depths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    DepthMillimetres,
    DepthMetres,
    Colour,
}

/// Content of an image message with this encoding; `None` if it is neither depth nor colour.
pub(super) fn kind_of(encoding: &str) -> Option<Kind> {
    match encoding {
        "16UC1" | "mono16" => Some(Kind::DepthMillimetres),
        "32FC1" => Some(Kind::DepthMetres),
        _ => channels(encoding).map(|_| Kind::Colour),
    }
}

/// Content of a compressed image message with this format.
pub(super) fn kind_of_compressed(format: &str) -> Kind {
    match (format.contains("compressedDepth"), format.contains("32FC1")) {
        (true, true) => Kind::DepthMetres,
        (true, false) => Kind::DepthMillimetres,
        (false, _) => Kind::Colour,
    }
}

/// Bytes of a pixel, and the offsets of red, green and blue among them; `None` for an encoding without
/// colour.
fn channels(encoding: &str) -> Option<(usize, [usize; 3])> {
    match encoding {
        "rgb8" => Some((3, [0, 1, 2])),
        "bgr8" => Some((3, [2, 1, 0])),
        "rgba8" => Some((4, [0, 1, 2])),
        "bgra8" => Some((4, [2, 1, 0])),
        "mono8" => Some((1, [0, 0, 0])),
        _ => None,
    }
}

fn broken(place: &str, problem: impl Into<String>) -> InputError {
    InputError::whole(place, problem, "the message is damaged, or its driver writes it otherwise")
}

/// Decodes the depth image of a message, in the unit that its [`Kind`] names.
pub(super) fn depth(place: &str, data: &[u8], compressed: bool) -> Result<RawDepth, InputError> {
    let read = |fault: String| broken(place, fault);
    if !compressed {
        return raw_depth(place, &Cdr::new(data).and_then(Cdr::image).map_err(read)?);
    }
    let image = Cdr::new(data).and_then(Cdr::compressed).map_err(read)?;
    let Some((head, png)) = image.data.split_at_checked(HEAD) else {
        return Err(broken(place, "no image follows the head of compressedDepth"));
    };
    let mut depth = picture::depth_within(place, png)?;
    if kind_of_compressed(&image.format) == Kind::DepthMetres {
        // Stored is the inverse depth, as image_transport_plugins quantises it.
        let number = |at: usize| {
            head.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(f32::NAN, f32::from_le_bytes)
        };
        let (a, b) = (number(4), number(8));
        depth.units.iter_mut().for_each(|d| *d = a / (*d - b));
    }
    Ok(depth)
}

fn raw_depth(place: &str, image: &Image<'_>) -> Result<RawDepth, InputError> {
    let size = if image.encoding == "32FC1" { 4 } else { 2 };
    let unit = |pixel: &[u8]| match *pixel {
        [a, b] => {
            let d = if image.big_endian { u16::from_be_bytes([a, b]) } else { u16::from_le_bytes([a, b]) };
            if matches!(d, 0 | u16::MAX) { f32::NAN } else { f32::from(d) }
        }
        [a, b, c, d] if image.big_endian => f32::from_be_bytes([a, b, c, d]),
        [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
        _ => f32::NAN,
    };
    let positive = |d: f32| if d.is_finite() && d > 0.0 { d } else { f32::NAN };
    let units = rows(place, image, size)?.map(unit).map(positive).collect();
    Ok(RawDepth { width: image.width, height: image.height, units })
}

/// Pixels of an image, row by row, each as a slice of `size` bytes.
fn rows<'a>(
    place: &str,
    image: &Image<'a>,
    size: usize,
) -> Result<impl Iterator<Item = &'a [u8]>, InputError> {
    let (width, height, step, data) = (image.width, image.height, image.step, image.data);
    let row = width.saturating_mul(size);
    if row == 0 || height == 0 || row > step {
        let problem = format!("rows of {step} bytes for {width} pixels of {size} bytes");
        return Err(broken(place, problem));
    }
    Ok(data.chunks_exact(step).take(height).flat_map(move |line| line[..row].chunks_exact(size)))
}

/// Decodes the colour image of a message.
pub(super) fn colour(place: &str, data: &[u8], compressed: bool) -> Result<RgbImage, InputError> {
    let read = |fault: String| broken(place, fault);
    if compressed {
        return picture::colour_within(place, Cdr::new(data).and_then(Cdr::compressed).map_err(read)?.data);
    }
    let image = Cdr::new(data).and_then(Cdr::image).map_err(read)?;
    let (size, at) =
        channels(&image.encoding).ok_or_else(|| broken(place, format!("an encoding {}", image.encoding)))?;
    let pixels = rows(place, &image, size)?.flat_map(|pixel| at.map(|k| pixel[k])).collect();
    let built = RgbImage::from_raw(image.width as u32, image.height as u32, pixels);
    built.ok_or_else(|| broken(place, "fewer pixels than it states"))
}
