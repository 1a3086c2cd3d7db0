//! Robot trait: pose, drives, looks, grasps, and their predicted cost. The parts of a body are in
//! [`parts`](crate::parts).
//!
//! Frames: `map` (the room; z up where [`Description::up`] says so), `base` (x forward), `camera` (optical: x right, y down, z forward).

mod place;

use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::parts::{Description, Part};
use descry_perception::laser::Scan;
use descry_perception::{Cloud, Intrinsics, View};
use image::RgbImage;
use nalgebra::{Isometry3, Point2, Point3, Vector2};
pub use place::{Place, Pose2, Station};
use serde::{Deserialize, Serialize};
pub use tokio_util::sync::CancellationToken;

/// Nanoseconds on the body's clock.
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

/// A door in the map; its state is only known on the spot.
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
    /// Rooms on either side.
    pub between: [String; 2],
}

/// Stated pose of the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseEstimate {
    /// Time stamp.
    pub stamp_ns: Stamp,
    /// Stated pose of the base.
    pub map_from_base: Isometry3<f64>,
    /// Standard deviation along each axis, metres.
    pub sigma_m: f64,
    /// Standard deviation about each axis, radians.
    pub sigma_rad: f64,
    /// Name of the current station, if the body has stations.
    pub station: Option<String>,
}

impl PoseEstimate {
    /// The estimate as a place to drive from or to.
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
    /// Σ max(ds/v, dθ/ω) along the route, seconds.
    pub duration_s: f64,
}

/// A drive that arrived.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Driven {
    /// Distance by odometry, metres.
    pub distance_m: f64,
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
    /// Stated pose of the base after the drive.
    pub map_from_base: Isometry3<f64>,
}

/// A completed turn of the head.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Looked {
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
    /// Angle between the line of sight and the requested point, radians; positive where the head's limits
    /// ended the turn.
    pub miss_rad: f64,
}

/// Transform between two frames at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StampedTransform {
    /// Time stamp.
    pub stamp_ns: Stamp,
    /// Frame that `parent_from_child` maps to.
    pub parent: String,
    /// Frame that `parent_from_child` maps from.
    pub child: String,
    /// The transform.
    pub parent_from_child: Isometry3<f64>,
}

/// A colour image.
#[derive(Clone, Debug, PartialEq)]
pub struct Colour {
    /// The pixels.
    pub image: RgbImage,
    /// True if the colour pixels coincide with those of the depth image.
    pub registered: bool,
}

/// A camera frame with its transforms.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensed {
    /// Time stamp.
    pub stamp_ns: Stamp,
    /// Organised, in the optical frame, metres; NaN is "no return".
    pub cloud: Cloud,
    /// Depth along z, metres, row by row; NaN is "no return".
    pub depth_m: Vec<f32>,
    /// Colour image, if the camera has colour.
    pub colour: Option<Colour>,
    /// The camera.
    pub intrinsics: Intrinsics,
    /// The chain map -> base -> camera at that time, as estimated by the body.
    pub transforms: Vec<StampedTransform>,
    /// Product of the chain.
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

/// A laser sweep with its transforms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scanned {
    /// Time stamp.
    pub stamp_ns: Stamp,
    /// The readings, with the estimated pose of the laser.
    pub scan: Scan,
    /// The chain map -> base -> laser at that time, as estimated by the body.
    pub transforms: Vec<StampedTransform>,
    /// Standard deviation of the laser position along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of the laser orientation about each axis, radians.
    pub pose_sigma_rad: f64,
}

/// Reading of a custom sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Time stamp.
    pub stamp_ns: Stamp,
    /// Any JSON value; [`Sense::about`](crate::Sense::about) describes it.
    pub said: serde_json::Value,
}

/// A push against one object, which uncovers what is behind it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Push {
    /// Centre of the object, map frame, metres.
    pub object: Point3<f64>,
    /// Direction in the map frame, of any length.
    pub direction: Vector2<f64>,
    /// Length of the push, metres.
    pub distance_m: f64,
}

/// A completed push.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pushed {
    /// Distance that the hand moved in contact with the object, metres.
    pub moved_m: f64,
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
}

/// A grasp of one free-standing object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grasp {
    /// Centre of the object's body, map frame, metres.
    pub object: Point3<f64>,
    /// Required opening of the hand, metres.
    pub width_m: f64,
}

/// A completed grasp, with the object lifted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grasped {
    /// Opening of the hand around the object, metres.
    pub width_m: f64,
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
}

/// A placement of the held object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placing {
    /// Position of the object's base, map frame, metres.
    pub foot: Point3<f64>,
}

/// A completed placement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placed {
    /// Duration on the body's clock, seconds.
    pub duration_s: f64,
}

/// State of the hand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hand {
    /// True if the hand holds something.
    pub holds: bool,
}

/// A completed opening of a door.
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

/// Supervision of a long request: cancellation, time limit, progress reports.
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

/// A body: simulated, recorded or real. Every implementation must pass `conformance::check`.
///
/// Requests that take time are `async`, can be cancelled and have a limit; queries are neither. After a
/// failure the body stands still and accepts further requests, unless it reported [`Failure::Broken`].
#[async_trait::async_trait]
pub trait Robot: Send + Sync {
    /// Parts and abilities of the body.
    fn description(&self) -> &Description;

