//! The [`Robot`] trait (pose, drives, turns of the head, frames, grasps and their predicted cost), and the
//! types of its requests and answers. The parts of a body are in [`parts`](crate::parts).
//!
//! Frames: `map` (the room; z up where [`Description::up`] says so), `base` (x forward), `camera` (optical: x
//! right, y down, z forward).

mod place;

use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::parts::{Description, Part};
use crate::request::{Answer, Request};
use descry_perception::laser::Scan;
use descry_perception::{Cloud, Intrinsics, View};
use image::RgbImage;
use nalgebra::{Isometry3, Point2, Point3, Vector2};
pub use place::{Place, Pose2, Station};
use serde::{Deserialize, Serialize};
pub use tokio_util::sync::CancellationToken;

/// Time stamp, nanoseconds on the body's clock.
pub type Stamp = i64;

/// A support surface in the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceHint {
    /// Name for people: `table`.
    pub name: String,
    /// Outline in the map, corners in order, metres.
    pub outline_m: Vec<Point2<f64>>,
    /// Approximate height above the floor, metres.
    pub height_m: f64,
    /// Room of the surface, if the map has rooms.
    #[serde(default)]
    pub room: Option<String>,
}

/// A room in the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Room {
    /// Name for people: `kitchen`.
    pub name: String,
    /// Outline of the room's floor in the map, corners in order, metres.
    pub outline_m: Vec<Point2<f64>>,
}

/// A door in the map, which does not say whether the door is open or shut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Door {
    /// Name for people: `kitchen door`.
    pub name: String,
    /// Centre of the opening, map frame, metres.
    pub centre_m: Point2<f64>,
    /// Direction of the wall, counter-clockwise from the map's x, radians.
    pub along_rad: f64,
    /// Width of the opening, metres.
    pub width_m: f64,
    /// Names of the rooms on either side of the door.
    pub between: [String; 2],
}

/// Pose of the body as estimated by its localisation, with the uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseEstimate {
    /// Time stamp, nanoseconds.
    pub stamp_ns: Stamp,
    /// Estimated pose of the base in the map.
    pub map_from_base: Isometry3<f64>,
    /// Standard deviation of the position along each axis, metres.
    pub sigma_m: f64,
    /// Standard deviation of the orientation about each axis, radians.
    pub sigma_rad: f64,
    /// Name of the current station, if the body has stations.
    pub station: Option<String>,
}

impl PoseEstimate {
    /// Returns the place where the body is: its current station, or else the estimated pose projected onto
    /// the floor.
    pub fn place(&self) -> Place {
        match &self.station {
            Some(name) => Place::Station(name.clone()),
            None => Place::Pose(Pose2::from_isometry(&self.map_from_base)),
        }
    }
}

/// Predicted cost of a drive on the map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Travel {
    /// Length of the route, metres.
    pub distance_m: f64,
    /// Duration of the drive, seconds: Σ max(ds/v, dθ/ω) along the route.
    pub duration_s: f64,
}

/// Result of a completed drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Driven {
    /// Distance by odometry, metres.
    pub distance_m: f64,
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
    /// Estimated pose of the base after the drive, in the map.
    pub map_from_base: Isometry3<f64>,
}

/// Result of a completed turn of the head.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Looked {
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
    /// Angle between the camera's axis and the requested point, radians; above zero where the head's limits
    /// ended the turn.
    pub miss_rad: f64,
}

/// Transform between two frames at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StampedTransform {
    /// Time stamp, nanoseconds.
    pub stamp_ns: Stamp,
    /// Frame that `parent_from_child` maps to.
    pub parent: String,
    /// Frame that `parent_from_child` maps from.
    pub child: String,
    /// Transform from the child frame to the parent frame.
    pub parent_from_child: Isometry3<f64>,
}

/// A colour image.
#[derive(Clone, Debug, PartialEq)]
pub struct Colour {
    /// The pixels.
    pub image: RgbImage,
    /// True if each colour pixel shows the same point as the depth pixel of the same column and row.
    pub registered: bool,
}

