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

/// A surface that the map knows: things may stand on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceHint {
    /// As people call it: `table`.
    pub name: String,
    /// Outline in the map, corners in order, metres.
    pub outline_m: Vec<Point2<f64>>,
    /// Roughly, above the floor, metres.
    pub height_m: f64,
    /// The room that it is in, if the map knows rooms.
    #[serde(default)]
    pub room: Option<String>,
}

/// A room that the map knows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Room {
    /// As people call it: `kitchen`.
    pub name: String,
    /// Outline of its floor in the map, corners in order, metres.
    pub outline_m: Vec<Point2<f64>>,
}

/// A door that the map knows. Whether it is open, only being there tells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Door {
    /// As people call it: `kitchen door`.
    pub name: String,
    /// Middle of the opening, in the map, metres.
    pub centre_m: Point2<f64>,
    /// Along the wall, counter-clockwise from the map's x, radians.
    pub along_rad: f64,
    /// Width of the opening, metres.
    pub width_m: f64,
    /// The rooms on either side.
    pub between: [String; 2],
}

/// Stated pose of the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseEstimate {
    /// When.
    pub stamp_ns: Stamp,
    /// Stated pose of the base.
    pub map_from_base: Isometry3<f64>,
    /// Standard deviation along each axis, metres.
    pub sigma_m: f64,
    /// Standard deviation about each axis, radians.
    pub sigma_rad: f64,
    /// The station it stands at, if the body has stations.
    pub station: Option<String>,
}

impl PoseEstimate {
    /// The same as somewhere to go from or to.
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
    /// As odometry counted it, metres.
    pub distance_m: f64,
    /// On the body's clock, seconds.
    pub duration_s: f64,
    /// Stated pose of the base after the drive.
    pub map_from_base: Isometry3<f64>,
}

/// The head has turned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Looked {
    /// On the body's clock, seconds.
    pub duration_s: f64,
    /// Angle between the line of sight and the point asked for, radians; above zero where the head's limits ended the turn.
    pub miss_rad: f64,
}

/// One frame's place in another at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StampedTransform {
    /// When.
    pub stamp_ns: Stamp,
    /// The frame that `parent_from_child` takes points to.
    pub parent: String,
    /// The frame that it takes points from.
    pub child: String,
    /// The transform.
    pub parent_from_child: Isometry3<f64>,
}

/// A colour image.
#[derive(Clone, Debug, PartialEq)]
pub struct Colour {
    /// The pixels.
    pub image: RgbImage,
    /// True if its pixels are those of the depth image.
    pub registered: bool,
}

/// One frame of the camera with all that is needed to place it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensed {
    /// When.
    pub stamp_ns: Stamp,
    /// Organised, in the optical frame, metres; NaN is "no return".
    pub cloud: Cloud,
    /// Depth along z, metres, row by row; NaN is "no return".
    pub depth_m: Vec<f32>,
    /// If the camera has colour.
    pub colour: Option<Colour>,
    /// The camera.
    pub intrinsics: Intrinsics,
    /// The chain map -> base -> camera at that time, as the body believes it.
    pub transforms: Vec<StampedTransform>,
    /// The chain multiplied out.
    pub map_from_camera: Isometry3<f64>,
    /// Standard deviation of that position along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of that orientation about each axis, radians.
    pub pose_sigma_rad: f64,
}

impl Sensed {
    /// The frame as perception takes it.
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

/// One sweep of the laser with all that is needed to place it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scanned {
    /// When.
    pub stamp_ns: Stamp,
    /// The readings, and where the laser was as the body believes.
    pub scan: Scan,
    /// The chain map -> base -> laser at that time, as the body believes it.
    pub transforms: Vec<StampedTransform>,
    /// Standard deviation of that position along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of that orientation about each axis, radians.
    pub pose_sigma_rad: f64,
}

/// Reading of a sense.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// When.
    pub stamp_ns: Stamp,
    /// Anything that JSON can say, as [`Sense::about`](crate::Sense::about) tells.
    pub said: serde_json::Value,
}

/// A push against one object, so that what is behind it can be seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Push {
    /// Centre of the object, in the map, metres.
    pub object: Point3<f64>,
    /// Direction in the map; its length does not matter.
    pub direction: Vector2<f64>,
    /// Length of the push, metres.
    pub distance_m: f64,
}

/// A push that ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pushed {
    /// Distance that the hand moved in contact with the object, metres.
    pub moved_m: f64,
    /// On the body's clock, seconds.
    pub duration_s: f64,
}

/// A grasp of one object that stands free.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grasp {
    /// Middle of the object's body, in the map, metres.
    pub object: Point3<f64>,
    /// Required opening of the hand, metres.
    pub width_m: f64,
}

/// A grasp that ended with the object lifted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grasped {
    /// Opening of the hand around the object, metres.
    pub width_m: f64,
    /// On the body's clock, seconds.
    pub duration_s: f64,
}

/// Place for the object in the hand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placing {
    /// Place of the object's foot, in the map, metres.
    pub foot: Point3<f64>,
}

/// Something was put down.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placed {
    /// On the body's clock, seconds.
    pub duration_s: f64,
}

/// State of the hand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hand {
    /// True if the hand holds something.
    pub holds: bool,
}

/// A door was opened.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Opened {
    /// On the body's clock, seconds.
    pub duration_s: f64,
}

/// Progress of a request that takes time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// On the body's clock since the start, seconds.
    pub elapsed_s: f64,
    /// Done so far, 0 to 1.
    pub fraction: f64,
    /// Driven so far, metres.
    pub distance_m: f64,
}

