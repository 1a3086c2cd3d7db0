//! Lossless encoding of laser sweeps as bytes.

use crate::document::{Blob, BlobInfo, Form};
use crate::error::Error;
use descry_perception::laser::Scan;
use nalgebra::Isometry2;
use serde::{Deserialize, Serialize};
use serde_json::json;

/// Name of a sweep's blob.
pub(crate) const SCAN: &str = "scan";
/// Tolerance on the even spacing of angles, radians.
const EVEN_RAD: f64 = 1e-6;

/// Memory layout of a sweep: ranges as f64, evenly spaced between two angles.
#[derive(Serialize, Deserialize)]
struct Layout {
    first_rad: f64,
    last_rad: f64,
    readings: usize,
}

impl Layout {
    fn angle_rad(&self, index: usize) -> f64 {
        let steps = self.readings.saturating_sub(1).max(1) as f64;
        self.first_rad + (self.last_rad - self.first_rad) * index as f64 / steps
    }
}

/// Encodes a sweep as a blob, without its pose.
///
/// # Errors
/// [`Error::Input`] if the sweep is inconsistent, or its angles are not evenly spaced.
pub fn encode(scan: &Scan) -> Result<Blob<'static>, Error> {
    let fail = |what: String| Error::Input { what, mend: "give one range an angle, at even steps".into() };
    scan.check().map_err(|e| fail(e.to_string()))?;
    let (first, last) = (scan.angles_rad.first(), scan.angles_rad.last());
    let (Some(&first_rad), Some(&last_rad)) = (first, last) else {
        return Err(fail("a sweep without a reading".into()));
    };
    let layout = Layout { first_rad, last_rad, readings: scan.angles_rad.len() };
    let odd = |(i, angle): (usize, &f64)| (layout.angle_rad(i) - angle).abs() > EVEN_RAD;
    if let Some(at) = scan.angles_rad.iter().enumerate().position(odd) {
        return Err(fail(format!("angle {at} of a sweep is not at an even step")));
    }
    let data: Vec<u8> = scan.ranges_m.iter().flat_map(|r| r.to_le_bytes()).collect();
    Ok(Blob { name: SCAN.into(), form: Form::LaserScan, layout: json!(layout), data: data.into() })
}

/// Decodes a laser sweep that was taken at the pose `map_from_laser`.
///
/// # Errors
/// Reason for which the layout cannot be read, or does not match the data.
pub fn decode(info: &BlobInfo, data: &[u8], map_from_laser: Isometry2<f64>) -> Result<Scan, String> {
    let layout: Layout =
        Layout::deserialize(&info.layout).map_err(|e| format!("its layout cannot be read: {e}"))?;
    if layout.readings.checked_mul(8) != Some(data.len()) {
        return Err(format!("{} readings do not make {} bytes", layout.readings, data.len()));
    }
    let scan = Scan {
        angles_rad: (0..layout.readings).map(|i| layout.angle_rad(i)).collect(),
        ranges_m: data.as_chunks().0.iter().map(|word| f64::from_le_bytes(*word)).collect(),
        map_from_laser,
    };
    scan.check().map_err(|e| e.to_string())?;
    Ok(scan)
}
