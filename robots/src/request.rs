//! Requests and answers as values, for tapes, programs and conformance.

use crate::body::{
    Colour, Driven, Grasp, Grasped, Hand, Looked, Opened, Place, Placed, Placing, PoseEstimate, Push, Pushed,
    Reading, Robot, Scanned, Sensed, Stamp, StampedTransform, Watch,
};
use crate::failure::Failure;
use crate::parts::Part;
use descry_perception::{Cloud, Intrinsics};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

/// A request to a body.
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
    /// [`Robot::read`].
    Read(String),
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

impl Request {
    /// Name of the request in the protocol of programs.
    pub fn name(&self) -> &'static str {
        match self {
            Request::Pose => "pose",
            Request::DriveTo(_) => "drive_to",
            Request::LookAt(_) => "look_at",
            Request::Sense => "sense",
            Request::Scan => "scan",
            Request::Read(_) => "read",
            Request::PushAside(_) => "push_aside",
            Request::OpenDoor(_) => "open_door",
            Request::Grasp(_) => "grasp",
            Request::Place(_) => "place",
            Request::Hand => "hand",
        }
    }

    /// The optional part that the request needs, if any. (A drive to the current place needs no base, a door
    /// may open itself, and custom sensors are checked by name.)
    pub fn needs(&self) -> Option<Part> {
        match self {
            Request::Pose | Request::DriveTo(_) | Request::Read(_) | Request::OpenDoor(_) => None,
            Request::LookAt(_) | Request::Sense => Some(Part::Camera),
            Request::Scan => Some(Part::Laser),
            Request::PushAside(_) => Some(Part::Arm),
            Request::Grasp(_) | Request::Place(_) | Request::Hand => Some(Part::Hand),
        }
    }

    /// Sends the request to a body. The pixels of a frame are returned separately.
    pub async fn ask(&self, body: &dyn Robot, watch: &Watch<'_>) -> (Answer, Option<Sensed>) {
        let answer = match self {
            Request::Pose => body.pose().await.map(Answer::Pose),
            Request::DriveTo(place) => body.drive_to(place, watch).await.map(Answer::Driven),
            Request::LookAt(point) => body.look_at(point, watch).await.map(Answer::Looked),
            Request::Scan => body.scan(watch).await.map(Answer::Scanned),
            Request::Read(sense) => body.read(sense, watch).await.map(Answer::Read),
            Request::PushAside(push) => body.push_aside(push, watch).await.map(Answer::Pushed),
            Request::OpenDoor(door) => body.open_door(door, watch).await.map(Answer::Opened),
            Request::Grasp(grasp) => body.grasp(grasp, watch).await.map(Answer::Grasped),
            Request::Place(placing) => body.place(placing, watch).await.map(Answer::Placed),
            Request::Hand => body.hand().await.map(Answer::Hand),
            Request::Sense => match body.sense(watch).await {
                Ok(sensed) => return (Answer::Sensed(Exposure::of(&sensed)), Some(sensed)),
                Err(failure) => Err(failure),
            },
        };
        (answer.unwrap_or_else(Answer::Failed), None)
    }
}

impl std::fmt::Display for Request {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Request::Pose => write!(f, "say where it is"),
            Request::DriveTo(place) => write!(f, "drive to {place}"),
            Request::LookAt(p) => write!(f, "look at ({:.3}, {:.3}, {:.3})", p.x, p.y, p.z),
            Request::Sense => write!(f, "take a frame"),
            Request::Scan => write!(f, "sweep its laser"),
            Request::Read(sense) => write!(f, "read its {sense}"),
            Request::PushAside(push) => write!(f, "push what stands at {}", push.object),
            Request::OpenDoor(door) => write!(f, "open {door}"),
            Request::Grasp(grasp) => write!(f, "take what stands at {}", grasp.object),
            Request::Place(placing) => write!(f, "put down what it holds at {}", placing.foot),
            Request::Hand => write!(f, "say what the hand feels"),
        }
    }
}

/// Answer of the body.
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
    /// To [`Request::Read`].
    Read(Reading),
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
    /// The request failed.
    Failed(Failure),
}

/// A frame without its pixels, which are stored separately.
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
    /// Shifts the time stamps of the answer by `by_ns`.
    pub(crate) fn later(mut self, by_ns: Stamp) -> Self {
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
            Answer::Read(reading) => reading.stamp_ns += by_ns,
            Answer::Failed(Failure::SensorDropped { stamp_ns, .. }) => *stamp_ns += by_ns,
            _ => {}
        }
        self
    }

    /// Stated pose of the base, if the answer has one.
    pub(crate) fn place(&self) -> Option<&Isometry3<f64>> {
        match self {
            Answer::Pose(pose) => Some(&pose.map_from_base),
            Answer::Driven(driven) => Some(&driven.map_from_base),
            _ => None,
        }
    }
}

impl Exposure {
    /// Takes everything but the pixels from a frame.
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

    /// Completes the frame with its pixels.
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

/// Measurements of the camera in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Organised, in the optical frame, metres; NaN is "no return".
    pub cloud: Cloud,
    /// Colour image, if the camera has colour.
    pub colour: Option<Colour>,
}
