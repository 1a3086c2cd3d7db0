//! How everything in the simulator really is: for scoring and reports only.

use crate::body::{Pose2, Stamp};
use crate::sim::world::Scene;
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

/// The true state of a scene at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// When.
    pub stamp_ns: Stamp,
    /// Where the base is.
    pub base: Pose2,
    /// Every object of the scene, in the order of the scene file.
    pub objects: Vec<TrueObject>,
    /// Name of the object that the arrangement was chosen for.
    pub target: Option<String>,
    /// Share of it that the camera saw from the start.
    pub target_visible_from_start: Option<f64>,
    /// What went wrong so far, and what others did.
    pub events: Vec<Event>,
}

/// An object as it really is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueObject {
    /// Unique in the scene.
    pub name: String,
    /// What it is.
    pub kind: String,
    /// The surface it stands on.
    pub surface: String,
    /// False once it has been taken away.
    pub present: bool,
    /// Where its base stands, in the map.
    pub map_from_object: Isometry3<f64>,
    /// Middle of its body (a handle left out), in the map, metres.
    pub centre_m: Point3<f64>,
    /// Sides of the box around it in its own frame, a handle included, metres.
    pub size_m: [f64; 3],
}

/// Something that happened in the simulated room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// When.
    pub stamp_ns: Stamp,
    /// What, in one sentence.
    pub what: String,
}

impl Truth {
    pub(crate) fn of(
        scene: &Scene,
        stamp_ns: Stamp,
        map_from_base: &Isometry3<f64>,
        events: &[Event],
    ) -> Truth {
        let objects = scene.objects.iter().map(|o| {
            let (low, high) = o.shape.bounds();
            TrueObject {
                name: o.name.clone(),
                kind: o.kind.clone(),
                surface: o.surface.clone(),
                present: o.present,
                map_from_object: o.map_from_object,
                centre_m: o.centre_m(),
                size_m: (high - low).into(),
            }
        });
        Truth {
            stamp_ns,
            base: Pose2::from_isometry(map_from_base),
            objects: objects.collect(),
            target: scene.target.as_ref().map(|t| t.object.clone()),
            target_visible_from_start: scene.target_visible_from_start,
            events: events.to_vec(),
        }
    }
}
