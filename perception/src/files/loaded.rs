//! A cloud as read from a file, normalised.

use super::error::{FileError, Place};
use crate::cloud::{Cloud, CloudError, Grid};
use nalgebra::{Isometry3, Point3, Vector3};

/// Cloud read from a file, with the file's further information.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// Points of the file; all finite, unless the cloud has a grid.
    pub cloud: Cloud,
    /// Sensor pose stated by the file (`VIEWPOINT` of PCD), else identity; the points are not transformed by it.
    pub viewpoint: Isometry3<f64>,
    /// Notes for the user: points left out, suspicious units, ignored attributes.
    pub notes: Vec<String>,
}

/// Maximum padding after the data, bytes: the Point Cloud Library fills its files to a memory page. From: chosen, 64
/// KiB.
const MOST_PADDING: usize = 1 << 16;

/// True if the remaining bytes are padding: few, and only zeros and white space.
pub(super) fn is_padding(rest: &[u8]) -> bool {
    rest.len() < MOST_PADDING && rest.iter().all(|b| *b == 0 || b.is_ascii_whitespace())
}

/// Marks points at the sensor's own position, the origin, as missing returns (NaN), and returns their number. Nothing
/// is marked if the file states another sensor position.
fn void_at_sensor(cloud: &mut Cloud, viewpoint: &Isometry3<f64>) -> usize {
    if viewpoint.translation.vector != Vector3::zeros() {
        return 0;
    }
    let mut voided = 0;
    for p in cloud.points.iter_mut().filter(|p| p.coords == Vector3::zeros()) {
        voided += 1;
        *p = Point3::new(f32::NAN, f32::NAN, f32::NAN);
    }
    voided
}

/// Normalises a cloud as read: infinite points become missing returns (NaN), and clouds without a grid drop missing
/// returns; adds notes about this.
pub(super) fn finish(
    mut cloud: Cloud,
    viewpoint: Isometry3<f64>,
    mut notes: Vec<String>,
    place: Place,
) -> Result<Loaded, FileError> {
    if cloud.grid.is_some_and(|Grid { width, height }| height <= 1 || width <= 1) {
        cloud.grid = None;
    }
    let organised = cloud.grid.is_some();
    let at_lens = if organised { void_at_sensor(&mut cloud, &viewpoint) } else { 0 };
    if at_lens > 0 {
        notes.push(format!("{at_lens} points at (0, 0, 0), where the sensor is, are taken as \"no return\""));
    }
    let mut infinite = 0usize;
    let mut missing = 0usize;
    for p in cloud.points.iter_mut().filter(|p| !crate::cloud::is_finite(p)) {
        missing += 1;
        infinite += usize::from(p.iter().any(|c| c.is_infinite()));
        *p = Point3::new(f32::NAN, f32::NAN, f32::NAN);
    }
    if infinite > 0 {
        notes.push(format!("{infinite} points with infinite coordinates are taken as \"no return\""));
    }
    if !organised && missing > 0 {
        notes.push(format!("{missing} points without finite coordinates were left out"));
        cloud = cloud.finite();
    }
    notes.extend(cloud.unit_warning());
    cloud.check().map_err(|e: CloudError| {
        FileError::new(place, "attributes that fit the points", e.to_string(), "mend the header")
    })?;
    Ok(Loaded { cloud, viewpoint, notes })
}
