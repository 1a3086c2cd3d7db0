//! Map that a body makes itself, as far as driving and looking depend on it.

use descry_perception::nalgebra::Point2;
use descry_robots::{Description, Failure, Place, Robot, Travel};

use crate::surface::KnownSurface;

/// Map that a body makes itself.
pub trait OwnMap: Send + Sync {
    /// Level surfaces to put things on, as far as they were seen.
    fn surfaces(&self) -> Vec<KnownSurface>;

    /// Travel from one place to each of the others: on this map if there is one, else on the body's own.
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

    /// The places to drive to one after the other on the way on this map; none without a map, or where no way leads.
    fn way(&self, from: &Place, to: &Place) -> Option<Vec<Place>>;

    /// True if routes are planned on the floor of this map.
    fn has_ways(&self) -> bool;

    /// True if a surface is one of this map.
    fn has(&self, surface: &str) -> bool;

    /// True if a wall or a pillar of this map stands between two places.
    fn hides(&self, from: &Point2<f64>, to: &Point2<f64>) -> bool;

    /// Sentence about frontiers of the map, where unseen floor begins without a wall; none if there is no
    /// frontier, or nothing was mapped.
    fn goes_on(&self, body: &Description) -> Option<String>;
}

/// No map of the body's own making: ways are those of the body.
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
