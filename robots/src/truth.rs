//! Ground truth of a scene from a simulator, for scoring and reports only. No decision may read it.

use crate::body::{Pose2, Stamp};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The true state of a scene at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Time stamp, nanoseconds.
    pub stamp_ns: Stamp,
    /// True pose of the base.
    pub base: Pose2,
    /// All objects, in the order of the scene file, then the obstacles missing in the map.
    pub objects: Vec<TrueObject>,
    /// All doors, in the order of the scene file.
    #[serde(default)]
    pub doors: Vec<TrueDoor>,
    /// Name of the object whose visibility the scene requires, if any.
    #[serde(default)]
    pub target: Option<String>,
    /// Share of the target that is visible from the start, 0 to 1.
    #[serde(default)]
    pub target_visible_from_start: Option<f64>,
    /// Events in the room so far: injected faults, actions of people, effects of the body.
    #[serde(default)]
    pub events: Vec<Event>,
}

/// True state of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueObject {
    /// Unique in the scene.
    pub name: String,
    /// Kind of the object; several objects may be of one kind.
    pub kind: String,
    /// Name of the surface on which the object stands; `None` in the hand, on the floor or taken away.
    pub surface: Option<String>,
    /// Name of the room of the object, if the scene names rooms; `None` if taken away.
    #[serde(default)]
    pub room: Option<String>,
    /// True while the body holds the object.
    #[serde(default)]
    pub in_hand: bool,
    /// False once the object has been taken away.
    pub present: bool,
    /// Pose of the object in the map; the origin is the centre of its base.
    pub map_from_object: Isometry3<f64>,
    /// Centre of the object's body without a handle, map frame, metres.
    pub centre_m: Point3<f64>,
    /// Size of the bounding box in the object's own frame, including a handle, metres.
    pub size_m: [f64; 3],
}

/// True state of a door.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrueDoor {
    /// Name for people.
    pub name: String,
    /// True if the door is shut.
    pub shut: bool,
}

/// An event in the simulated room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Time stamp, nanoseconds.
    pub stamp_ns: Stamp,
    /// Description, in one sentence.
    pub what: String,
}

impl Truth {
    /// Reads the ground truth written by a program's simulator, in the format of `robots/PROTOCOL.md`.
    ///
    /// # Errors
    /// The fault, with the name of the file.
    pub fn read(file: &Path) -> Result<Truth, String> {
        let place = file.display();
        let text = crate::input::read_text(file).map_err(|e| format!("{place}: {e}"))?;
        serde_json::from_str(&text).map_err(|e| format!("{place}: this is no truth of a scene: {e}"))
    }
}
