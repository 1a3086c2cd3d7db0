//! Supporting surface, and the points over it.

use descry_memory::belief::Track;
use descry_perception::locate::Certainty;
use descry_perception::nalgebra::{Point3, Vector3};

use crate::symbol::symbol;

/// Distance from a mapped wall within which a point belongs to the wall, metres: localisation along
/// a surface errs by two or three centimetres.
const WALL_M: f64 = 0.03;

/// Supporting surface, as far as known.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownSurface {
    /// PDDL symbol.
    pub symbol: String,
    /// Spoken name.
    pub name: String,
    /// Spoken name of the surface's room, if mapped.
    pub room: Option<String>,
    /// Outline of the room's floor within its walls, anticlockwise, metres; empty if unmapped.
    pub floor: Vec<Point3<f64>>,
    /// Convex outline in the map, metres; empty while unknown.
    pub outline: Vec<Point3<f64>>,
    /// Unit normal, away from the floor.
    pub up: Vector3<f64>,
    /// True if the outline is complete (from the map); false if it covers the seen part.
    pub whole: bool,
    /// Reason why this may not be a supporting surface, in words after its name; `None` if undoubted.
    pub doubtful: Option<String>,
    /// Certainty of the alignment with the map's outline; `None` without an outline, or before a view.
    pub placed: Option<Certainty>,
    /// Displacement between the observed and the mapped surface, metres; either may be wrong.
    pub displaced_m: f64,
    /// Probability that camera or poses of the views have a fault.
    pub sensor_doubt: f64,
}

impl KnownSurface {
    /// Centre of the outline; `None` while unknown.
    pub fn centre(&self) -> Option<Point3<f64>> {
        if self.outline.is_empty() {
            return None;
        }
        let sum = self.outline.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords);
        Some(Point3::from(sum / self.outline.len() as f64))
    }

    /// True if the surface is in one of the rooms (by symbol).
    pub(crate) fn is_in(&self, rooms: &[String]) -> bool {
        self.room.as_deref().is_some_and(|own| rooms.contains(&symbol(own)))
    }

    /// True if a point lies over the outline, widened by a margin in metres.
    pub(crate) fn covers(&self, point: &Point3<f64>, margin_m: f64) -> bool {
        is_over(&self.outline, &self.up, point, margin_m)
    }

    /// True if a point belongs to a wall of the surface's room, or lies beyond; `blur_m`: extra
    /// wall thickness by blur, metres.
    pub(crate) fn is_of_wall(&self, point: &Point3<f64>, blur_m: f64) -> bool {
        self.floor.len() >= 3 && !is_over(&self.floor, &Vector3::z(), point, -WALL_M - blur_m)
    }

    /// True if a point lies over the measured footprint of an object on this surface or, without a
    /// footprint, over the circle around the object's size.
    pub(crate) fn is_of(&self, track: &Track, point: &Point3<f64>, margin_m: f64) -> bool {
        if track.footprint_m.len() >= 3 {
            return is_over(&track.footprint_m, &self.up, point, margin_m);
        }
        let d = point - track.position_m;
        let aside_m = (d - self.up * d.dot(&self.up)).norm();
        aside_m < track.size_m[0].max(track.size_m[1]) / 2.0 + margin_m
    }
}

/// True if a point lies over a convex outline (anticlockwise from above), widened by a margin in
/// metres.
fn is_over(outline: &[Point3<f64>], up: &Vector3<f64>, point: &Point3<f64>, margin_m: f64) -> bool {
    let n = outline.len();
    n >= 3
        && (0..n).all(|i| {
            let (a, b) = (outline[i], outline[(i + 1) % n]);
            let inward = up.cross(&(b - a));
            inward.dot(&(point - a)) >= -margin_m * inward.norm()
        })
}
