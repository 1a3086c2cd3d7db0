//! Interface to a map of the body's own making, as far as driving and looking need it.

use descry_perception::nalgebra::Point2;
use descry_robots::{Description, Failure, Place, Robot, Travel};

use crate::surface::KnownSurface;

/// Map of a body's own making.
pub trait OwnMap: Send + Sync {
    /// Level supporting surfaces, as observed.
    fn surfaces(&self) -> Vec<KnownSurface>;

    /// Travel times from one place to others: on the own map if there is one, else by the body.
    ///
    /// # Errors
    /// Each entry by itself, as [`Robot::travel`].
    fn travel(
        &self,
        robot: &dyn Robot,
        from: &Place,
        to: &[Place],
        shut: &[String],
    ) -> Vec<Result<Travel, Failure>>;

    /// Waypoints of a route on the own map; `None` without a map or route.
    fn way(&self, from: &Place, to: &Place) -> Option<Vec<Place>>;

    /// True if routes are planned on the floor of this map.
    fn has_ways(&self) -> bool;

    /// True if a surface is on this map.
    fn has(&self, surface: &str) -> bool;

    /// True if a wall or pillar of this map stands between two points.
    fn hides(&self, from: &Point2<f64>, to: &Point2<f64>) -> bool;

    /// Sentence about frontiers of the map, where unobserved floor begins without a wall; `None`
    /// without frontiers or map.
    fn goes_on(&self, body: &Description) -> Option<String>;
}

/// Absent own map: routes come from the body.
pub struct NoMap;

impl OwnMap for NoMap {
    fn surfaces(&self) -> Vec<KnownSurface> {
        Vec::new()
    }

    fn travel(
        &self,
        robot: &dyn Robot,
        from: &Place,
        to: &[Place],
        shut: &[String],
    ) -> Vec<Result<Travel, Failure>> {
        robot.travel(from, to, shut)
    }

    fn way(&self, _: &Place, _: &Place) -> Option<Vec<Place>> {
        None
    }

    fn has_ways(&self) -> bool {
        false
    }

    fn has(&self, _: &str) -> bool {
        false
    }

    fn hides(&self, _: &Point2<f64>, _: &Point2<f64>) -> bool {
        false
    }

    fn goes_on(&self, _: &Description) -> Option<String> {
        None
    }
}
