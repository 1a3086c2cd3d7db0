//! Results of learning: static structure of visited places, and learned objects.

use descry_perception::Cloud;
use descry_perception::learning::MetaRoom;
use nalgebra::Point3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::packed;

/// Static structure of a place, learned from all visits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Visited {
    /// Name of the waypoint where the place was observed.
    pub waypoint: String,
    /// Pose of the place in the map: x and y, metres, and the heading, radians.
    pub at: [f64; 3],
    /// Time of the last visit, seconds since 1970.
    pub last_unix_s: f64,
    /// Static structure of the place.
    #[serde(serialize_with = "write_room", deserialize_with = "read_room")]
    pub room: MetaRoom,
}

/// A learned object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LearnedThing {
    /// Name of the object.
    pub name: String,
    /// Time of learning, seconds since 1970.
    pub learned_unix_s: f64,
    /// Surface points relative to the object's centre, upright as the object stood, metres.
    #[serde(with = "packed")]
    pub cloud: Cloud,
    /// Share of the directions around the object from which views showed it, 0 to 1.
    pub sides: f64,
    /// Directions from which the object was seen, as a set of 36 bits: sectors counted anticlockwise from the
    /// object's x axis.
    #[serde(default)]
    pub directions: u64,
    /// Number of encounters, each with views from all around, that the cloud merges.
    #[serde(default = "once")]
    pub meetings: u32,
    /// Place and time of the last sighting.
    pub seen: Place,
}

fn once() -> u32 {
    1
}

/// Place and time of a sighting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Time of the sighting, seconds since 1970.
    pub unix_s: f64,
    /// Centre of the object, map frame, metres.
    pub at_m: Point3<f64>,
    /// Symbol of the supporting surface.
    pub on: String,
}

/// Serialised form of a static structure.
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