/// One frame of the camera: depth, perhaps colour, and the transforms at its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensed {
    /// Time stamp, nanoseconds.
    pub stamp_ns: Stamp,
    /// Point of each pixel, row by row, optical frame, metres; NaN where the camera got no return.
    pub cloud: Cloud,
    /// Depth of each pixel along the optical axis, row by row, metres; NaN where the camera got no return.
    pub depth_m: Vec<f32>,
    /// Colour image, if the camera has colour.
    pub colour: Option<Colour>,
    /// Intrinsics of the camera.
    pub intrinsics: Intrinsics,
    /// Transforms of the chain map -> base -> camera at the frame's time, as estimated by the body.
    pub transforms: Vec<StampedTransform>,
    /// Pose of the camera in the map: the product of `transforms`.
    pub map_from_camera: Isometry3<f64>,
    /// Standard deviation of the camera position along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of the camera orientation about each axis, radians.
    pub pose_sigma_rad: f64,
}

impl Sensed {
    /// Converts the frame to a view for perception.
    pub fn view(&self) -> View {
        View {
            stamp_ns: self.stamp_ns,
            cloud: self.cloud.clone(),
            intrinsics: Some(self.intrinsics),
            world_from_camera: self.map_from_camera,
            pose_sigma_m: self.pose_sigma_m,
            pose_sigma_rad: self.pose_sigma_rad,
        }
    }
}

/// A laser sweep with the transforms at its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scanned {
    /// Time stamp, nanoseconds.
    pub stamp_ns: Stamp,
    /// The readings, with the estimated pose of the laser.
    pub scan: Scan,
    /// Transforms of the chain map -> base -> laser at the time of the sweep, as estimated by the body.
    pub transforms: Vec<StampedTransform>,
    /// Standard deviation of the laser position along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of the laser orientation about each axis, radians.
    pub pose_sigma_rad: f64,
}

/// A reading of a custom sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Time stamp, nanoseconds.
    pub stamp_ns: Stamp,
    /// Measured value, any JSON; [`Sense::about`](crate::Sense::about) says what it means.
    pub said: serde_json::Value,
}

/// Request to push one object aside, so that the camera can see what is behind the object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Push {
    /// Centre of the object, map frame, metres.
    pub object: Point3<f64>,
    /// Direction of the push in the map's x-y plane, a vector of any length above zero.
    pub direction: Vector2<f64>,
    /// Length of the push, metres.
    pub distance_m: f64,
}

impl Push {
    /// True if the direction and the length are those of a push.
    pub(crate) fn is_definite(&self) -> bool {
        let length = self.direction.norm();
        length > 0.0 && length.is_finite() && self.distance_m.is_finite() && self.distance_m > 0.0
    }
}

/// Result of a completed push.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pushed {
    /// Distance that the hand moved in contact with the object, metres.
    pub moved_m: f64,
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
}

/// Request to grasp one free-standing object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grasp {
    /// Centre of the object's body, map frame, metres.
    pub object: Point3<f64>,
    /// Opening of the hand that the object requires, metres.
    pub width_m: f64,
}

/// Result of a completed grasp: the object is lifted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grasped {
    /// Opening of the hand around the object, metres.
    pub width_m: f64,
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
}

/// Request to put down the held object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placing {
    /// Target position of the centre of the object's base, map frame, metres.
    pub foot: Point3<f64>,
}

/// Result of a completed placement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placed {
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
}

/// Request to pour out all that the held vessel holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pouring {
    /// Centre of the rim of the vessel to pour into, map frame, metres.
    pub over: Point3<f64>,
}

/// Result of a completed pour: the held vessel is empty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Poured {
    /// Volume that went over, litres; 0 if the held vessel was empty.
    pub litres: f64,
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
}

/// State of the hand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hand {
    /// True if the hand holds something.
    pub holds: bool,
}

/// Result of a completed opening of a door.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Opened {
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
}

/// Progress of a long request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Time on the body's clock since the start, seconds.
    pub elapsed_s: f64,
    /// Completed fraction, 0 to 1.
    pub fraction: f64,
    /// Distance driven so far, metres.
    pub distance_m: f64,
}

