//! Results of learning: static structure of visited places, and learned objects.

use descry_perception::Cloud;
use descry_perception::learning::MetaRoom;
use nalgebra::Point3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::packed;

/// Static structure of a place, from all visits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Visited {
    /// The waypoint from which it was looked at.
    pub waypoint: String,
    /// Pose of the place in the map: x and y, metres, and the heading, radians.
    pub at: [f64; 3],
    /// When it was visited last, seconds since 1970.
    pub last_unix_s: f64,
    /// Its static structure.
    #[serde(serialize_with = "write_room", deserialize_with = "read_room")]
    pub room: MetaRoom,
}

/// A thing that was learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LearnedThing {
    /// As it is called.
    pub name: String,
    /// When it was learned, seconds since 1970.
    pub learned_unix_s: f64,
    /// Its surface about its middle, upright as it stood, metres.
    #[serde(with = "packed")]
    pub cloud: Cloud,
    /// Share of the directions around it from which it was seen, 0 to 1.
    pub sides: f64,
    /// Those directions: of 36 around it, counted from its own x anticlockwise, a bit each.
    #[serde(default)]
    pub directions: u64,
    /// Number of encounters with looks from all around; the cloud holds what each showed.
    #[serde(default = "once")]
    pub meetings: u32,
    /// Place of the last sighting.
    pub seen: Place,
}

fn once() -> u32 {
    1
}

/// Place and time of a sighting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// When, seconds since 1970.
    pub unix_s: f64,
    /// Its middle, in the map, metres.
    pub at_m: Point3<f64>,
    /// The surface that it stood on, by its symbol.
    pub on: String,
}

/// A static structure as it is written.
#[derive(Serialize, Deserialize)]
struct Room {
    visits: usize,
    options: descry_perception::learning::NoticeOptions,
    #[serde(with = "packed")]
    cloud: Cloud,
}

fn write_room<S: Serializer>(room: &MetaRoom, writer: S) -> Result<S::Ok, S::Error> {
    let MetaRoom { cloud, visits, options } = room.clone();
    Room { visits, options, cloud }.serialize(writer)
}

fn read_room<'de, D: Deserializer<'de>>(reader: D) -> Result<MetaRoom, D::Error> {
    let Room { visits, options, cloud } = Room::deserialize(reader)?;
    Ok(MetaRoom { cloud, visits, options })
}
