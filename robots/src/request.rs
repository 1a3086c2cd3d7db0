//! Requests to a body and its answers as values, for recording, replay, robot programs and conformance tests.

use crate::body::{
    Colour, Driven, Grasp, Grasped, Hand, Looked, Opened, Place, Placed, Placing, PoseEstimate, Poured,
    Pouring, Push, Pushed, Reading, Robot, Scanned, Sensed, Stamp, StampedTransform, Watch,
};
use crate::failure::Failure;
use crate::parts::{Description, Part};
use descry_perception::{Cloud, Intrinsics};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

/// A request to a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Request {
    /// Estimate the pose: [`Robot::pose`].
    Pose,
    /// Drive to a place: [`Robot::drive_to`].
    DriveTo(Place),
    /// Turn the head towards a point in the map, metres: [`Robot::look_at`].
    LookAt(Point3<f64>),
    /// Take a frame with the camera: [`Robot::sense`].
    Sense,
    /// Take a laser sweep: [`Robot::scan`].
    Scan,
    /// Read the custom sensor of this name: [`Robot::read`].
    Read(String),
    /// Push an object aside: [`Robot::push_aside`].
    PushAside(Push),
    /// Open the door of this name: [`Robot::open_door`].
    OpenDoor(String),
    /// Grasp an object: [`Robot::grasp`].
    Grasp(Grasp),
    /// Put down the held object: [`Robot::place`].
    Place(Placing),
    /// Pour what the held vessel holds into another one: [`Robot::manipulate`].
    Pour(Pouring),
    /// Report the state of the hand: [`Robot::hand`].
    Hand,
    /// Stand still for a time, seconds: [`Robot::wait`].
    Wait(f64),
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
            Request::Pour(_) => "pour",
            Request::Hand => "hand",
            Request::Wait(_) => "wait",
        }
    }

    /// Part without which the request fails; `None` if it depends on the case. (A drive to the current place
    /// needs no base, a door may open itself, and custom sensors are checked by name.)
    pub fn needs(&self) -> Option<Part> {
        match self {
            Request::Pose
            | Request::DriveTo(_)
            | Request::Read(_)
            | Request::OpenDoor(_)
            | Request::Wait(_) => None,
            Request::LookAt(_) | Request::Sense => Some(Part::Camera),
            Request::Scan => Some(Part::Laser),
            Request::PushAside(_) => Some(Part::Arm),
            Request::Grasp(_) | Request::Place(_) | Request::Pour(_) | Request::Hand => Some(Part::Hand),
        }
    }

    /// Point in the map that the arm is to reach, if the request has one.
    pub fn target(&self) -> Option<&Point3<f64>> {
        match self {
            Request::PushAside(push) => Some(&push.object),
            Request::Grasp(grasp) => Some(&grasp.object),
            Request::Place(placing) => Some(&placing.foot),
            Request::Pour(pouring) => Some(&pouring.over),
            _ => None,
        }
    }

    /// Failure of the request for a body that cannot carry it out.
    pub fn beyond(&self, body: &Description) -> Failure {
        let because = || format!("{} cannot {self}", body.name);
        let lacks = self.needs().filter(|part| !body.has(*part)).map(|part| body.lacks(part));
        lacks.unwrap_or_else(|| Failure::Unable { because: because() })
    }

    /// Sends the request to a body; returns the answer, and for a camera frame also the frame with its
    /// pixels.
    pub async fn ask(&self, body: &dyn Robot, watch: &Watch<'_>) -> (Answer, Option<Sensed>) {
        let answer = match self {
            Request::Pose => body.pose().await.map(Answer::Pose),
            Request::DriveTo(place) => body.drive_to(place, watch).await.map(Answer::Driven),
            Request::LookAt(point) => body.look_at(point, watch).await.map(Answer::Looked),
            Request::Scan => body.scan(watch).await.map(Answer::Scanned),
            Request::Read(sense) => body.read(sense, watch).await.map(Answer::Read),
            Request::PushAside(_)
            | Request::OpenDoor(_)
            | Request::Grasp(_)
            | Request::Place(_)
            | Request::Pour(_) => body.manipulate(self, watch).await,
            Request::Hand => body.hand().await.map(Answer::Hand),
            Request::Wait(seconds) => body.wait(*seconds, watch).await.map(|()| Answer::Waited),
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
            Request::Pour(pouring) => write!(f, "pour what it holds out at {}", pouring.over),
            Request::Hand => write!(f, "say what the hand feels"),
            Request::Wait(seconds) => write!(f, "wait {seconds:.1} s"),
        }
    }
}

/// Answer of a body to a [`Request`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// Estimated pose, for [`Request::Pose`].
    Pose(PoseEstimate),
    /// Completed drive, for [`Request::DriveTo`].
    Driven(Driven),
    /// Completed turn of the head, for [`Request::LookAt`].
    Looked(Looked),
    /// Camera frame without its pixels, for [`Request::Sense`].
    Sensed(Exposure),
    /// Laser sweep, for [`Request::Scan`].
    Scanned(Scanned),
    /// Reading of a custom sensor, for [`Request::Read`].
    Read(Reading),
    /// Completed push, for [`Request::PushAside`].
    Pushed(Pushed),
    /// Completed opening of a door, for [`Request::OpenDoor`].
    Opened(Opened),
    /// Completed grasp, for [`Request::Grasp`].
    Grasped(Grasped),
    /// Completed placement, for [`Request::Place`].
    Placed(Placed),
    /// Completed pour, for [`Request::Pour`].
    Poured(Poured),
    /// State of the hand, for [`Request::Hand`].
    Hand(Hand),
    /// End of a time of standing still, for [`Request::Wait`].
    Waited,
    /// Failure of any request.
    Failed(Failure),
}

/// A camera frame without its pixels, which are stored separately.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Time stamp, as [`Sensed::stamp_ns`], nanoseconds.
    pub stamp_ns: Stamp,
    /// Intrinsics of the camera, as [`Sensed::intrinsics`].
    pub intrinsics: Intrinsics,
    /// Transforms of the chain map -> base -> camera, as [`Sensed::transforms`].
    pub transforms: Vec<StampedTransform>,
    /// Pose of the camera in the map, as [`Sensed::map_from_camera`].
    pub map_from_camera: Isometry3<f64>,
    /// Standard deviation of the camera position, metres, as [`Sensed::pose_sigma_m`].
    pub pose_sigma_m: f64,
    /// Standard deviation of the camera orientation, radians, as [`Sensed::pose_sigma_rad`].
    pub pose_sigma_rad: f64,
}

impl Answer {
    /// Failure for an answer of an unexpected kind: the one that it holds, else [`Failure::Broken`].
    pub(crate) fn strange(self) -> Failure {
        match self {
            Answer::Failed(failure) => failure,
            other => Failure::Broken { because: format!("the answer to another request: {other:?}") },
        }
    }

    /// Shifts the time stamps of the answer by `by_ns` nanoseconds.
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

    /// Estimated pose of the base in the map, if the answer has one.
    pub(crate) fn place(&self) -> Option<&Isometry3<f64>> {
        match self {
            Answer::Pose(pose) => Some(&pose.map_from_base),
            Answer::Driven(driven) => Some(&driven.map_from_base),
            _ => None,
        }
    }
}

impl Exposure {
    /// Copies everything but the pixels from a frame.
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

    /// Joins the frame with its pixels.
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

/// Pixels of a camera frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Point of each pixel, row by row, optical frame, metres; NaN where the camera got no return.
    pub cloud: Cloud,
    /// Colour image, if the camera has colour.
    pub colour: Option<Colour>,
}