/// Supervision of a long request: cancellation, time limit, receiver of progress reports.
#[derive(Clone)]
pub struct Watch<'a> {
    /// Cancels the request as soon as possible, with [`Failure::Cancelled`].
    pub cancel: CancellationToken,
    /// Time limit, seconds on the body's clock; exceeding it ends with [`Failure::TimedOut`].
    pub time_limit_s: f64,
    /// Receives occasional progress reports.
    pub progress: &'a (dyn Fn(&Progress) + Send + Sync),
}

fn nobody_listens(_: &Progress) {}

impl Default for Watch<'_> {
    /// No cancellation, a limit of five minutes, no reports.
    fn default() -> Self {
        Watch { cancel: CancellationToken::new(), time_limit_s: 300.0, progress: &nobody_listens }
    }
}

/// A robot body: simulated, recorded or real. Every implementation must pass `conformance::check`.
///
/// Only requests that take time are `async`; they can be cancelled and have a time limit. After a failure the
/// body stands still and accepts further requests, unless it reported [`Failure::Broken`].
#[async_trait::async_trait]
pub trait Robot: Send + Sync {
    /// Parts and abilities of the body.
    fn description(&self) -> &Description;

    /// Time on the body's clock. Simulated and recorded time advances by driving, looking, sensing and
    /// [waiting](Robot::wait) alone.
    fn now_ns(&self) -> Stamp;

    /// Occupancy grid of the floor; `None` for a body without a map, such as a recording.
    fn map(&self) -> Option<&OccupancyGrid>;

    /// True if the body, opened again, starts in the same state and answers the same requests identically, as
    /// a simulation or a recording in this process does. False if it stays where it is; its requests are
    /// never repeated.
    fn begins_again(&self) -> bool {
        false
    }

    /// Surfaces in the map.
    fn surfaces(&self) -> &[SurfaceHint];

    /// Stations, the only poses where the body can stand; `None` if it can stand anywhere.
    fn stations(&self) -> Option<&[Station]>;

    /// Rooms in the map.
    fn rooms(&self) -> &[Room] {
        &[]
    }

    /// Doors in the map.
    fn doors(&self) -> &[Door] {
        &[]
    }

    /// Predicts the cost of driving from one place to each of the others on the map, without moving. All
    /// doors count as open except those named in `shut`.
    ///
    /// # Errors
    /// For each destination on its own: [`Failure::Unreachable`] with the reason.
    fn travel(&self, from: &Place, to: &[Place], shut: &[String]) -> Vec<Result<Travel, Failure>>;

    /// Predicts the pose of the camera in the map with the base at `place` and the head turned towards
    /// `look_at` (straight ahead if `None`), within the head's limits. The camera of a body without a head
    /// turns with its base.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Description::camera`]; [`Failure::Unreachable`] for an unknown station, or a pose where only
    /// stations exist.
    fn camera_at(&self, place: &Place, look_at: Option<&Point3<f64>>) -> Result<Isometry3<f64>, Failure> {
        let _ = (place, look_at);
        Err(self.description().lacks(Part::Camera))
    }

    /// Returns the estimated pose of the base.
    ///
    /// # Errors
    /// [`Failure::Lost`], [`Failure::Broken`].
    async fn pose(&self) -> Result<PoseEstimate, Failure>;

    /// Drives to a place along a route on the map. For a body without [`Description::base`], every place but
    /// the current one is unreachable.
    ///
    /// # Errors
    /// [`Failure::Unreachable`], [`Failure::Blocked`], [`Failure::TimedOut`], [`Failure::Cancelled`],
    /// [`Failure::Lost`], [`Failure::Broken`].
    async fn drive_to(&self, to: &Place, watch: &Watch<'_>) -> Result<Driven, Failure>;

    /// Turns the head towards a point in the map, as far as its limits allow. A body without a head does not
    /// move and reports the angle between its camera's axis and the point.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Description::camera`]; [`Failure::Unreachable`] if a coordinate is no number;
    /// [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn look_at(&self, point: &Point3<f64>, watch: &Watch<'_>) -> Result<Looked, Failure> {
        let _ = (point, watch);
        Err(self.description().lacks(Part::Camera))
    }

