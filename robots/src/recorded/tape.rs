//! Tape of a body: its requests and answers in order, sufficient to replay the run.

use crate::body::{Door, Place, Robot, Room, Stamp, Station, SurfaceHint, Travel};
use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::parts::Description;
use crate::request::{Answer, Pixels, Request};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

/// Description and map of a body at the beginning of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// Parts and abilities of the body: [`Robot::description`].
    pub description: Description,
    /// Surfaces in the map: [`Robot::surfaces`].
    pub surfaces: Vec<SurfaceHint>,
    /// Rooms in the map: [`Robot::rooms`].
    #[serde(default)]
    pub rooms: Vec<Room>,
    /// Doors in the map: [`Robot::doors`].
    #[serde(default)]
    pub doors: Vec<Door>,
    /// The only places where the body can stand, if it has such: [`Robot::stations`].
    pub stations: Option<Vec<Station>>,
    /// Occupancy grid of the floor, if the body has a map: [`Robot::map`].
    pub map: Option<OccupancyGrid>,
    /// Time on the body's clock: [`Robot::now_ns`], nanoseconds.
    pub now_ns: Stamp,
}

impl Known {
    /// Copies the description and the map of a body.
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

/// A query to a body, which moves nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Question {
    /// Predicted cost of drives: [`Robot::travel`].
    Travel {
        /// Start.
        from: Place,
        /// Destinations.
        to: Vec<Place>,
        /// Names of the doors that count as shut.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        shut: Vec<String>,
    },
    /// Predicted pose of the camera: [`Robot::camera_at`].
    CameraAt {
        /// Place of the base.
        place: Place,
        /// Point in the map towards which the head is turned; straight ahead if `None`.
        look_at: Option<Point3<f64>>,
    },
}

/// Reply of the body to a query.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reply {
    /// Cost of the drive to each destination, for [`Question::Travel`].
    Travel(Vec<Result<Travel, Failure>>),
    /// Pose of the camera in the map, for [`Question::CameraAt`].
    CameraAt(Result<Isometry3<f64>, Failure>),
}

/// A request with its answer, and the queries since the previous request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Queries since the previous entry with their replies, as far as the replies are new.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub replies: Vec<(Question, Reply)>,
    /// The request and its answer; `None` at the end of a run.
    pub done: Option<(Request, Answer)>,
    /// Time on the body's clock after the answer, nanoseconds.
    pub now_ns: Stamp,
}

/// Storage for a body's answers.
pub trait Tape: Send + Sync {
    /// Stores an entry durably. The entry of a camera frame may become durable only with the pixels, which
    /// are stored next.
    ///
    /// # Errors
    /// The reason for which the entry cannot be stored.
    fn keep(&self, entry: &Entry) -> Result<(), String>;

    /// Pixels of a stored frame.
    ///
    /// # Errors
    /// The reason for which they cannot be read.
    fn pixels(&self, stamp_ns: Stamp) -> Result<Pixels, String>;
}
