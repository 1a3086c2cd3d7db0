//! Something to stand things on, and what lies over it.

use descry_memory::belief::Track;
use descry_perception::locate::Certainty;
use descry_perception::nalgebra::{Point3, Vector3};

use crate::symbol::symbol;

/// Distance from a wall of the map within which a point, or one beyond the wall, belongs to the wall, metres:
/// localisation along a surface errs by two or three centimetres.
const WALL_M: f64 = 0.03;

/// Something to stand things on, as far as it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownSurface {
    /// Its PDDL symbol.
    pub symbol: String,
    /// As people call it.
    pub name: String,
    /// The room that it is in, as people call it, if the map knows.
    pub room: Option<String>,
    /// Outline of that room's floor, within its walls, anticlockwise, metres; empty where the map has none.
    pub floor: Vec<Point3<f64>>,
    /// Convex outline in the map, metres; empty while nothing is known of it.
    pub outline: Vec<Point3<f64>>,
    /// Unit normal, away from the floor.
    pub up: Vector3<f64>,
    /// True if the outline is complete (from the map), false if it is that of the seen part.
    pub whole: bool,
    /// The reason it may be no surface to stand things on, in words after its name, if it may.
    pub doubtful: Option<String>,
    /// Certainty of its alignment with the outline of the map; none without such an outline, or while nothing
    /// was seen.
    pub placed: Option<Certainty>,
    /// Distance by which looks show it beside the place that the map has it at, metres: which of the two is wrong is not known.
    pub displaced_m: f64,
}

impl KnownSurface {
    /// The middle of the outline; none while nothing is known.
    pub fn centre(&self) -> Option<Point3<f64>> {
        if self.outline.is_empty() {
            return None;
        }
        let sum = self.outline.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords);
        Some(Point3::from(sum / self.outline.len() as f64))
    }

    /// True if it is in one of some rooms, by their symbols.
    pub(crate) fn is_in(&self, rooms: &[String]) -> bool {
        self.room.as_deref().is_some_and(|own| rooms.contains(&symbol(own)))
    }

    /// True if a point lies over the outline widened by a margin in metres.
    pub(crate) fn covers(&self, point: &Point3<f64>, margin_m: f64) -> bool {
        is_over(&self.outline, &self.up, point, margin_m)
    }

    /// True if a point belongs to a wall of its room, or lies beyond it; `blur_m` is the extra thickness of a
    /// blurred wall, metres.
    pub(crate) fn is_of_wall(&self, point: &Point3<f64>, blur_m: f64) -> bool {
        self.floor.len() >= 3 && !is_over(&self.floor, &Vector3::z(), point, -WALL_M - blur_m)
    }

    /// True if a point lies over the measured footprint of an object that stands here, or over the circle
    /// around its size.
    pub(crate) fn is_of(&self, track: &Track, point: &Point3<f64>, margin_m: f64) -> bool {
        if track.footprint_m.len() >= 3 {
            return is_over(&track.footprint_m, &self.up, point, margin_m);
        }
        let d = point - track.position_m;
        let aside_m = (d - self.up * d.dot(&self.up)).norm();
        aside_m < track.size_m[0].max(track.size_m[1]) / 2.0 + margin_m
    }
}

/// True if a point lies over a convex outline, anticlockwise seen from above, widened by a margin in metres.
fn is_over(outline: &[Point3<f64>], up: &Vector3<f64>, point: &Point3<f64>, margin_m: f64) -> bool {
    let n = outline.len();
    n >= 3
        && (0..n).all(|i| {
            let (a, b) = (outline[i], outline[(i + 1) % n]);
            let inward = up.cross(&(b - a));
            inward.dot(&(point - a)) >= -margin_m * inward.norm()
        })
}