    /// Takes one frame with the camera.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Description::camera`]; [`Failure::SensorDropped`], [`Failure::TimedOut`],
    /// [`Failure::Cancelled`], [`Failure::Lost`], [`Failure::Broken`].
    async fn sense(&self, watch: &Watch<'_>) -> Result<Sensed, Failure> {
        let _ = watch;
        Err(self.description().lacks(Part::Camera))
    }

    /// Takes one laser sweep.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Description::laser`]; [`Failure::SensorDropped`], [`Failure::TimedOut`],
    /// [`Failure::Cancelled`], [`Failure::Lost`], [`Failure::Broken`].
    async fn scan(&self, watch: &Watch<'_>) -> Result<Scanned, Failure> {
        let _ = watch;
        Err(self.description().lacks(Part::Laser))
    }

    /// Reads the custom sensor of this name, one of [`Description::senses`].
    ///
    /// # Errors
    /// [`Failure::Unable`] if there is no sensor of this name; [`Failure::SensorDropped`],
    /// [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn read(&self, sense: &str, watch: &Watch<'_>) -> Result<Reading, Failure> {
        let _ = watch;
        Err(self.description().lacks_sense(sense))
    }

    /// Carries out a request of the arm, such as [`Request::Grasp`].
    ///
    /// # Errors
    /// [`Failure::Unable`] if the body cannot do that, the hand is full or empty, or the object is too wide;
    /// [`Failure::Unreachable`] if the target is out of reach; [`Failure::Blocked`] if something stands there;
    /// [`Failure::Slipped`] if the hand closes on nothing or loses what it holds; [`Failure::TimedOut`],
    /// [`Failure::Cancelled`], [`Failure::Broken`].
    async fn manipulate(&self, request: &Request, watch: &Watch<'_>) -> Result<Answer, Failure> {
        let _ = watch;
        Err(request.beyond(self.description()))
    }

    /// Pushes an object aside.
    ///
    /// # Errors
    /// Those of [`Robot::manipulate`].
    async fn push_aside(&self, push: &Push, watch: &Watch<'_>) -> Result<Pushed, Failure> {
        match self.manipulate(&Request::PushAside(*push), watch).await? {
            Answer::Pushed(pushed) => Ok(pushed),
            other => Err(other.strange()),
        }
    }

    /// Opens a nearby door, by name.
    ///
    /// # Errors
    /// Those of [`Robot::manipulate`].
    async fn open_door(&self, door: &str, watch: &Watch<'_>) -> Result<Opened, Failure> {
        match self.manipulate(&Request::OpenDoor(door.into()), watch).await? {
            Answer::Opened(opened) => Ok(opened),
            other => Err(other.strange()),
        }
    }

    /// Grasps an object and lifts it.
    ///
    /// # Errors
    /// Those of [`Robot::manipulate`].
    async fn grasp(&self, grasp: &Grasp, watch: &Watch<'_>) -> Result<Grasped, Failure> {
        match self.manipulate(&Request::Grasp(*grasp), watch).await? {
            Answer::Grasped(grasped) => Ok(grasped),
            other => Err(other.strange()),
        }
    }

    /// Puts down the held object.
    ///
    /// # Errors
    /// Those of [`Robot::manipulate`].
    async fn place(&self, placing: &Placing, watch: &Watch<'_>) -> Result<Placed, Failure> {
        match self.manipulate(&Request::Place(*placing), watch).await? {
            Answer::Placed(placed) => Ok(placed),
            other => Err(other.strange()),
        }
    }

    /// Current state of the hand.
    ///
    /// # Errors
    /// [`Failure::Unable`] without a hand; [`Failure::Broken`].
    async fn hand(&self) -> Result<Hand, Failure> {
        Err(self.description().lacks(Part::Hand))
    }

    /// Stands still while something else takes `seconds`, where the clock advances by the body's own
    /// work alone; time that passes by itself needs no waiting.
    ///
    /// # Errors
    /// [`Failure::Cancelled`], [`Failure::Broken`].
    async fn wait(&self, seconds: f64, watch: &Watch<'_>) -> Result<(), Failure> {
        let _ = (seconds, watch);
        Ok(())
    }
}
