//! Predictions made without asking the program: reachable places, cost of drives, poses of the camera.
//! Planning makes thousands of them.

use crate::body::{Door, Place, Pose2, Station, Travel};
use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::head;
use crate::parts::{Description, Part, Speeds};
use crate::recorded::Known;
use crate::route::Router;
use nalgebra::{Isometry3, Point2, Point3, Rotation2, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};

/// Maximum number of cached routers; the cache is cleared beyond that.
const MOST_ROUTERS: usize = 64;

/// Predictions of drives and camera poses from the map in a program's hello (its first message).
pub(super) struct Places {
    clearance_m: f64,
    /// Pose of a camera that no head turns, in the base frame.
    base_from_camera: Isometry3<f64>,
    /// Doors that ended a drive and were not opened since.
    shut: Mutex<BTreeSet<String>>,
    /// Routers by the set of doors that count as shut.
    routers: Mutex<BTreeMap<Vec<String>, Arc<Router>>>,
}

impl Places {
    /// Creates the predictions; everything is computed on demand.
    pub fn new(clearance_m: f64, base_from_camera: Isometry3<f64>) -> Self {
        Places { clearance_m, base_from_camera, shut: Mutex::default(), routers: Mutex::default() }
    }

    /// Records that a door was found shut, or open.
    pub fn met_door(&self, name: &str, is_shut: bool) {
        let mut shut = self.shut.lock().unwrap_or_else(PoisonError::into_inner);
        if is_shut {
            shut.insert(name.to_owned());
        } else {
            shut.remove(name);
        }
    }

    /// Router on the map with the doors named in `shut` closed.
    fn router(&self, known: &Known, (map, speeds): (&OccupancyGrid, Speeds), shut: &[String]) -> Arc<Router> {
        let mut key = shut.to_vec();
        key.sort_unstable();
        key.dedup();
        let mut routers = self.routers.lock().unwrap_or_else(PoisonError::into_inner);
        if routers.len() >= MOST_ROUTERS {
            routers.clear();
        }
        let make = || {
            let mut map = map.clone();
            for door in known.doors.iter().filter(|d| shut.contains(&d.name)) {
                close(&mut map, door);
            }
            let d = &known.description;
            Arc::new(Router::new(&map, d.radius_m() + self.clearance_m, speeds))
        };
        Arc::clone(routers.entry(key).or_insert_with(make))
    }

    /// Predicts the cost of drives, as [`Robot::travel`](crate::Robot::travel).
    pub fn travel(
        &self,
        known: &Known,
        from: &Place,
        to: &[Place],
        shut: &[String],
    ) -> Vec<Result<Travel, Failure>> {
        let from = match stand(known, from) {
            Ok(pose) => pose,
            Err(failure) => return to.iter().map(|_| Err(failure.clone())).collect(),
        };
        let goals: Vec<_> = to.iter().map(|place| stand(known, place)).collect();
        let Some(floor) = floor(known) else {
            return goals.into_iter().map(|goal| Ok(straight(&known.description, &from, &goal?))).collect();
        };
        let nowhere = Isometry3::translation(f64::NAN, f64::NAN, 0.0);
        let poses: Vec<Pose2> =
            goals.iter().map(|g| Pose2::from_isometry(g.as_ref().unwrap_or(&nowhere))).collect();
        let found = self.router(known, floor, shut).travel_to_each(&Pose2::from_isometry(&from), &poses);
        goals.into_iter().zip(found).map(|(goal, travel)| goal.and(travel)).collect()
    }

    /// Finds the route for the base to a place, metres: around the doors known to be shut, or up to one of
    /// them if there is no other route. Empty without a map or a base.
    ///
    /// # Errors
    /// [`Failure::Unreachable`] with the reason.
    pub fn route(
        &self,
        known: &Known,
        from: &Isometry3<f64>,
        to: &Place,
    ) -> Result<Vec<Point2<f64>>, Failure> {
        let goal = stand(known, to)?;
        let Some(floor) = floor(known) else { return Ok(Vec::new()) };
        let (from, goal) = (Pose2::from_isometry(from), Pose2::from_isometry(&goal));
        let shut: Vec<String> =
            self.shut.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect();
        let around = self.router(known, floor, &shut).route(&from, &goal);
        let found = if shut.is_empty() {
            around
        } else {
            around.or_else(|_| self.router(known, floor, &[]).route(&from, &goal))
        };
        Ok(found?.points_m)
    }

    /// Predicts the camera's pose, as [`Robot::camera_at`](crate::Robot::camera_at).
    pub fn camera_at(
        &self,
        known: &Known,
        place: &Place,
        look_at: Option<&Point3<f64>>,
    ) -> Result<Isometry3<f64>, Failure> {
        known.description.need(Part::Camera)?;
        let base = stand(known, place)?;
        let turned = known.description.head.as_ref().map(|h| head::camera_towards(h, &base, look_at));
        Ok(turned.unwrap_or(base * self.base_from_camera))
    }

    /// Angle between the axis of a camera that no head turns and a point in the map, radians.
    pub fn miss_rad(&self, map_from_base: &Isometry3<f64>, point: &Point3<f64>) -> f64 {
        let seen = (map_from_base * self.base_from_camera).inverse_transform_point(point);
        seen.coords.angle(&Vector3::z())
    }
}

/// Map and speeds for driving; `None` without a map or a base.
fn floor(known: &Known) -> Option<(&OccupancyGrid, Speeds)> {
    Some((known.map.as_ref()?, known.description.base.as_ref()?.speeds))
}

/// Pose of the base at a place, in the map.
///
/// # Errors
/// [`Failure::Unreachable`] for an unknown station, a pose where only stations exist, and numbers that are
/// not finite.
pub(super) fn stand(known: &Known, place: &Place) -> Result<Isometry3<f64>, Failure> {
    let name = &known.description.name;
    let because = match (place, known.stations.as_deref()) {
        (Place::Station(wanted), stations) => {
            let found = stations.unwrap_or_default().iter().find(|s| &s.name == wanted);
            match found {
                Some(Station { map_from_base, .. }) => return Ok(*map_from_base),
                None => format!("{name} has no station \"{wanted}\""),
            }
        }
        (Place::Pose(_), Some(stations)) => {
            format!("{name} can stand at its {} stations only", stations.len())
        }
        (Place::Pose(p), None) if ![p.x_m, p.y_m, p.yaw_rad].iter().all(|x| x.is_finite()) => {
            format!("({}, {}, {} rad) is no pose", p.x_m, p.y_m, p.yaw_rad)
        }
        (Place::Pose(p), None) => return Ok(p.isometry()),
    };
    Err(Failure::Unreachable { because })
}

/// Cost of a straight drive at constant speed while turning.
fn straight(body: &Description, from: &Isometry3<f64>, to: &Isometry3<f64>) -> Travel {
    let distance_m = (from.translation.vector - to.translation.vector).norm();
    let turned_rad = from.rotation.angle_to(&to.rotation);
    Travel { distance_m, duration_s: body.duration_s(distance_m, turned_rad) }
}

/// Marks a door's opening in the map as occupied, one cell deep to either side of the wall's middle.
fn close(map: &mut OccupancyGrid, door: &Door) {
    let door_from_map = Rotation2::new(-door.along_rad);
    let (half_width_m, half_depth_m) = (0.5 * door.width_m, map.resolution_m);
    map.occupy(|p| {
        let local = door_from_map * (p - door.centre_m);
        local.x.abs() <= half_width_m && local.y.abs() <= half_depth_m
    });
}
