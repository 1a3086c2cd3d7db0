//! Map of the simulated body, with a router for each set of shut doors.

use crate::grid::OccupancyGrid;
use crate::parts::Speeds;
use crate::route::Router;
use crate::sim::scene::Doorway;
use crate::sim::world::MAP_RESOLUTION_M;
use nalgebra::Point2;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Maximum number of cached routers; the cache is cleared beyond that.
const MOST_ROUTERS: usize = 64;

/// Set of doors, by their indices in the scene.
pub(crate) type Doors = BTreeSet<usize>;

/// The body's own map, with a router for each set of shut doors.
pub(crate) struct Routes {
    map: OccupancyGrid,
    doors: Vec<Doorway>,
    radius_m: f64,
    speeds: Speeds,
    routers: BTreeMap<Doors, Arc<Router>>,
}

impl Routes {
    /// Creates the routes on a map for a base that needs `radius_m` of clearance.
    pub fn new(map: OccupancyGrid, doors: Vec<Doorway>, radius_m: f64, speeds: Speeds) -> Routes {
        Routes { map, doors, radius_m, speeds, routers: BTreeMap::new() }
    }

    /// Router for the map with these doors closed.
    pub fn with_shut(&mut self, shut: &Doors) -> Arc<Router> {
        if let Some(router) = self.routers.get(shut) {
            return router.clone();
        }
        let mut map = self.map.clone();
        for door in shut.iter().filter_map(|&d| self.doors.get(d)) {
            let half = door.half_m().add_scalar(0.5 * MAP_RESOLUTION_M);
            map.occupy_near(&door.centre_m, half.norm(), |p| {
                let off = (p - door.centre_m).abs();
                off.x <= half.x && off.y <= half.y
            });
        }
        if self.routers.len() >= MOST_ROUTERS {
            self.routers.clear();
        }
        let router = Arc::new(Router::new(&map, self.radius_m, self.speeds));
        self.routers.insert(shut.clone(), router.clone());
        router
    }

    /// Marks as occupied the cells of the map whose centres satisfy `inside`.
    pub fn occupy(&mut self, inside: impl Fn(&Point2<f64>) -> bool) {
        self.map.occupy(inside);
        self.routers.clear();
    }
}