/// Who watches over something that takes time: stops it, limits it, hears of it.
#[derive(Clone)]
pub struct Watch<'a> {
    /// Stops it as soon as possible, with [`Failure::Cancelled`].
    pub cancel: CancellationToken,
    /// Ends it with [`Failure::TimedOut`], seconds on the body's clock.
    pub time_limit_s: f64,
    /// Called now and then.
    pub progress: &'a (dyn Fn(&Progress) + Send + Sync),
}

fn nobody_listens(_: &Progress) {}

impl Default for Watch<'_> {
    /// Nobody stops it, five minutes are enough, nobody listens.
    fn default() -> Self {
        Watch { cancel: CancellationToken::new(), time_limit_s: 300.0, progress: &nobody_listens }
    }
}

/// A body: simulated, recorded or real. Passing `conformance::check` is part of being one.
///
/// What takes time is `async`, can be stopped and has a limit; what is only asked is not. After a failure the body stands still
/// and can be asked again, unless it said [`Failure::Broken`].
#[async_trait::async_trait]
pub trait Robot: Send + Sync {
    /// Parts and abilities of the body.
    fn description(&self) -> &Description;

    /// The body's clock. Simulated and recorded time advances by driving, looking and sensing, not by waiting.
    fn now_ns(&self) -> Stamp;

    /// The room as known from mapping; `None` if the body has no map (a recording).
    fn map(&self) -> Option<&OccupancyGrid>;

    /// True of a simulation or a recording in this process: opened again, it stands where it stood, and does the same when it is asked
    /// the same. Any other body is where it is, and nothing is asked of it twice.
    fn begins_again(&self) -> bool {
        false
    }

    /// Surfaces that the map knows.
    fn surfaces(&self) -> &[SurfaceHint];

    /// `Some` if the body can stand at these poses only.
    fn stations(&self) -> Option<&[Station]>;

    /// Rooms that the map knows.
    fn rooms(&self) -> &[Room] {
        &[]
    }

    /// Doors that the map knows.
    fn doors(&self) -> &[Door] {
        &[]
    }

    /// Predicts the drives from one place to each of the others on the map: nothing moves. Every
    /// door counts as open but those named in `shut`.
    ///
    /// # Errors
    /// Each entry by itself: [`Failure::Unreachable`] with the reason.
    fn travel(&self, from: &Place, to: &[Place], shut: &[String]) -> Vec<Result<Travel, Failure>>;

    /// Predicts the camera's pose (`map_from_camera`) with the base at `place` and the head turned
    /// towards `look_at` (straight ahead if `None`), within the head's limits. A body without a
    /// head looks where the place says.
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

    /// Drives there along a route on the map. A body without [`Description::base`] is where it is: any other place is unreachable.
    ///
    /// # Errors
    /// [`Failure::Unreachable`], [`Failure::Blocked`], [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Lost`], [`Failure::Broken`].
    async fn drive_to(&self, to: &Place, watch: &Watch<'_>) -> Result<Driven, Failure>;

    /// Turns the head towards a point in the map, as far as its limits allow. A body without a head says by how much it misses.
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

    /// Sweeps the laser once.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Description::laser`]; [`Failure::SensorDropped`], [`Failure::TimedOut`],
    /// [`Failure::Cancelled`], [`Failure::Lost`], [`Failure::Broken`].
    async fn scan(&self, watch: &Watch<'_>) -> Result<Scanned, Failure> {
        let _ = watch;
        Err(self.description().lacks(Part::Laser))
    }

    /// Reads one of [`Description::senses`], by its name.
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

    /// Opens a door from where the base stands, near it.
    ///
    /// # Errors
    /// [`Failure::Unable`] if it cannot open doors; [`Failure::Unreachable`] if no door of that name is in reach;
    /// [`Failure::Slipped`], [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn open_door(&self, door: &str, watch: &Watch<'_>) -> Result<Opened, Failure> {
        let _ = (door, watch);
        Err(Failure::Unable { because: format!("{} does not open doors", self.description().name) })
    }

    /// Takes an object into the hand and lifts it.
    ///
    /// # Errors
    /// [`Failure::Unable`] without [`Arm::hand`](crate::Arm::hand), if the hand is full, or if the object is too wide;
    /// [`Failure::Unreachable`] if it is out of reach; [`Failure::Slipped`] if the hand closes on nothing or loses it;
    /// [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn grasp(&self, grasp: &Grasp, watch: &Watch<'_>) -> Result<Grasped, Failure> {
        let _ = (grasp, watch);
        Err(self.description().lacks(Part::Hand))
    }

    /// Puts what the hand holds down.
    ///
    /// # Errors
    /// [`Failure::Unable`] if the hand is empty; [`Failure::Unreachable`] if the place is out of reach; [`Failure::Blocked`] if
    /// something stands there; [`Failure::Slipped`], [`Failure::TimedOut`], [`Failure::Cancelled`], [`Failure::Broken`].
    async fn place(&self, placing: &Placing, watch: &Watch<'_>) -> Result<Placed, Failure> {
        let _ = (placing, watch);
        Err(self.description().lacks(Part::Hand))
    }

    /// State of the hand now.
    ///
    /// # Errors
    /// [`Failure::Unable`] without a hand; [`Failure::Broken`].
    async fn hand(&self) -> Result<Hand, Failure> {
        Err(self.description().lacks(Part::Hand))
    }
}
