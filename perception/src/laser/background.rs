//! Background subtraction in a laser scan: clusters of foreground readings, and the angles that
//! bound each object.

use super::scan::{Scan, ScanError};
use super::shape::{ObjectScan, PosedScan};
use crate::cluster::{ClusterError, euclidean};
use nalgebra::{Point2, Point3, Vector2};
use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};

/// Options for background subtraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObserveOptions {
    /// Maximum gap between neighbouring readings of one object, metres; wider than the gap between a chair's legs.
    pub step_m: f32,
    /// Minimum number of readings of an object.
    pub least: usize,
    /// Maximum distance of the readings' centre from the expected position, metres.
    pub within_m: f64,
    /// Depth difference to the object's outermost reading, metres: a reading farther by more bounds the object; a
    /// reading nearer by more occludes it.
    pub clear_m: f64,
}

impl Default for ObserveOptions {
    fn default() -> Self {
        ObserveOptions { step_m: 0.5, least: 3, within_m: 1.0, clear_m: 0.1 }
    }
}

/// Reason why a scan does not bound the object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ignored {
    /// No cluster of readings is near the expected position.
    NotSeen,
    /// The object reaches the left end of the field of view, so that no reading bounds it there (LeftBound).
    NoLeftBound,
    /// The object reaches the right end of the field of view, so that no reading bounds it there (RightBound).
    NoRightBound,
    /// A nearer object occludes the left end.
    LeftCovered,
    /// A nearer object occludes the right end.
    RightCovered,
    /// Object and bounds span half a turn or more.
    TooNear,
}

impl std::fmt::Display for Ignored {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Ignored::NotSeen => "no readings of it where it was looked for",
            Ignored::NoLeftBound => "it reaches to the left end of the field of view",
            Ignored::NoRightBound => "it reaches to the right end of the field of view",
            Ignored::LeftCovered => "something nearer covers its left end",
            Ignored::RightCovered => "something nearer covers its right end",
            Ignored::TooNear => "it fills half of the directions around the laser",
        })
    }
}

/// Scans that bound one object, and the reasons why others do not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observation {
    /// Scans that bound the object on both sides, posed in the map.
    pub scans: Vec<PosedScan>,
    /// Indices of the ignored scans, with the reasons.
    pub ignored: Vec<(usize, Ignored)>,
}

/// Reason why objects cannot be extracted from scans.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObserveError {
    /// A scan is invalid.
    #[error("scan {index}: {why}")]
    Scan {
        /// Index of the scan.
        index: usize,
        /// Fault of the scan.
        why: ScanError,
    },
    /// The readings cannot be clustered.
    #[error(transparent)]
    Cluster(#[from] ClusterError),
}

/// Extracts the object near a map position from each scan: the cluster of foreground readings nearest to `near`, and
/// its bounding angles. `is_background`: true for background positions of the map, as by
/// [`crate::occupancy::Occupancy::is_background`].
///
/// # Errors
/// If a scan is invalid, or `step_m` is not a positive length.
pub fn observe(
    scans: &[Scan],
    near: &Point2<f64>,
    is_background: impl Fn(&Point2<f64>) -> bool,
    options: &ObserveOptions,
) -> Result<Observation, ObserveError> {
    let _span = tracing::debug_span!("observe", scans = scans.len()).entered();
    let mut observation = Observation::default();
    for (index, scan) in scans.iter().enumerate() {
        scan.check().map_err(|why| ObserveError::Scan { index, why })?;
        let readings = readings_near(scan, near, &is_background, options)?;
        match readings.ok_or(Ignored::NotSeen).and_then(|readings| bounded(scan, &readings, options)) {
            Ok(object) => {
                observation.scans.push(PosedScan { scan: object, model_from_laser: scan.map_from_laser });
            }
            Err(why) => observation.ignored.push((index, why)),
        }
    }
    Ok(observation)
}

/// Cluster of readings of one object in a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// Indices of the readings, ascending.
    pub readings: Vec<usize>,
    /// Mean end point of the readings, map frame, metres.
    pub middle: Point2<f64>,
}

/// Foreground clusters of a scan, in the order of their first readings.
///
/// # Errors
/// If the scan is invalid, or `step_m` is not a positive length.
pub fn things(
    scan: &Scan,
    is_background: impl Fn(&Point2<f64>) -> bool,
    options: &ObserveOptions,
) -> Result<Vec<Cluster>, ObserveError> {
    scan.check().map_err(|why| ObserveError::Scan { index: 0, why })?;
    Ok(clusters(scan, is_background, options)?)
}