    /// The body's clock. Simulated and recorded time advances by driving, looking and sensing, not by waiting.
    fn now_ns(&self) -> Stamp;

    /// The map of the room; `None` for a body without a map, such as a recording.
    fn map(&self) -> Option<&OccupancyGrid>;

    /// True for a simulation or a recording in this process: reopened, it starts in the same state and
    /// answers the same requests identically. Any other body stays where it is, and no request is repeated.
    fn begins_again(&self) -> bool {
        false
    }

    /// Surfaces in the map.
    fn surfaces(&self) -> &[SurfaceHint];

    /// The only poses where the body can stand; `None` if it can stand anywhere.
    fn stations(&self) -> Option<&[Station]>;

    /// Rooms in the map.
    fn rooms(&self) -> &[Room] {
        &[]
    }

    /// Doors in the map.
    fn doors(&self) -> &[Door] {
        &[]
    }

    /// Predicts the drives from one place to each of the others on the map, without moving. All doors count
    /// as open except those named in `shut`.
    ///
    /// # Errors
    /// Separately for each entry: [`Failure::Unreachable`] with the reason.
    fn travel(&self, from: &Place, to: &[Place], shut: &[String]) -> Vec<Result<Travel, Failure>>;

    /// Predicts the camera's pose (`map_from_camera`) with the base at `place` and the head turned
    /// towards `look_at` (straight ahead if `None`), within the head's limits. A body without a
    /// head looks in the direction of its base.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Description::camera`]; [`Failure::Unreachable`] for an unknown station, or a pose where only
    /// stations exist.
    fn camera_at(&self, place: &Place, look_at: Option<&Point3<f64>>) -> Result<Isometry3<f64>, Failure> {
        let _ = (place, look_at);
        Err(self.description().lacks(Part::Camera))
    }

    /// Stated pose of the base.
    ///
    /// # Errors
    /// [`Failure::Lost`], [`Failure::Broken`].
    async fn pose(&self) -> Result<PoseEstimate, Failure>;

    /// Drives to a place along a route on the map. A body without [`Description::base`] cannot move: any
    /// other place is unreachable.
    ///
    /// # Errors
    /// [`Failure::Unreachable`], [`Failure::Blocked`], [`Failure::TimedOut`], [`Failure::Cancelled`],
    /// [`Failure::Lost`], [`Failure::Broken`].
    async fn drive_to(&self, to: &Place, watch: &Watch<'_>) -> Result<Driven, Failure>;

    /// Turns the head towards a point in the map, as far as its limits allow. A body without a head
    /// reports the angle by which it misses.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Description::camera`]; [`Failure::Unreachable`] if a coordinate is no number;
    /// [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn look_at(&self, point: &Point3<f64>, watch: &Watch<'_>) -> Result<Looked, Failure> {
        let _ = (point, watch);
        Err(self.description().lacks(Part::Camera))
    }

    /// Takes one frame.
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

    /// Reads one of [`Description::senses`] by name.
    ///
    /// # Errors
    /// [`Failure::Unable`] if there is none of that name; [`Failure::SensorDropped`], [`Failure::TimedOut`],
    /// [`Failure::Cancelled`], [`Failure::Broken`].
    async fn read(&self, sense: &str, watch: &Watch<'_>) -> Result<Reading, Failure> {
        let _ = watch;
        Err(self.description().lacks_sense(sense))
    }

    /// Pushes an object aside.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Description::arm`]; [`Failure::Unreachable`] if it is out of the arm's reach;
    /// [`Failure::Slipped`], [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn push_aside(&self, push: &Push, watch: &Watch<'_>) -> Result<Pushed, Failure> {
        let _ = (push, watch);
        Err(self.description().lacks(Part::Arm))
    }

    /// Opens a nearby door from the current pose of the base.
    ///
    /// # Errors
    /// [`Failure::Unable`] if it cannot open doors; [`Failure::Unreachable`] if no door of that name is in reach;
    /// [`Failure::Slipped`], [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn open_door(&self, door: &str, watch: &Watch<'_>) -> Result<Opened, Failure> {
        let _ = (door, watch);
        Err(Failure::Unable { because: format!("{} does not open doors", self.description().name) })
    }

    /// Grasps an object and lifts it.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Arm::hand`](crate::Arm::hand), if the hand is full, or if the object is too wide;
    /// [`Failure::Unreachable`] if it is out of reach; [`Failure::Slipped`] if the hand closes on nothing or loses it;
    /// [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn grasp(&self, grasp: &Grasp, watch: &Watch<'_>) -> Result<Grasped, Failure> {
        let _ = (grasp, watch);
        Err(self.description().lacks(Part::Hand))
    }

    /// Puts down the held object.
    ///
    /// # Errors
    /// [`Failure::Unable`] if the hand is empty; [`Failure::Unreachable`] if the place is out of reach; [`Failure::Blocked`] if
    /// something stands there; [`Failure::Slipped`], [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn place(&self, placing: &Placing, watch: &Watch<'_>) -> Result<Placed, Failure> {
        let _ = (placing, watch);
        Err(self.description().lacks(Part::Hand))
    }

    /// Current state of the hand.
    ///
    /// # Errors
    /// [`Failure::Unable`] without a hand; [`Failure::Broken`].
    async fn hand(&self) -> Result<Hand, Failure> {
        Err(self.description().lacks(Part::Hand))
    }
}
