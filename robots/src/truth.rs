//! True state of a scene, as a simulator states it: for scoring and reports only. No decision may
//! read it.

use crate::body::{Pose2, Stamp};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The true state of a scene at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// When.
    pub stamp_ns: Stamp,
    /// Pose of the base.
    pub base: Pose2,
    /// Every object of the scene, in the order of the scene file; then the obstacles that the map does not show.
    pub objects: Vec<TrueObject>,
    /// Every door, in the order of the scene file.
    #[serde(default)]
    pub doors: Vec<TrueDoor>,
    /// Name of the object that the arrangement was chosen for.
    #[serde(default)]
    pub target: Option<String>,
    /// Share of it that the camera saw from the start.
    #[serde(default)]
    pub target_visible_from_start: Option<f64>,
    /// Faults and others' deeds so far.
    #[serde(default)]
    pub events: Vec<Event>,
}

/// An object as it really is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueObject {
    /// Unique in the scene.
    pub name: String,
    /// Kind.
    pub kind: String,
    /// The surface it stands on; none in the hand, on the floor or taken away.
    pub surface: Option<String>,
    /// The room it is in, if the scene names rooms; none once it has been taken away.
    #[serde(default)]
    pub room: Option<String>,
    /// True while the body holds it.
    #[serde(default)]
    pub in_hand: bool,
    /// False once it has been taken away.
    pub present: bool,
    /// Pose of its base, in the map.
    pub map_from_object: Isometry3<f64>,
    /// Middle of its body (a handle left out), in the map, metres.
    pub centre_m: Point3<f64>,
    /// Sides of the box around it in its own frame, a handle included, metres.
    pub size_m: [f64; 3],
}

/// A door as it really is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrueDoor {
    /// As people call it.
    pub name: String,
    /// True if it is shut.
    pub shut: bool,
}

/// Something that happened in the simulated room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// When.
    pub stamp_ns: Stamp,
    /// Event, in one sentence.
    pub what: String,
}

impl Truth {
    /// Reads what a program's simulator has written, as `robots/PROTOCOL.md` says.
    ///
    /// # Errors
    /// Names the file, and what is wrong with it.
    pub fn read(file: &Path) -> Result<Truth, String> {
        let place = file.display();
        let text = crate::input::read_text(file).map_err(|e| format!("{place}: {e}"))?;
        serde_json::from_str(&text).map_err(|e| format!("{place}: this is no truth of a scene: {e}"))
    }
}