fn clusters(
    scan: &Scan,
    is_background: impl Fn(&Point2<f64>) -> bool,
    options: &ObserveOptions,
) -> Result<Vec<Cluster>, ClusterError> {
    let foreground = |index: usize| {
        let place = scan.map_from_laser * scan.endpoint(index)?;
        (!is_background(&place)).then_some((index, place))
    };
    let (index, places): (Vec<usize>, Vec<Point2<f64>>) =
        (0..scan.ranges_m.len()).filter_map(foreground).unzip();
    // Told from where the laser stands, so that single precision is fine everywhere on a large map.
    let from = scan.map_from_laser.translation.vector;
    let flat: Vec<Point3<f32>> =
        places.iter().map(|p| Point3::new((p.x - from.x) as f32, (p.y - from.y) as f32, 0.0)).collect();
    let cluster = |members: Vec<u32>| {
        let sum: Vector2<f64> = members.iter().map(|&i| places[i as usize].coords).sum();
        let middle = Point2::from(sum / members.len() as f64);
        let mut readings: Vec<usize> = members.iter().map(|&i| index[i as usize]).collect();
        readings.sort_unstable();
        Cluster { readings, middle }
    };
    let mut found: Vec<Cluster> =
        euclidean(&flat, options.step_m, options.least)?.into_iter().map(cluster).collect();
    found.sort_by_key(|c| c.readings.first().copied());
    Ok(found)
}

/// Indices of the readings in the foreground cluster nearest to a position; `None` if no cluster is within `within_m`.
fn readings_near(
    scan: &Scan,
    near: &Point2<f64>,
    is_background: impl Fn(&Point2<f64>) -> bool,
    options: &ObserveOptions,
) -> Result<Option<Vec<usize>>, ObserveError> {
    let found = clusters(scan, is_background, options)?;
    let reachable = found.into_iter().map(|c| ((c.middle - near).norm(), c));
    let nearest = reachable.filter(|(d, _)| *d <= options.within_m).min_by(|a, b| a.0.total_cmp(&b.0));
    Ok(nearest.map(|(_, cluster)| cluster.readings))
}

/// Object with the given readings (by index) and its bounding angles.
fn bounded(scan: &Scan, readings: &[usize], options: &ObserveOptions) -> Result<ObjectScan, Ignored> {
    let points: Vec<Point2<f64>> = readings.iter().filter_map(|&i| scan.endpoint(i)).collect();
    let middle: Vector2<f64> = points.iter().map(|p| p.coords).sum();
    let towards = middle.y.atan2(middle.x);
    // All angles from the direction of the thing, so that a laser that looks all around has no seam in it.
    let from_middle = |i: usize| (scan.angles_rad[i] - towards + PI).rem_euclid(TAU) - PI;
    let mut around: Vec<(f64, usize)> = (0..scan.angles_rad.len()).map(|i| (from_middle(i), i)).collect();
    around.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let own = |(_, i): &(f64, usize)| readings.contains(i);
    let (Some(right), Some(left)) = (around.iter().position(own), around.iter().rposition(own)) else {
        return Err(Ignored::NotSeen);
    };
    let past = |at: usize, others: &mut dyn Iterator<Item = &(f64, usize)>, missing, covered| {
        let own_m = scan.ranges_m[around[at].1];
        for &(angle, i) in others {
            match past(own_m, scan.ranges_m[i], options.clear_m) {
                Some(Ordering::Greater) => return Ok(angle),
                Some(Ordering::Less) => return Err(covered),
                _ => {}
            }
        }
        Err(missing)
    };
    let left_bound = past(left, &mut around[left + 1..].iter(), Ignored::NoLeftBound, Ignored::LeftCovered)?;
    let right_bound =
        past(right, &mut around[..right].iter().rev(), Ignored::NoRightBound, Ignored::RightCovered)?;
    if left_bound - right_bound >= PI {
        return Err(Ignored::TooNear);
    }
    Ok(ObjectScan {
        points,
        right_bound_rad: towards + right_bound,
        right_object_rad: towards + around[right].0,
        left_object_rad: towards + around[left].0,
        left_bound_rad: towards + left_bound,
    })
}

/// Compares a neighbouring range with the object's own: `Greater` if beyond, `Less` if in front, `Equal` within
/// `clear_m`; `None` without a reading.
fn past(own_m: f64, reading_m: f64, clear_m: f64) -> Option<Ordering> {
    if reading_m.is_nan() || reading_m <= 0.0 {
        return None;
    }
    let beyond_m = reading_m - own_m;
    Some(if beyond_m.abs() <= clear_m { Ordering::Equal } else { beyond_m.total_cmp(&0.0) })
}
