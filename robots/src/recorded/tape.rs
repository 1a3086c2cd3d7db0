//! What a body was asked and what it answered, in order: enough to live through it again.

use crate::body::{
    Colour, Description, Door, Driven, Grasp, Grasped, Hand, Opened, Place, Placed, Placing, PoseEstimate,
    Push, Pushed, Room, Scanned, Sensed, Stamp, StampedTransform, Station, SurfaceHint, Travel,
};
use crate::body::{Looked, Robot};
use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use descry_perception::{Cloud, Intrinsics};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

/// What a body is and knows when a run begins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// See [`Robot::description`].
    pub description: Description,
    /// See [`Robot::surfaces`].
    pub surfaces: Vec<SurfaceHint>,
    /// See [`Robot::rooms`].
    #[serde(default)]
    pub rooms: Vec<Room>,
    /// See [`Robot::doors`].
    #[serde(default)]
    pub doors: Vec<Door>,
    /// See [`Robot::stations`].
    pub stations: Option<Vec<Station>>,
    /// See [`Robot::map`].
    pub map: Option<OccupancyGrid>,
    /// See [`Robot::now_ns`].
    pub now_ns: Stamp,
}

impl Known {
    /// What a body says of itself.
    pub fn of(robot: &dyn Robot) -> Self {
        Known {
            description: robot.description().clone(),
            surfaces: robot.surfaces().to_vec(),
            rooms: robot.rooms().to_vec(),
            doors: robot.doors().to_vec(),
            stations: robot.stations().map(<[Station]>::to_vec),
            map: robot.map().cloned(),
            now_ns: robot.now_ns(),
        }
    }
}

/// Something that a body was asked to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Request {
    /// [`Robot::pose`].
    Pose,
    /// [`Robot::drive_to`].
    DriveTo(Place),
    /// [`Robot::look_at`].
    LookAt(Point3<f64>),
    /// [`Robot::sense`].
    Sense,
    /// [`Robot::scan`].
    Scan,
    /// [`Robot::push_aside`].
    PushAside(Push),
    /// [`Robot::open_door`].
    OpenDoor(String),
    /// [`Robot::grasp`].
    Grasp(Grasp),
    /// [`Robot::place`].
    Place(Placing),
    /// [`Robot::hand`].
    Hand,
}

impl std::fmt::Display for Request {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Request::Pose => write!(f, "say where it is"),
            Request::DriveTo(place) => write!(f, "drive to {place}"),
            Request::LookAt(p) => write!(f, "look at ({:.3}, {:.3}, {:.3})", p.x, p.y, p.z),
            Request::Sense => write!(f, "take a frame"),
            Request::Scan => write!(f, "sweep its laser"),
            Request::PushAside(push) => write!(f, "push what stands at {}", push.object),
            Request::OpenDoor(door) => write!(f, "open {door}"),
            Request::Grasp(grasp) => write!(f, "take what stands at {}", grasp.object),
            Request::Place(placing) => write!(f, "put down what it holds at {}", placing.foot),
            Request::Hand => write!(f, "say what the hand feels"),
        }
    }
}

/// What the body answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// To [`Request::Pose`].
    Pose(PoseEstimate),
    /// To [`Request::DriveTo`].
    Driven(Driven),
    /// To [`Request::LookAt`].
    Looked(Looked),
    /// To [`Request::Sense`].
    Sensed(Exposure),
    /// To [`Request::Scan`].
    Scanned(Scanned),
    /// To [`Request::PushAside`].
    Pushed(Pushed),
    /// To [`Request::OpenDoor`].
    Opened(Opened),
    /// To [`Request::Grasp`].
    Grasped(Grasped),
    /// To [`Request::Place`].
    Placed(Placed),
    /// To [`Request::Hand`].
    Hand(Hand),
    /// It could not be done.
    Failed(Failure),
}

