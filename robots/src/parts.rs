//! Parts of a body: base, head, arm with a hand, sensors, any of which may be missing.

use crate::failure::Failure;
use descry_perception::Intrinsics;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// Parts and abilities of a body, constant over its lifetime.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Name, for people and records.
    pub name: String,
    /// True if the body and its world are simulated.
    pub simulated: bool,
    /// Mobile base; `None` if the body stays at its only station.
    pub base: Option<Base>,
    /// Head that turns the camera; `None` if only the base turns the camera.
    pub head: Option<Head>,
    /// Arm; `None` if the body has none.
    pub arm: Option<Arm>,
    /// Depth camera; `None` if the body has none.
    pub camera: Option<Camera>,
    /// Planar laser; `None` if the body has none.
    pub laser: Option<Laser>,
    /// Other sensors, whose readings are interpreted by programs of a domain.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub senses: Vec<Sense>,
    /// Names of the coordinate frames of the room and of the body.
    pub frames: Frames,
    /// Upward direction in the map frame, if known.
    pub up: Option<Vector3<f64>>,
    /// Standard deviation of the estimated position along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of the estimated heading, radians.
    pub pose_sigma_rad: f64,
}

/// An optional part of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Mobile base: [`Description::base`].
    Base,
    /// Arm: [`Description::arm`].
    Arm,
    /// Hand at the end of the arm: [`Arm::hand`].
    Hand,
    /// Depth camera: [`Description::camera`].
    Camera,
    /// Planar laser: [`Description::laser`].
    Laser,
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Part::Base => "base",
            Part::Arm => "arm",
            Part::Hand => "hand",
            Part::Camera => "camera",
            Part::Laser => "laser",
        })
    }
}

impl Description {
    /// True if the body has the part.
    pub fn has(&self, part: Part) -> bool {
        match part {
            Part::Base => self.base.is_some(),
            Part::Arm => self.arm.is_some(),
            Part::Hand => self.hand().is_some(),
            Part::Camera => self.camera.is_some(),
            Part::Laser => self.laser.is_some(),
        }
    }

    /// Checks that the body has a part.
    ///
    /// # Errors
    /// [`Failure::Unable`] without it.
    pub fn need(&self, part: Part) -> Result<(), Failure> {
        if self.has(part) { Ok(()) } else { Err(self.lacks(part)) }
    }

    /// Failure of a request that needs a part which the body lacks.
    pub(crate) fn lacks(&self, part: Part) -> Failure {
        Failure::Unable { because: format!("{} has no {part}", self.name) }
    }

    /// Failure of a request to read a custom sensor, by name, which the body lacks.
    pub(crate) fn lacks_sense(&self, name: &str) -> Failure {
        Failure::Unable { because: format!("{} has no sense \"{name}\"", self.name) }
    }

    /// Hand at the end of the arm; `None` without an arm or a hand.
    pub fn hand(&self) -> Option<&Gripper> {
        self.arm.as_ref()?.hand.as_ref()
    }

    /// Reach of the arm from the base's centre, metres; `None` without an arm.
    pub fn reach_m(&self) -> Option<f64> {
        self.arm.as_ref().map(|arm| arm.reach_m)
    }

    /// Duration of a straight drive with a turn, seconds, by [`Speeds::duration_s`]; 0 without a base.
    pub fn duration_s(&self, distance_m: f64, turned_rad: f64) -> f64 {
        self.base.as_ref().map_or(0.0, |base| base.speeds.duration_s(distance_m, turned_rad))
    }

    /// Radius of the base, metres; 0 without a base.
    pub fn radius_m(&self) -> f64 {
        self.base.as_ref().map_or(0.0, |base| base.footprint.radius_m())
    }
}

/// Mobile base.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Base {
    /// Outline on the floor.
    pub footprint: Footprint,
    /// Speeds, for costs and time limits.
    pub speeds: Speeds,
}

/// Outline of the base on the floor, in the base frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Footprint {
    /// Disc around the base's origin.
    Disc {
        /// Radius, metres.
        radius_m: f64,
    },
    /// Polygon around the base's origin.
    Polygon {
        /// Corners in order, at least three, metres.
        corners_m: Vec<Point2<f64>>,
    },
}

