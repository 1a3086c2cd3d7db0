//! How everything in the simulator really is: for scoring and reports only.

use crate::body::{Pose2, Stamp};
use crate::sim::hand;
use crate::sim::world::{Scene, Stand};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

/// The true state of a scene at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// When.
    pub stamp_ns: Stamp,
    /// Where the base is.
    pub base: Pose2,
    /// Every object of the scene, in the order of the scene file; then the obstacles that the map does not show.
    pub objects: Vec<TrueObject>,
    /// Every door, in the order of the scene file.
    #[serde(default)]
    pub doors: Vec<TrueDoor>,
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
    /// Where its base stands, in the map.
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
    /// Whether it is shut.
    pub shut: bool,
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
            let mut o = o.clone();
            if o.stands == Stand::Hand {
                o.map_from_object = hand::map_from_held(map_from_base);
            }
            let present = o.stands != Stand::Away;
            let centre_m = o.centre_m();
            TrueObject {
                surface: o.surface().map(String::from),
                room: scene.room_at(&centre_m.xy()).filter(|_| present).map(String::from),
                in_hand: o.stands == Stand::Hand,
                present,
                name: o.name,
                kind: o.kind,
                map_from_object: o.map_from_object,
                centre_m,
                size_m: (high - low).into(),
            }
        });
        // What the map does not show is for the body to find out.
        let on_floor = scene.obstacles.iter().filter(|o| !o.on_map).map(|o| {
            let map_from_object = o.map_from_obstacle();
            let centre_m = map_from_object * Point3::new(0.0, 0.0, 0.5 * o.size_m[2]);
            TrueObject {
                name: o.name.clone(),
                kind: o.name.clone(),
                surface: None,
                room: scene.room_at(&centre_m.xy()).map(String::from),
                in_hand: false,
                present: true,
                map_from_object,
                centre_m,
                size_m: o.size_m,
            }
        });
        Truth {
            stamp_ns,
            base: Pose2::from_isometry(map_from_base),
            objects: objects.chain(on_floor).collect(),
            doors: scene
                .doors
                .iter()
                .map(|d| TrueDoor { name: d.doorway.name.clone(), shut: d.shut })
                .collect(),
            target: scene.target.as_ref().map(|t| t.object.clone()),
            target_visible_from_start: scene.target_visible_from_start,
            events: events.to_vec(),
        }
    }
}
