//! Station of a drive, and its plan: the points without floor and ceiling, projected onto the floor.

use crate::cloud::is_finite;
use crate::view::View;
use nalgebra::{Isometry2, Isometry3, Point2, Point3, Rotation3, UnitQuaternion, Vector2, Vector3};
use rustc_hash::FxHashMap;
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// View at one stop of a drive, levelled. The *level* frame has its origin on the floor under the camera, x forward, y
/// left, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct Station {
    /// Points in the level frame, metres; non-finite ones are ignored.
    pub points: Vec<Point3<f32>>,
    /// Odometry pose of the level frame; only differences between stations are used.
    pub odom_from_level: Isometry2<f64>,
}

/// Reason why a view cannot serve as a station.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StationError {
    /// The camera pose is not finite.
    #[error("the pose of the camera is not finite: give metres and a unit quaternion")]
    Pose,
    /// The camera looks straight up or down.
    #[error(
        "the camera looks straight up or down, so that nothing is ahead: give a view whose optical axis is not upright"
    )]
    Upright,
}

impl Station {
    /// Converts a view whose world frame has z up and the floor at zero.
    ///
    /// # Errors
    /// If the pose is not finite or the camera looks straight up or down.
    pub fn of(view: &View) -> Result<Station, StationError> {
        let pose = &view.world_from_camera;
        let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
        if !numbers.copied().all(f64::is_finite) {
            return Err(StationError::Pose);
        }
        let ahead = (pose.rotation * Vector3::z()).xy();
        if ahead.norm() < 1e-3 {
            return Err(StationError::Upright);
        }
        let heading = ahead.y.atan2(ahead.x);
        let at = pose.translation.vector;
        let unturn =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(&Vector3::z_axis(), -heading));
        let level_from_camera =
            Isometry3::from_parts(Vector3::new(0.0, 0.0, at.z).into(), unturn * pose.rotation);
        let finite = view.cloud.points.iter().filter(|p| is_finite(p));
        Ok(Station {
            points: finite.map(|p| (level_from_camera * p.cast::<f64>()).cast()).collect(),
            odom_from_level: Isometry2::new(at.xy(), heading),
        })
    }

    /// Plan of the points with heights in `band_m` and inside the field of view, thinned to squares of `thin_m`;
    /// squares with too few points are left out.
    pub(super) fn plan(&self, band_m: &RangeInclusive<f64>, field: &FieldOfView, thin_m: f64) -> Vec<Spot> {
        let kept = self.points.iter().filter(|p| is_finite(p) && band_m.contains(&f64::from(p.z)));
        let places = kept.map(|p| Spot { at: Point2::new(f64::from(p.x), f64::from(p.y)), weight: 1.0 });
        let mut spots = thinned(places.filter(|s| field.sees(&s.at)), thin_m);
        spots.retain(|s| s.weight >= FEWEST);
        spots.iter_mut().for_each(|s| s.weight = s.weight.min(MOST));
        spots
    }
}

/// Plan points thinned to one per square, at the weighted centroid, ordered by square.
pub(super) fn thinned(spots: impl Iterator<Item = Spot>, edge_m: f64) -> Vec<Spot> {
    let mut squares: FxHashMap<(i32, i32), (Vector2<f64>, f64)> = FxHashMap::default();
    for spot in spots {
        let key = ((spot.at.x / edge_m).floor() as i32, (spot.at.y / edge_m).floor() as i32);
        let square = squares.entry(key).or_default();
        square.0 += spot.at.coords * spot.weight;
        square.1 += spot.weight;
    }
    let mut keyed: Vec<_> = squares.into_iter().collect();
    keyed.sort_unstable_by_key(|(key, _)| *key);
    keyed.into_iter().map(|(_, (sum, weight))| Spot { at: (sum / weight).into(), weight }).collect()
}

/// Minimum number of points in a square; fewer are noise.
const FEWEST: f64 = 2.0;
/// Maximum weight of a plan point, in measured points.
const MOST: f64 = 8.0;

/// Plan point: the points in one square of the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// Centroid of the points on the floor plane, metres.
    pub at: Point2<f64>,
    /// Number of measured points; in a station's plan at most [`MOST`].
    pub weight: f64,
}

/// Horizontal field of view: a sector around the forward direction of the level frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOfView {
    /// Right limit, radians, anticlockwise from ahead; negative.
    pub right_rad: f64,
    /// Left limit, radians, anticlockwise from ahead.
    pub left_rad: f64,
    /// Minimum depth, metres; a range instead if the field of view exceeds half a turn.
    pub near_m: f64,
    /// Maximum depth used, metres; noise grows with its square.
    pub far_m: f64,
}

impl Default for FieldOfView {
    fn default() -> Self {
        FieldOfView { right_rad: -0.5, left_rad: 0.5, near_m: 0.5, far_m: 6.0 }
    }
}

impl FieldOfView {
    /// True if a place (level frame, metres) is inside the field of view.
    pub fn sees(&self, place: &Point2<f64>) -> bool {
        let bearing = place.y.atan2(place.x);
        let depth = if self.left_rad - self.right_rad > PI { place.coords.norm() } else { place.x };
        (self.near_m..=self.far_m).contains(&depth) && bearing >= self.right_rad && bearing <= self.left_rad
    }
}

/// Plan points that the other station's field of view also covers.
pub(super) fn shared(spots: &[Spot], other_from_here: &Isometry2<f64>, field: &FieldOfView) -> Vec<Spot> {
    spots.iter().filter(|s| field.sees(&(other_from_here * s.at))).copied().collect()
}
