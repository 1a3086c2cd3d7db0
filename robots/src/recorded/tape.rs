//! Requests to a body and their answers, in order: sufficient to replay the run.

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
    /// Description and map that a body states.
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
    /// [`Robot::travel`].
    Travel {
        /// Start.
        from: Place,
        /// Destinations.
        to: Vec<Place>,
        /// Doors that count as shut.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        shut: Vec<String>,
    },
    /// [`Robot::camera_at`].
    CameraAt {
        /// Pose of the base.
        place: Place,
        /// Target of the head.
        look_at: Option<Point3<f64>>,
    },
}

/// Reply of the body to a query.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reply {
    /// To [`Question::Travel`].
    Travel(Vec<Result<Travel, Failure>>),
    /// To [`Question::CameraAt`].
    CameraAt(Result<Isometry3<f64>, Failure>),
}

/// A request with its answer, and the queries since the previous request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// New replies since the previous entry.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub replies: Vec<(Question, Reply)>,
    /// The request and its answer; none at the end of a run.
    pub done: Option<(Request, Answer)>,
    /// The body's clock after the answer.
    pub now_ns: Stamp,
}

/// Storage for a body's answers.
pub trait Tape: Send + Sync {
    /// Stores an entry durably; for a frame, durability also needs its pixels, which come next.
    ///
    /// # Errors
    /// The reason for which it cannot be stored.
    fn keep(&self, entry: &Entry) -> Result<(), String>;

    /// Pixels of a stored frame.
    ///
    /// # Errors
    /// The reason for which they cannot be read.
    fn pixels(&self, stamp_ns: Stamp) -> Result<Pixels, String>;
}
