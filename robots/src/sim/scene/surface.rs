//! Support surfaces, and obstacles on the floor.

use super::check::{finite, object, positive, unique};
use super::room::RoomSpec;
use super::{SceneSpec, default_grey};
use crate::input::{Objection, Step};
use crate::sim::outline::{Outline, gap_between, upright};
use nalgebra::{Isometry2, Isometry3, Point2, Point3, Vector2};
use serde::{Deserialize, Serialize};

/// Kind of support that holds up a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceKind {
    /// Four legs.
    #[default]
    Table,
    /// A wall, or upright panels at the ends: a shelf board, a counter.
    Board,
}

/// A support surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceSpec {
    /// Name of the surface, unique in the scene.
    pub name: String,
    /// Kind of support that holds up the surface.
    #[serde(default)]
    pub kind: SurfaceKind,
    /// True if a board has side panels down to the floor, at both ends of its own x.
    #[serde(default)]
    pub uprights: bool,
    /// Centre of the surface, map frame, metres.
    #[serde(default)]
    pub position_m: [f64; 2],
    /// Rotation, counter-clockwise, degrees.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Size along the surface's own x and y, metres.
    pub size_m: [f64; 2],
    /// Height of the top above the floor, metres.
    pub height_m: f64,
    /// Thickness of the top, metres.
    #[serde(default = "default_thickness_m")]
    pub thickness_m: f64,
    /// Red, green, blue.
    #[serde(default = "default_wood")]
    pub colour: [u8; 3],
}

/// A box on the floor, optionally with rounded vertical edges, or a seat on four legs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleSpec {
    /// Name for messages.
    pub name: String,
    /// Centre of the obstacle, map frame, metres.
    pub position_m: [f64; 2],
    /// Size of a rectangle around that position, metres, within which the seed places and turns the obstacle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spread_m: Option<[f64; 2]>,
    /// Minimum gap to obstacles placed before, metres, where the seed places the obstacle.
    #[serde(default)]
    pub gap_m: f64,
    /// Rotation, counter-clockwise, degrees.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Size along the obstacle's own x and y, and its height, metres.
    pub size_m: [f64; 3],
    /// Radius of the vertical edges, metres.
    #[serde(default)]
    pub corner_m: f64,
    /// Thickness of the legs of a seat, metres; left out for a box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub legs_m: Option<f64>,
    /// Height of the back above the seat, metres; left out for a seat without a back.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub back_m: Option<f64>,
    /// The visits in which the obstacle is present; all if left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub visits: Vec<usize>,
    /// True if the robot's map shows the obstacle.
    #[serde(default = "default_true")]
    pub on_map: bool,
    /// Red, green, blue.
    #[serde(default = "default_grey")]
    pub colour: [u8; 3],
}

fn default_thickness_m() -> f64 {
    0.03
}
fn default_true() -> bool {
    true
}
fn default_wood() -> [u8; 3] {
    [170, 130, 90]
}

/// Tolerance by which corners of surfaces may lie inside a wall, for rounding, metres.
const IN_WALL_M: f64 = 1e-3;

impl SurfaceSpec {
    /// Pose of the top in the map: origin at its centre, z up.
    pub fn map_from_top(&self) -> Isometry3<f64> {
        upright(self.position_m[0], self.position_m[1], self.height_m, self.yaw_deg.to_radians())
    }

    /// Centre of the surface in the map's x-y plane, metres.
    pub fn centre_m(&self) -> Point2<f64> {
        Point2::from(self.position_m)
    }

    /// Corners of the top in order, map frame, metres.
    pub fn outline_m(&self) -> Vec<Point2<f64>> {
        let [x, y] = self.size_m.map(|s| 0.5 * s);
        let top = self.map_from_top();
        [(-x, -y), (x, -y), (x, y), (-x, y)]
            .iter()
            .map(|&(x, y)| (top * Point3::new(x, y, 0.0)).xy())
            .collect()
    }

    /// True if a point of the floor plan is on the top or at most `margin_m` beside it.
    pub fn covers(&self, p: &Point2<f64>, margin_m: f64) -> bool {
        let local = self.map_from_top().inverse_transform_point(&Point3::new(p.x, p.y, self.height_m));
        local.x.abs() <= 0.5 * self.size_m[0] + margin_m && local.y.abs() <= 0.5 * self.size_m[1] + margin_m
    }
}

