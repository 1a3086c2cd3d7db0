//! Places: poses on the floor, and named stations.

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Planar pose in the map frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose2 {
    /// Position along x, metres.
    pub x_m: f64,
    /// Position along y, metres.
    pub y_m: f64,
    /// Heading, counter-clockwise from the map's x, radians.
    pub yaw_rad: f64,
}

impl Pose2 {
    /// Creates a pose.
    pub fn new(x_m: f64, y_m: f64, yaw_rad: f64) -> Self {
        Pose2 { x_m, y_m, yaw_rad }
    }

    /// Pose at (`x_m`, `y_m`) that faces `point`.
    pub fn facing(x_m: f64, y_m: f64, point: &Point2<f64>) -> Self {
        Pose2 { x_m, y_m, yaw_rad: (point.y - y_m).atan2(point.x - x_m) }
    }

    /// Position in the map, metres.
    pub fn point(&self) -> Point2<f64> {
        Point2::new(self.x_m, self.y_m)
    }

    /// Pose in space with z = 0 and the body upright.
    pub fn isometry(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::new(self.x_m, self.y_m, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw_rad),
        )
    }

    /// Projects a pose onto the floor: height, roll and pitch are dropped.
    pub fn from_isometry(map_from_base: &Isometry3<f64>) -> Self {
        let forward = map_from_base.rotation * Vector3::x();
        let at = map_from_base.translation.vector;
        Pose2 { x_m: at.x, y_m: at.y, yaw_rad: forward.y.atan2(forward.x) }
    }
}

/// A destination for a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// Any pose on the floor.
    Pose(Pose2),
    /// Station of this name, one of [`Robot::stations`](crate::Robot::stations).
    Station(String),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Pose(p) => {
                // Nothing reads as minus nothing.
                let [x_m, y_m] = [p.x_m, p.y_m].map(|m| (1e2 * m).round() / 1e2 + 0.0);
                let yaw_deg = p.yaw_rad.to_degrees().round() + 0.0;
                write!(f, "({x_m:.2} m, {y_m:.2} m, {yaw_deg:.0}°)")
            }
            Place::Station(name) => write!(f, "{name}"),
        }
    }
}

/// A pose that the body knows by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Station {
    /// Unique among the stations of the body.
    pub name: String,
    /// Pose of the base at the station, in the map.
    pub map_from_base: Isometry3<f64>,
}
