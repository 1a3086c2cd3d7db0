//! Doors: openings in the walls between two rooms, with a panel that slides into the wall.

use super::SceneSpec;
use super::check::{finite, object, positive, unique};
use super::room::RoomSpec;
use crate::body::Door;
use crate::input::{Objection, Step};
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

/// State of a door.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DoorState {
    /// The panel is slid into the wall.
    Open,
    /// The panel fills the opening.
    Shut,
}

/// A door in a scene file. The wall in which it lies, and the rooms on either side, follow from its position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DoorSpec {
    /// Name of the door, unique in the scene.
    pub name: String,
    /// Centre of the opening, map frame, within the wall, metres.
    pub position_m: [f64; 2],
    /// Width of the opening along the wall, metres.
    #[serde(default = "default_width_m")]
    pub width_m: f64,
    /// Height of the opening above the floor, metres.
    #[serde(default = "default_height_m")]
    pub height_m: f64,
    /// Initial state; open if neither this nor `shut_chance` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<DoorState>,
    /// Probability that the door is shut initially, drawn by the seed; an alternative to `state`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shut_chance: Option<f64>,
}

fn default_width_m() -> f64 {
    0.9
}
fn default_height_m() -> f64 {
    2.0
}

/// Maximum thickness of a wall with a door, metres.
const THICKEST_M: f64 = 0.6;

/// The opening of a door, derived from the rooms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Doorway {
    /// Name of the door for people.
    pub name: String,
    /// Centre of the opening, map frame, metres.
    pub centre_m: Point2<f64>,
    /// Axis of the map parallel to the wall: 0 for x, 1 for y.
    pub along: usize,
    /// Width of the opening along the wall, metres.
    pub width_m: f64,
    /// Height of the opening above the floor, metres.
    pub height_m: f64,
    /// Thickness of the wall, metres.
    pub thickness_m: f64,
    /// Names of the rooms on either side.
    pub between: [String; 2],
}

impl Doorway {
    /// Half extents of the opening along the map's axes, metres.
    pub fn half_m(&self) -> Vector2<f64> {
        let mut half = Vector2::repeat(0.5 * self.thickness_m);
        half[self.along] = 0.5 * self.width_m;
        half
    }

    /// The door as the map of a body shows it.
    pub(crate) fn hint(&self) -> Door {
        Door {
            name: self.name.clone(),
            centre_m: self.centre_m,
            along_rad: if self.along == 0 { 0.0 } else { std::f64::consts::FRAC_PI_2 },
            width_m: self.width_m,
            between: self.between.clone(),
        }
    }

    /// Distance of a floor point from the base line of the shut panel, metres.
    pub fn distance_m(&self, p: &Point2<f64>) -> f64 {
        let off = p - self.centre_m;
        (off[self.along].abs() - 0.5 * self.width_m).max(0.0).hypot(off[1 - self.along])
    }
}

impl DoorSpec {
    /// Nearest room on each side of the door across a wall along `axis`, and the two faces of the wall,
    /// metres along the other axis; `None` if there is no wall of at most [`THICKEST_M`].
    fn sides<'a>(&self, rooms: &'a [RoomSpec], axis: usize) -> Option<([&'a RoomSpec; 2], [f64; 2])> {
        let across = 1 - axis;
        let half_m = 0.5 * self.width_m;
        let reaches = |r: &&RoomSpec| {
            r.low()[axis] <= self.position_m[axis] - half_m
                && r.high()[axis] >= self.position_m[axis] + half_m
        };
        let at = self.position_m[across];
        let below = rooms.iter().filter(reaches).filter(|r| r.high()[across] <= at);
        let above = rooms.iter().filter(reaches).filter(|r| r.low()[across] >= at);
        let below = below.max_by(|a, b| a.high()[across].total_cmp(&b.high()[across]))?;
        let above = above.min_by(|a, b| a.low()[across].total_cmp(&b.low()[across]))?;
        let wall = [below.high()[across], above.low()[across]];
        (wall[1] - wall[0] <= THICKEST_M).then_some(([below, above], wall))
    }

    /// Opening of the door; `None` unless it lies in a wall between two rooms that both extend along all of
    /// the opening.
    pub fn doorway(&self, rooms: &[RoomSpec]) -> Option<Doorway> {
        let (along, (sides, wall)) = [0, 1].into_iter().find_map(|k| Some((k, self.sides(rooms, k)?)))?;
        let mut centre_m = Point2::from(self.position_m);
        centre_m[1 - along] = 0.5 * (wall[0] + wall[1]);
        Some(Doorway {
            name: self.name.clone(),
            centre_m,
            along,
            width_m: self.width_m,
            height_m: self.height_m,
            thickness_m: wall[1] - wall[0],
            between: sides.map(|r| r.name.clone()),
        })
    }
}

impl SceneSpec {
    pub(super) fn check_door(&self, i: usize, door: &DoorSpec) -> Result<(), Objection> {
        let at = |key| [Step::Key("door"), Step::Index(i), Step::Key(key)];
        unique("door", &door.name, self.doors[..i].iter().map(|d| d.name.as_str()), &at("name"))?;
        finite(&door.position_m, &at("position_m"))?;
        positive(&[door.width_m], &at("width_m"))?;
        positive(&[door.height_m], &at("height_m"))?;
        let top_m = RoomSpec::around(&self.rooms).wall_height_m;
        if door.height_m > top_m {
            return Err(object(
                &at("height_m"),
                format!("a door of {} m is higher than its wall", door.height_m),
                format!("at most {top_m}"),
            ));
        }
        match (door.state, door.shut_chance) {
            (Some(_), Some(_)) => {
                return Err(object(
                    &at("shut_chance"),
                    "both `state` and `shut_chance` are given".into(),
                    "keep one of them".into(),
                ));
            }
            (_, Some(chance)) if !(0.0..=1.0).contains(&chance) => {
                return Err(object(
                    &at("shut_chance"),
                    format!("{chance} is no chance"),
                    "a number between 0 and 1".into(),
                ));
            }
            _ => {}
        }
        let Some(doorway) = door.doorway(&self.rooms) else {
            return Err(object(
                &at("position_m"),
                format!("\"{}\" is not in a wall between two rooms", door.name),
                format!(
                    "the middle of a wall of at most {THICKEST_M} m, with a room on either side along all of the door's width"
                ),
            ));
        };
        let meets = |other: &Doorway| {
            let (gap, room) = ((doorway.centre_m - other.centre_m).abs(), doorway.half_m() + other.half_m());
            gap.x <= room.x && gap.y <= room.y
        };
        match self.doors[..i].iter().filter_map(|d| d.doorway(&self.rooms)).find(meets) {
            Some(other) => Err(object(
                &at("position_m"),
                format!("\"{}\" and \"{}\" overlap", door.name, other.name),
                "move one of them along the wall".into(),
            )),
            None => Ok(()),
        }
    }
}
