//! LAS files of laser surveys, versions 1.0 to 1.4: positions and colours.

use super::columns::to_origin;
use super::error::{FileError, Place};
use super::loaded::{Loaded, finish};
use crate::cloud::Cloud;
use nalgebra::{Isometry3, Point3};

pub(super) const MAGIC: &[u8] = b"LASF";

/// Offset of the minor version in the header, bytes. From: LAS Specification 1.4, table 3.
const MINOR_VERSION: usize = 25;
/// Offset of the field with the offset of the points, bytes. From: LAS Specification 1.4, table 3.
const DATA: usize = 96;
/// Offset of the point format, bytes. From: LAS Specification 1.4, table 3.
const FORMAT: usize = 104;
/// Offset of the length of a point record, bytes. From: LAS Specification 1.4, table 3.
const LENGTH: usize = 105;
/// Offset of the 32-bit number of points, bytes. From: LAS Specification 1.4, table 3.
const LEGACY_COUNT: usize = 107;
/// Offset of the three scale factors, bytes. From: LAS Specification 1.4, table 3.
const SCALES: usize = 131;
/// Offset of the three coordinate offsets, bytes. From: LAS Specification 1.4, table 3.
const OFFSETS: usize = 155;
/// Offset of the 64-bit number of points (version 1.4), bytes. From: LAS Specification 1.4, table 3.
const COUNT: usize = 247;

/// Offset of the colour within a point record, bytes; `None` without colour. From: LAS
/// Specification 1.4, tables 7 to 18.
fn colour_at(format: u8) -> Option<usize> {
    match format {
        2 => Some(20),
        3 | 5 => Some(28),
        7 | 8 | 10 => Some(30),
        _ => None,
    }
}

fn at<const N: usize>(bytes: &[u8], offset: usize) -> Option<[u8; N]> {
    bytes.get(offset..offset.checked_add(N)?)?.try_into().ok()
}

/// Point records of a file, with the header's description of them.
struct Points<'a> {
    bytes: &'a [u8],
    length: usize,
    format: u8,
    scales: [f64; 3],
    offsets: [f64; 3],
}

fn points(bytes: &[u8]) -> Option<(Points<'_>, u64, usize)> {
    let triple = |offset: usize| {
        let number = |k: usize| at(bytes, offset + 8 * k).map(f64::from_le_bytes);
        Some([number(0)?, number(1)?, number(2)?])
    };
    let legacy = u64::from(u32::from_le_bytes(at(bytes, LEGACY_COUNT)?));
    let count = match bytes.get(MINOR_VERSION)? {
        4.. if legacy == 0 => u64::from_le_bytes(at(bytes, COUNT)?),
        _ => legacy,
    };
    let data_at = u32::from_le_bytes(at(bytes, DATA)?) as usize;
    let points = Points {
        bytes: bytes.get(data_at..)?,
        length: usize::from(u16::from_le_bytes(at(bytes, LENGTH)?)),
        format: *bytes.get(FORMAT)?,
        scales: triple(SCALES)?,
        offsets: triple(OFFSETS)?,
    };
    Some((points, count, data_at))
}

/// Reads a LAS file; map coordinates are moved to the origin.
///
/// # Errors
/// If the file is compressed (LAZ) or cut, or its header is invalid.
pub fn read(bytes: &[u8]) -> Result<Loaded, FileError> {
    let head = || {
        let place = Place::Byte(bytes.len());
        FileError::new(place, "a header of LAS", "the end of the file", "the file was cut: write it again")
    };
    let (points, count, data_at) = points(bytes).ok_or_else(head)?;
    let place = Place::Byte(FORMAT);
    if points.format & 0xc0 != 0 {
        let mend = "unpack it with laszip or laspy: .las instead of .laz";
        return Err(FileError::new(place, "points as they are", "packed points (LAZ)", mend));
    }
    let colour = colour_at(points.format);
    if points.format > 10 || points.length < colour.map_or(20, |at| at + 6) {
        let found = format!("format {} of {} bytes", points.format, points.length);
        return Err(FileError::new(place, "a point format from 0 to 10", found, "write the file again"));
    }
    let needed = usize::try_from(count).ok().and_then(|count| count.checked_mul(points.length));
    let Some(data) = needed.and_then(|needed| points.bytes.get(..needed)) else {
        let found = format!("the end of the file after {} bytes", points.bytes.len());
        let expected = format!("{count} points of {} bytes", points.length);
        return Err(FileError::new(
            Place::Byte(data_at),
            expected,
            found,
            "the file was cut: write it again",
        ));
    };
    let records = || data.chunks_exact(points.length);
    let coordinate = |record: &[u8], k: usize| {
        let whole = at(record, 4 * k).map_or(f64::NAN, |raw| f64::from(i32::from_le_bytes(raw)));
        whole * points.scales[k] + points.offsets[k]
    };
    let mut positions: Vec<[f64; 3]> =
        records().map(|record| [0, 1, 2].map(|k| coordinate(record, k))).collect();
    let notes = to_origin(&mut positions).map(|(_, note)| note).into_iter().collect();
    let channels = |record: &[u8], at_byte: usize| {
        [0, 2, 4].map(|k| at(record, at_byte + k).map_or(0, u16::from_le_bytes))
    };
    let colours = colour.map(|at_byte| {
        let all: Vec<[u16; 3]> = records().map(|record| channels(record, at_byte)).collect();
        // Colours have 16 bits; some writers leave the upper eight empty.
        let shift = if all.iter().flatten().any(|c| *c > 255) { 8 } else { 0 };
        all.into_iter().map(|c| c.map(|v| (v >> shift) as u8)).collect()
    });
    let points = positions.into_iter().map(|p| Point3::from(p.map(|c| c as f32))).collect();
    finish(Cloud { points, colours, ..Cloud::default() }, Isometry3::identity(), notes, place)
}
