//! Rooms: rectangles of floor. The space between them, within their common bounding rectangle, is wall.

use super::SceneSpec;
use super::check::{finite, object, positive, unique};
use crate::input::{Objection, Step};
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// A rectangle of floor with walls around it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoomSpec {
    /// Unique among the rooms; empty for the only room of a scene.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Centre of the room, map frame, metres.
    #[serde(default)]
    pub position_m: [f64; 2],
    /// Inner size along x and y, metres.
    pub size_m: [f64; 2],
    /// Height of the walls, metres; the maximum over all rooms applies.
    #[serde(default = "default_wall_height_m")]
    pub wall_height_m: f64,
}

fn default_wall_height_m() -> f64 {
    2.5
}

impl Default for RoomSpec {
    fn default() -> Self {
        RoomSpec {
            name: String::new(),
            position_m: [0.0; 2],
            size_m: [6.0, 5.0],
            wall_height_m: default_wall_height_m(),
        }
    }
}

pub(super) fn one_room() -> Vec<RoomSpec> {
    vec![RoomSpec::default()]
}

/// Maximum extent of a room, metres, which limits the map to millions of cells.
const LARGEST_M: f64 = 100.0;
/// Distance below which two rooms touch, without a wall between them, metres.
pub(crate) const TOUCHING_M: f64 = 1e-6;

impl RoomSpec {
    /// Minimum corner of the floor, map frame, metres.
    pub fn low(&self) -> Point2<f64> {
        Point2::new(self.position_m[0] - 0.5 * self.size_m[0], self.position_m[1] - 0.5 * self.size_m[1])
    }

    /// Maximum corner of the floor, map frame, metres.
    pub fn high(&self) -> Point2<f64> {
        Point2::new(self.position_m[0] + 0.5 * self.size_m[0], self.position_m[1] + 0.5 * self.size_m[1])
    }

    /// Corners of the floor in order, map frame, metres.
    pub fn outline_m(&self) -> Vec<Point2<f64>> {
        let (low, high) = (self.low(), self.high());
        vec![low, Point2::new(high.x, low.y), high, Point2::new(low.x, high.y)]
    }

    /// True if a point is on the room's floor or at most `margin_m` outside.
    pub fn holds(&self, p: &Point2<f64>, margin_m: f64) -> bool {
        (0..2).all(|k| (p[k] - self.position_m[k]).abs() <= 0.5 * self.size_m[k] + margin_m)
    }

    /// Smallest rectangle around all rooms, with the height of the highest and without a name.
    pub fn around(rooms: &[RoomSpec]) -> RoomSpec {
        if let [one] = rooms {
            return RoomSpec { name: String::new(), ..one.clone() };
        }
        let low = |k: usize| rooms.iter().map(|r| r.low()[k]).fold(f64::INFINITY, f64::min);
        let high = |k: usize| rooms.iter().map(|r| r.high()[k]).fold(f64::NEG_INFINITY, f64::max);
        RoomSpec {
            name: String::new(),
            position_m: [0, 1].map(|k| 0.5 * (low(k) + high(k))),
            size_m: [0, 1].map(|k| high(k) - low(k)),
            wall_height_m: rooms.iter().map(|r| r.wall_height_m).fold(0.0, f64::max),
        }
    }

    fn overlaps(&self, other: &RoomSpec) -> bool {
        (0..2).all(|k| {
            (self.position_m[k] - other.position_m[k]).abs() + TOUCHING_M
                < 0.5 * (self.size_m[k] + other.size_m[k])
        })
    }
}

impl SceneSpec {
    /// Path in the document to a key of the room with index `i`: a single `[room]` is not a list.
    fn room_path(&self, i: usize, key: &'static str) -> Vec<Step> {
        match self.rooms.as_slice() {
            [one] if one.name.is_empty() => vec![Step::Key("room"), Step::Key(key)],
            _ => vec![Step::Key("room"), Step::Index(i), Step::Key(key)],
        }
    }

    pub(super) fn check_rooms(&self) -> Result<(), Objection> {
        if self.rooms.is_empty() {
            return Err(object(
                &[Step::Key("room")],
                "a scene without a room".into(),
                "add a [[room]]".into(),
            ));
        }
        for (i, room) in self.rooms.iter().enumerate() {
            let at = |key| self.room_path(i, key);
            positive(&room.size_m, &at("size_m"))?;
            positive(&[room.wall_height_m], &at("wall_height_m"))?;
            finite(&room.position_m, &at("position_m"))?;
            if let Some(side) = room.size_m.iter().find(|s| **s > LARGEST_M) {
                return Err(object(
                    &at("size_m"),
                    format!("a room of {side} m is larger than this simulator maps"),
                    format!("at most {LARGEST_M} m a side"),
                ));
            }
            let earlier = &self.rooms[..i];
            if self.rooms.len() > 1 {
                unique("room", &room.name, earlier.iter().map(|r| r.name.as_str()), &at("name"))?;
            }
            if let Some(other) = earlier.iter().find(|r| r.overlaps(room)) {
                return Err(object(
                    &at("position_m"),
                    format!("\"{}\" and \"{}\" overlap", room.name, other.name),
                    "leave a gap as thick as the wall between them, or let them touch".into(),
                ));
            }
            let outer = RoomSpec::around(&self.rooms[..=i]);
            if let Some(side) = outer.size_m.iter().find(|s| **s > LARGEST_M) {
                return Err(object(
                    &at("position_m"),
                    format!("rooms that spread over {side} m are more than this simulator maps"),
                    format!("at most {LARGEST_M} m a side"),
                ));
            }
        }
        Ok(())
    }

    /// Rooms that have names.
    pub(crate) fn named_rooms(&self) -> impl Iterator<Item = &RoomSpec> {
        self.rooms.iter().filter(|r| !r.name.is_empty())
    }
}