/// A frame without its pixels, which are kept apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// See [`Sensed::stamp_ns`].
    pub stamp_ns: Stamp,
    /// See [`Sensed::intrinsics`].
    pub intrinsics: Intrinsics,
    /// See [`Sensed::transforms`].
    pub transforms: Vec<StampedTransform>,
    /// See [`Sensed::map_from_camera`].
    pub map_from_camera: Isometry3<f64>,
    /// See [`Sensed::pose_sigma_m`].
    pub pose_sigma_m: f64,
    /// See [`Sensed::pose_sigma_rad`].
    pub pose_sigma_rad: f64,
}

impl Answer {
    /// The same on a clock that is so much ahead.
    pub(super) fn later(mut self, by_ns: Stamp) -> Self {
        match &mut self {
            Answer::Pose(pose) => pose.stamp_ns += by_ns,
            Answer::Sensed(exposure) => {
                exposure.stamp_ns += by_ns;
                exposure.transforms.iter_mut().for_each(|t| t.stamp_ns += by_ns);
            }
            Answer::Scanned(scanned) => {
                scanned.stamp_ns += by_ns;
                scanned.transforms.iter_mut().for_each(|t| t.stamp_ns += by_ns);
            }
            Answer::Failed(Failure::SensorDropped { stamp_ns, .. }) => *stamp_ns += by_ns,
            _ => {}
        }
        self
    }

    /// Where the base is, if it says.
    pub(super) fn place(&self) -> Option<&Isometry3<f64>> {
        match self {
            Answer::Pose(pose) => Some(&pose.map_from_base),
            Answer::Driven(driven) => Some(&driven.map_from_base),
            _ => None,
        }
    }
}

impl Exposure {
    /// All of a frame but its pixels.
    pub fn of(sensed: &Sensed) -> Self {
        Exposure {
            stamp_ns: sensed.stamp_ns,
            intrinsics: sensed.intrinsics,
            transforms: sensed.transforms.clone(),
            map_from_camera: sensed.map_from_camera,
            pose_sigma_m: sensed.pose_sigma_m,
            pose_sigma_rad: sensed.pose_sigma_rad,
        }
    }

    /// The frame with its pixels.
    pub fn with(self, pixels: Pixels) -> Sensed {
        Sensed {
            stamp_ns: self.stamp_ns,
            depth_m: pixels.cloud.points.iter().map(|p| p.z).collect(),
            cloud: pixels.cloud,
            colour: pixels.colour,
            intrinsics: self.intrinsics,
            transforms: self.transforms,
            map_from_camera: self.map_from_camera,
            pose_sigma_m: self.pose_sigma_m,
            pose_sigma_rad: self.pose_sigma_rad,
        }
    }
}

/// What the camera measured in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Organised, in the optical frame, metres; NaN is "no return".
    pub cloud: Cloud,
    /// If the camera has colour.
    pub colour: Option<Colour>,
}

/// Something that was only asked: nothing moved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Question {
    /// [`Robot::travel`].
    Travel {
        /// From here.
        from: Place,
        /// To each of these.
        to: Vec<Place>,
        /// Doors that count as shut.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        shut: Vec<String>,
    },
    /// [`Robot::camera_at`].
    CameraAt {
        /// Where the base would stand.
        place: Place,
        /// What the head would look at.
        look_at: Option<Point3<f64>>,
    },
}

/// What the body said to a question.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reply {
    /// To [`Question::Travel`].
    Travel(Vec<Result<Travel, Failure>>),
    /// To [`Question::CameraAt`].
    CameraAt(Result<Isometry3<f64>, Failure>),
}

/// A request with its answer, and what was asked since the request before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// What was asked of the map before, as far as it was news.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub replies: Vec<(Question, Reply)>,
    /// The request and its answer; none at the end of a run.
    pub done: Option<(Request, Answer)>,
    /// The body's clock when it had answered.
    pub now_ns: Stamp,
}

/// Where a body's answers are kept.
pub trait Tape: Send + Sync {
    /// Keeps an entry: when this returns it is safe.
    ///
    /// # Errors
    /// Why it cannot be kept.
    fn keep(&self, entry: &Entry) -> Result<(), String>;

    /// The pixels of a frame that was kept.
    ///
    /// # Errors
    /// Why they cannot be had.
    fn pixels(&self, stamp_ns: Stamp) -> Result<Pixels, String>;
}
