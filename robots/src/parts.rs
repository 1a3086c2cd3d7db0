//! Parts of a body: base, head, arm with a hand, sensors, each of which may be missing.

use crate::failure::Failure;
use descry_perception::Intrinsics;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// Parts and abilities of a body. Constant while it lives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// For people and records.
    pub name: String,
    /// True if the world is simulated too.
    pub simulated: bool,
    /// Base; `None` if the body stays at its one station.
    pub base: Option<Base>,
    /// Head that turns the camera; `None` if the camera looks where the base's pose says.
    pub head: Option<Head>,
    /// Arm that pushes and opens doors.
    pub arm: Option<Arm>,
    /// The depth camera.
    pub camera: Option<Camera>,
    /// The laser.
    pub laser: Option<Laser>,
    /// Other sensors: what they say is read by the programs of a domain.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub senses: Vec<Sense>,
    /// Names of frames that are no sensor's.
    pub frames: Frames,
    /// Direction of "up" in the map, if it is known.
    pub up: Option<Vector3<f64>>,
    /// Standard deviation of localisation along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of the heading, radians.
    pub pose_sigma_rad: f64,
}

/// A part that a body may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// [`Description::base`].
    Base,
    /// [`Description::arm`].
    Arm,
    /// [`Arm::hand`].
    Hand,
    /// [`Description::camera`].
    Camera,
    /// [`Description::laser`].
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

    /// Refuses what needs a part that the body does not have.
    ///
    /// # Errors
    /// [`Failure::Unable`].
    pub fn need(&self, part: Part) -> Result<(), Failure> {
        if self.has(part) { Ok(()) } else { Err(self.lacks(part)) }
    }

    /// Failure of a body that lacks the part.
    pub(crate) fn lacks(&self, part: Part) -> Failure {
        Failure::Unable { because: format!("{} has no {part}", self.name) }
    }

    /// Failure of a body that lacks a sense of that name.
    pub(crate) fn lacks_sense(&self, name: &str) -> Failure {
        Failure::Unable { because: format!("{} has no sense \"{name}\"", self.name) }
    }

    /// The hand at the arm's end.
    pub fn hand(&self) -> Option<&Gripper> {
        self.arm.as_ref()?.hand.as_ref()
    }

    /// Reach of the arm from the base's middle, metres.
    pub fn reach_m(&self) -> Option<f64> {
        self.arm.as_ref().map(|arm| arm.reach_m)
    }

    /// Duration of a straight drive, seconds, as [`Speeds::duration_s`]; none without a base.
    pub fn duration_s(&self, distance_m: f64, turned_rad: f64) -> f64 {
        self.base.as_ref().map_or(0.0, |base| base.speeds.duration_s(distance_m, turned_rad))
    }

    /// Radius of the base, metres; 0 if there is none.
    pub fn radius_m(&self) -> f64 {
        self.base.as_ref().map_or(0.0, |base| base.footprint.radius_m())
    }
}

/// Base that drives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Base {
    /// Outline on the floor.
    pub footprint: Footprint,
    /// For costs and time limits.
    pub speeds: Speeds,
}

/// The outline of the base on the floor, in its own frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Footprint {
    /// A disc around the base's origin.
    Disc {
        /// Metres.
        radius_m: f64,
    },
    /// Corners in order, metres.
    Polygon {
        /// At least three.
        corners_m: Vec<Point2<f64>>,
    },
}

impl Footprint {
    /// Radius of the least disc around the base's origin that holds the footprint, metres: a base that turns anywhere needs this much room.
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
    /// Along the ground, metres a second.
    pub linear_m_s: f64,
    /// Turning on the spot, radians a second.
    pub angular_rad_s: f64,
}

impl Speeds {
    /// A body that is slower never arrives.
    pub const LEAST: Speeds = Speeds { linear_m_s: 0.001, angular_rad_s: 0.0001 };

    /// Duration of a straight drive during which the base turns: max(ds/v, dθ/ω), seconds.
    pub fn duration_s(&self, distance_m: f64, turned_rad: f64) -> f64 {
        (distance_m / self.linear_m_s).max(turned_rad / self.angular_rad_s)
    }
}

/// The head that carries the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Head {
    /// Centre of rotation of the head, in the base frame, metres. The camera looks from there.
    pub base_from_head: Point3<f64>,
    /// Greatest turn to either side, radians.
    pub pan_limit_rad: f64,
    /// Greatest turn down, radians.
    pub tilt_down_rad: f64,
    /// Greatest turn up, radians.
    pub tilt_up_rad: f64,
}

/// An arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Arm {
    /// Reach from the base's middle, metres.
    pub reach_m: f64,
    /// Gripper at its end; `None` if it only pushes.
    pub hand: Option<Gripper>,
}

/// A hand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gripper {
    /// The widest thing that it takes, metres.
    pub opening_m: f64,
}

/// A depth camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name of its optical frame: x right, y down, z forward.
    pub frame: String,
    /// Pixels, focal lengths and principal point.
    pub intrinsics: Intrinsics,
    /// Least and greatest depth that it measures, metres.
    pub range_m: (f64, f64),
    /// True if frames may have a colour image.
    pub colour: bool,
    /// Longest time by which a frame's stamp may lie before the request for it, seconds: drivers with a buffer answer with a frame
    /// that is there already.
    #[serde(default)]
    pub latency_s: f64,
}

impl Camera {
    /// True if a point in its optical frame lies in its field of view and range.
    pub fn shows(&self, p: &Point3<f64>) -> bool {
        if p.z <= 0.0 || p.z < self.range_m.0 || p.z > self.range_m.1 {
            return false;
        }
        let c = &self.intrinsics;
        let (u, v) = (c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy);
        u >= 0.0 && v >= 0.0 && u < c.width as f64 && v < c.height as f64
    }
}

/// A laser that sweeps in a plane level with the floor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Laser {
    /// Name of its frame, x straight ahead.
    pub frame: String,
    /// Pose of the laser on the base; constant.
    pub base_from_laser: Isometry3<f64>,
    /// Angle of the first reading, anticlockwise from straight ahead, radians.
    pub first_rad: f64,
    /// Angle from one reading to the next, radians.
    pub step_rad: f64,
    /// Readings in a sweep.
    pub readings: usize,
    /// Nothing farther returns, metres.
    pub reach_m: f64,
}

/// A sensor that is neither camera nor laser: a reader of labels, a microphone, a switch in the hand.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sense {
    /// As people and domains call it: `label reader`.
    pub name: String,
    /// Meaning and form of its readings, in a line; the record has it beside each reading.
    pub about: String,
}

/// Names of the frames in transforms that are no sensor's.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Frames {
    /// The room.
    pub map: String,
    /// The body.
    pub base: String,
}

impl Default for Frames {
    fn default() -> Self {
        Frames { map: "map".into(), base: "base".into() }
    }
}
