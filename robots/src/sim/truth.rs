//! Ground truth of a simulated scene.

use crate::body::{Pose2, Stamp};
use crate::sim::hand;
use crate::sim::world::{Scene, Stand};
use crate::truth::{Event, TrueDoor, TrueObject, Truth};
use nalgebra::{Isometry3, Point3};

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