impl Footprint {
    /// Radius of the smallest disc around the base's origin that contains the footprint, metres: the
    /// clearance of a base at any heading.
    pub fn radius_m(&self) -> f64 {
        match self {
            Footprint::Disc { radius_m } => *radius_m,
            Footprint::Polygon { corners_m } => corners_m.iter().map(|c| c.coords.norm()).fold(0.0, f64::max),
        }
    }
}

/// Speeds of a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Speeds {
    /// Driving speed, metres a second.
    pub linear_m_s: f64,
    /// Speed of turning on the spot, radians a second.
    pub angular_rad_s: f64,
}

impl Speeds {
    /// Minimum speeds; a slower body would never arrive.
    pub const LEAST: Speeds = Speeds { linear_m_s: 0.001, angular_rad_s: 0.0001 };

    /// Duration of a straight drive during which the base turns: max(ds/v, dθ/ω), seconds.
    pub fn duration_s(&self, distance_m: f64, turned_rad: f64) -> f64 {
        (distance_m / self.linear_m_s).max(turned_rad / self.angular_rad_s)
    }
}

/// The head that carries the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Head {
    /// Centre of rotation of the head and position of the camera, base frame, metres.
    pub base_from_head: Point3<f64>,
    /// Maximum pan to either side, radians.
    pub pan_limit_rad: f64,
    /// Maximum tilt down, radians.
    pub tilt_down_rad: f64,
    /// Maximum tilt up, radians.
    pub tilt_up_rad: f64,
}

/// An arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Arm {
    /// Reach from the base's centre, metres.
    pub reach_m: f64,
    /// Hand at its end; `None` if the arm only pushes.
    pub hand: Option<Gripper>,
}

/// Hand that grasps objects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gripper {
    /// Maximum width of a graspable object, metres.
    pub opening_m: f64,
}

/// A depth camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name of the camera's optical frame: x right, y down, z forward.
    pub frame: String,
    /// Image size, focal lengths and principal point, pixels.
    pub intrinsics: Intrinsics,
    /// Minimum and maximum depth, metres.
    pub range_m: (f64, f64),
    /// True if frames may have a colour image.
    pub colour: bool,
    /// Maximum time by which a frame's stamp may precede its request, seconds. Drivers with a buffer may
    /// return a frame from before the request.
    #[serde(default)]
    pub latency_s: f64,
}

impl Camera {
    /// True if a point in the camera's optical frame lies in the field of view and in range.
    pub fn shows(&self, p: &Point3<f64>) -> bool {
        if p.z <= 0.0 || p.z < self.range_m.0 || p.z > self.range_m.1 {
            return false;
        }
        let c = &self.intrinsics;
        let (u, v) = (c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy);
        u >= 0.0 && v >= 0.0 && u < c.width as f64 && v < c.height as f64
    }
}

/// A laser that sweeps in a horizontal plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Laser {
    /// Name of the laser's frame, whose x axis points straight ahead.
    pub frame: String,
    /// Constant pose of the laser in the base frame.
    pub base_from_laser: Isometry3<f64>,
    /// Angle of the first reading, anticlockwise from straight ahead, radians.
    pub first_rad: f64,
    /// Angle from one reading to the next, radians.
    pub step_rad: f64,
    /// Number of readings in a sweep.
    pub readings: usize,
    /// Maximum range, metres.
    pub reach_m: f64,
}

/// A custom sensor, other than camera and laser: a label reader, a microphone, a switch in the hand.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sense {
    /// Name for people and domains: `label reader`.
    pub name: String,
    /// One line on the meaning and form of the readings, stored with each reading in the record.
    pub about: String,
}

/// Names of the coordinate frames of the room and of the body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Frames {
    /// Name of the map frame, fixed to the room.
    pub map: String,
    /// Name of the base frame, fixed to the body.
    pub base: String,
}

impl Default for Frames {
    fn default() -> Self {
        Frames { map: "map".into(), base: "base".into() }
    }
}