impl SceneSpec {
    pub(super) fn check_surface(&self, i: usize, s: &SurfaceSpec) -> Result<(), Objection> {
        let at = |key| [Step::Key("surface"), Step::Index(i), Step::Key(key)];
        positive(&s.size_m, &at("size_m"))?;
        positive(&[s.height_m], &at("height_m"))?;
        positive(&[s.thickness_m], &at("thickness_m"))?;
        finite(&s.position_m, &at("position_m"))?;
        finite(&[s.yaw_deg], &at("yaw_deg"))?;
        if s.thickness_m >= s.height_m {
            return Err(object(
                &at("thickness_m"),
                format!("the top is {} m thick and {} m high", s.thickness_m, s.height_m),
                "make the top thinner than it is high".into(),
            ));
        }
        unique("surface", &s.name, self.surfaces[..i].iter().map(|o| o.name.as_str()), &at("name"))?;
        if s.uprights && s.kind == SurfaceKind::Table {
            return Err(object(
                &at("uprights"),
                format!("\"{}\" stands on legs", s.name),
                "kind = \"board\", or leave `uprights` out".into(),
            ));
        }
        let inside = |room: &RoomSpec| s.outline_m().iter().all(|c| room.holds(c, IN_WALL_M));
        if !self.rooms.iter().any(inside) {
            let (where_to, mend) = match self.rooms.len() {
                1 => ("the room", "move it, make it smaller, or give [room] a `size_m` that holds it"),
                _ => ("one room", "move it, or make it smaller"),
            };
            let problem = format!("\"{}\" is not within {where_to}", s.name);
            return Err(object(&at("position_m"), problem, mend.into()));
        }
        Ok(())
    }

    pub(super) fn check_obstacle(&self, i: usize, o: &ObstacleSpec) -> Result<(), Objection> {
        let at = |key| [Step::Key("obstacle"), Step::Index(i), Step::Key(key)];
        positive(&o.size_m, &at("size_m"))?;
        let half_m = 0.5 * o.size_m[0].min(o.size_m[1]);
        if !(0.0..=half_m).contains(&o.corner_m) {
            let problem = format!("edges with a radius of {} m do not fit \"{}\"", o.corner_m, o.name);
            return Err(object(&at("corner_m"), problem, format!("0 to {half_m:.4}")));
        }
        if let Some(legs_m) = o.legs_m {
            positive(&[legs_m], &at("legs_m"))?;
            if legs_m > half_m {
                let problem = format!("legs {legs_m} m thick leave nothing between them");
                return Err(object(&at("legs_m"), problem, format!("at most {half_m:.4}")));
            }
        }
        if let Some(back_m) = o.back_m {
            positive(&[back_m], &at("back_m"))?;
            if o.legs_m.is_none() {
                let problem = format!("\"{}\" has no seat to which a back belongs", o.name);
                return Err(object(&at("back_m"), problem, "give `legs_m`, or leave `back_m` out".into()));
            }
        }
        if let Some(spread_m) = o.spread_m {
            positive(&spread_m, &at("spread_m"))?;
        }
        finite(&[o.gap_m], &at("gap_m"))?;
        finite(&[o.position_m[0], o.position_m[1], o.yaw_deg], &at("position_m"))
    }
}

/// Headroom above the surface `below`, up to the lowest of `surfaces` above any part of it, metres; infinite
/// if there is none.
pub(crate) fn headroom_m(surfaces: &[SurfaceSpec], below: &SurfaceSpec) -> f64 {
    let overlaps = |other: &&SurfaceSpec| {
        let at = |s: &SurfaceSpec| {
            let middle = s.centre_m();
            Isometry2::new(Vector2::new(middle.x, middle.y), s.yaw_deg.to_radians())
        };
        let outline = |s: &SurfaceSpec| Outline::Rectangle { half_m: s.size_m.map(|side| 0.5 * side) };
        gap_between(&outline(below), &at(below), &outline(other), &at(other)) < 0.0
    };
    surfaces
        .iter()
        .filter(|other| other.height_m > below.height_m)
        .filter(overlaps)
        .map(|other| other.height_m - other.thickness_m - below.height_m)
        .fold(f64::INFINITY, f64::min)
}
