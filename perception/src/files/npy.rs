//! NPY files of NumPy: one numeric array with a row per point, or an image with a point per pixel.

use super::columns::Columns;
use super::error::{FileError, Place};
use super::loaded::{Loaded, finish};
use crate::cloud::Grid;
use nalgebra::Isometry3;

pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// Number type: width in bytes, byte order, and decoder from little-endian bytes.
struct Kind {
    size: usize,
    big: bool,
    value: fn([u8; 8]) -> f64,
}

impl Kind {
    fn named(name: &str) -> Option<Kind> {
        let big = name.starts_with('>');
        let (size, value): (usize, fn([u8; 8]) -> f64) = match name.trim_start_matches(['<', '>', '=', '|']) {
            "f4" => (4, |raw| f64::from(f32::from_bits(u64::from_le_bytes(raw) as u32))),
            "f8" => (8, f64::from_le_bytes),
            "u1" => (1, |raw| f64::from(raw[0])),
            "u2" => (2, |raw| u64::from_le_bytes(raw) as f64),
            "i2" => (2, |raw| f64::from(u64::from_le_bytes(raw) as i16)),
            "i4" => (4, |raw| f64::from(u64::from_le_bytes(raw) as i32)),
            _ => return None,
        };
        Some(Kind { size, big, value })
    }

    fn read(&self, bytes: &[u8]) -> f64 {
        let mut raw = [0; 8];
        raw[..self.size].copy_from_slice(bytes);
        if self.big {
            raw[..self.size].reverse();
        }
        (self.value)(raw)
    }
}

/// Header text, and the offset of the data behind it; `None` if the file is cut.
fn header(bytes: &[u8]) -> Option<(&str, usize)> {
    let version = *bytes.get(MAGIC.len())?;
    let (start, length) = match version {
        1 => (10_usize, usize::from(u16::from_le_bytes(bytes.get(8..10)?.try_into().ok()?))),
        _ => (12, u32::from_le_bytes(bytes.get(8..12)?.try_into().ok()?) as usize),
    };
    let end = start.checked_add(length)?;
    Some((std::str::from_utf8(bytes.get(start..end)?).ok()?, end))
}

/// Text that follows a key of the header; `None` without the key.
fn entry<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(key)?;
    Some(rest.trim_start_matches(['\'', '"', ':', ' ']))
}

/// Reads a cloud from an array of shape (points, columns) or (rows, columns, 3 or more).
///
/// # Errors
/// If the array has another shape or type, or its data are cut.
pub fn read(bytes: &[u8]) -> Result<Loaded, FileError> {
    let place = Place::Byte(MAGIC.len());
    let bad = |expected: &str, found: &str| {
        let mend = "store positions with numpy.save as an array of floats of shape (points, 3)";
        FileError::new(place, expected, found, mend)
    };
    let (text, data_at) = header(bytes).ok_or_else(|| bad("a header of NPY", "the end of the file"))?;
    let kind = entry(text, "descr").and_then(|rest| rest.split(['\'', '"']).next());
    let kind = kind.and_then(Kind::named).ok_or_else(|| bad("numbers such as <f4 or <f8", text.trim()))?;
    if entry(text, "fortran_order").is_none_or(|rest| !rest.starts_with("False")) {
        return Err(bad("rows one behind the other (fortran_order False)", text.trim()));
    }
    let shape = entry(text, "shape").and_then(|rest| rest.strip_prefix('(')?.split(')').next());
    let shape: Option<Vec<usize>> =
        shape.map(|s| s.split(',').filter_map(|n| n.trim().parse().ok()).collect());
    let (rows, width, grid) = match shape.as_deref() {
        Some(&[rows, width @ 3..=64]) => (Some(rows), width, None),
        Some(&[height, across, width @ 3..=64]) => {
            (height.checked_mul(across), width, Some(Grid { width: across, height }))
        }
        _ => return Err(bad("a shape of (points, 3) or (rows, columns, 3)", text.trim())),
    };
    let needed = rows.and_then(|rows| rows.checked_mul(width * kind.size));
    let data = needed.and_then(|needed| bytes.get(data_at..)?.get(..needed)).ok_or_else(|| {
        let found = format!("the end of the file after {}", bytes.len().saturating_sub(data_at));
        let place = Place::Byte(bytes.len());
        FileError::new(
            place,
            format!("the numbers of shape {shape:?}"),
            found,
            "the file was cut: write it again",
        )
    })?;
    let values: Vec<f64> = data.chunks_exact(kind.size).map(|number| kind.read(number)).collect();
    let columns = Columns::unnamed(&values, width);
    let mut notes = Vec::new();
    let cloud = columns.cloud(&values, width, grid, &mut notes);
    if columns.used() < width {
        notes.push(format!("{} of {width} columns are left out", width - columns.used()));
    }
    finish(cloud, Isometry3::identity(), notes, place)
}
