//! Changing state of the simulated room.

use crate::body::{Pose2, Stamp};
use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::head::Gaze;
use crate::route::Route;
use crate::sim::arrange::fits;
use crate::sim::drive::{self, Localisation};
use crate::sim::faults::{Fault, FaultKind};
use crate::sim::outline::upright;
use crate::sim::routes::{Doors, Routes};
use crate::sim::scene::{ObstacleSpec, SurfaceSpec, headroom_m};
use crate::sim::world::{HungDoor, MAP_RESOLUTION_M, Scene, Stand};
use crate::truth::Event;
use descry_perception::laser::Scan;
use nalgebra::{Isometry3, Point2, Point3, Translation3, Vector2, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Range of the base's safety scanner, metres; obstacles beyond it are not added to the map.
const SCANNER_M: f64 = 0.8;
/// Range within which laser hits are added to the body's map, metres.
const NOTICED_M: f64 = 2.5;
/// Distance from a mapped wall or surface, metres, within which laser hits are not added.
const NEAR_WALL_M: f64 = 0.2;
/// Distance from an unreachable goal within which other goals count as unreachable too, metres.
const SAME_GOAL_M: f64 = 0.1;
/// Maximum number of places tried for an object that someone moves.
const MOVE_TRIES: usize = 40;

/// State of the simulator that changes during a run.
pub(crate) struct State {
    pub scene: Scene,
    pub now_ns: Stamp,
    pub events: Vec<Event>,
    pub rng: ChaCha8Rng,
    pub routes: Routes,
    /// Doors that stopped the base and were not opened since, as the body knows them.
    pub seen_shut: Doors,
    pub estimate: Pose2,
    /// `estimate = truth · error`: an error in the body's own frame.
    pub error: Isometry3<f64>,
    pub gaze: Gaze,
    pub drives: u64,
    pub frames: u64,
    pub grasps: u64,
    pub unreachable: Vec<Pose2>,
    /// Obstacles that the body's map does not show.
    pub unknown: Vec<ObstacleSpec>,
}

/// Reason for which a drive ends early: a person, slipping wheels, an obstacle or a shut door (by index).
pub(crate) enum End {
    Person,
    Stuck,
    Obstacle(usize),
    Door(usize),
}

impl State {
    /// True pose of the base.
    pub fn map_from_base(&self) -> Isometry3<f64> {
        self.really(&self.estimate)
    }

    /// True pose of the base when the estimated one is `estimate`.
    fn really(&self, estimate: &Pose2) -> Isometry3<f64> {
        estimate.isometry() * self.error.inverse()
    }

    /// Transform from map points as the body states them to true map points.
    pub fn truth_from_estimate(&self) -> Isometry3<f64> {
        self.map_from_base() * self.estimate.isometry().inverse()
    }

    pub fn pass(&mut self, seconds: f64) {
        self.now_ns += (seconds * 1e9).round() as Stamp;
    }

    /// Carries out one step of a drive.
    pub fn follow(&mut self, step: &drive::DriveStep) {
        self.pass(step.seconds);
        self.estimate = step.pose;
    }

    pub fn note(&mut self, what: impl Into<String>) {
        self.events.push(Event { stamp_ns: self.now_ns, what: what.into() });
    }

    /// Rejects a goal close to one that could not be reached.
    pub fn known_unreachable(&self, goal: &Pose2) -> Result<(), Failure> {
        let same = |tried: &&Pose2| (tried.point() - goal.point()).norm() <= SAME_GOAL_M;
        match self.unreachable.iter().find(same) {
            Some(tried) => Err(Failure::Unreachable {
                because: format!("({:.2}, {:.2}) was tried and could not be reached", tried.x_m, tried.y_m),
            }),
            None => Ok(()),
        }
    }

    /// Index of the first step that brings the footprint into an unmapped obstacle, and the obstacle's index.
    /// Only steps towards an obstacle count, and no turns: a turn on the spot shifts the modelled true
    /// position of a base with a wrong estimate, although the base does not move.
    pub fn first_bump(&self, steps: &[drive::DriveStep], radius_m: f64) -> Option<(usize, usize)> {
        let mut before = self.map_from_base().translation.vector.xy().into();
        for (i, step) in steps.iter().enumerate() {
            let at = self.really(&step.pose).translation.vector.xy().into();
            let bumps = |o: &ObstacleSpec| {
                let nears = step.metres > 0.0 && o.distance_m(&at) < o.distance_m(&before);
                o.touches(&at, radius_m) && nears
            };
            if let Some(obstacle) = self.unknown.iter().position(bumps) {
                return Some((i, obstacle));
            }
            before = at;
        }
        None
    }

    /// Index of the object in the hand, if any.
    pub fn held(&self) -> Option<usize> {
        self.scene.objects.iter().position(|o| o.stands == Stand::Hand)
    }

    /// Index of the door of this name, if there is one.
    pub fn door(&self, name: &str) -> Option<usize> {
        self.scene.doors.iter().position(|d| d.doorway.name == name)
    }

    /// Indices of the doors of these names; fails if the scene lacks one of them.
    pub fn doors(&self, names: &[String]) -> Result<Doors, Failure> {
        let known = |name: &String| {
            let because = || format!("the map has no door \"{name}\"");
            self.door(name).ok_or_else(|| Failure::Unreachable { because: because() })
        };
        names.iter().map(known).collect()
    }

    /// Route to a goal around the doors known to be shut, or up to one of them if there is no other route.
    pub fn plan(&mut self, goal: &Pose2) -> Result<Route, Failure> {
        let around = self.routes.with_shut(&self.seen_shut).route(&self.estimate, goal);
        match around {
            Err(Failure::Unreachable { .. }) if !self.seen_shut.is_empty() => {
                self.routes.with_shut(&Doors::new()).route(&self.estimate, goal)
            }
            known => known,
        }
    }

    /// Index of the first step that brings the footprint into a shut door, and the door's index. The base
    /// detects doors where its map has them, so the estimated pose counts.
    pub fn first_shut_door(&self, steps: &[drive::DriveStep], radius_m: f64) -> Option<(usize, usize)> {
        let mut before = self.estimate.point();
        for (i, step) in steps.iter().enumerate() {
            let here = step.pose.point();
            let meets = |d: &HungDoor| {
                let gap_m = d.doorway.distance_m(&here);
                d.shut && gap_m < radius_m && gap_m < d.doorway.distance_m(&before)
            };
            if let Some(door) = self.scene.doors.iter().position(meets) {
                return Some((i, door));
            }
            before = here;
        }
        None
    }

    /// Records what ended a drive: a shut door, or the scanned part of an obstacle, which is drawn into the
    /// body's map by the estimated pose.
    pub fn learn(&mut self, end: &End) {
        let obstacle = match end {
            End::Door(door) => {
                self.seen_shut.insert(*door);
                return;
            }
            End::Obstacle(obstacle) => self.unknown.get(*obstacle),
            End::Person | End::Stuck => None,
        };
        let Some(obstacle) = obstacle.cloned() else { return };
        let (here, really) = (self.estimate.point(), self.truth_from_estimate());
        self.routes.occupy(|p| {
            let there = (really * Point3::new(p.x, p.y, 0.0)).xy();
            (p - here).norm() <= SCANNER_M && obstacle.touches(&there, 0.5 * MAP_RESOLUTION_M)
        });
    }

    /// Adds nearby laser hits to the body's map where `map` shows no obstacle.
    pub fn notice(&mut self, scan: &Scan, map: &OccupancyGrid) {
        let on_map = |p: &Point2<f64>| {
            (-1..=1).any(|i| {
                (-1..=1)
                    .any(|k| map.is_occupied(&(p + Vector2::new(f64::from(i), f64::from(k)) * NEAR_WALL_M)))
            })
        };
        let met = (0..scan.ranges_m.len()).filter(|&i| scan.ranges_m[i] <= NOTICED_M);
        let met: Vec<Point2<f64>> = met
            .filter_map(|i| scan.endpoint(i))
            .map(|end| scan.map_from_laser * end)
            .filter(|p| !on_map(p))
            .collect();
        if !met.is_empty() {
            self.routes.occupy(|cell| met.iter().any(|p| (p - cell).amax() <= 0.5 * MAP_RESOLUTION_M));
        }
    }

    /// Stops near the intended pose `wanted`: draws the stopping error and the error of the estimate, a large
    /// one if `misled`.
    pub fn stop(&mut self, wanted: &Pose2, localisation: &Localisation, misled: bool) {
        self.estimate = localisation.stop(wanted, &mut self.rng);
        self.error = localisation.error(&mut self.rng);
        if misled {
            self.error = Localisation::bad_error(&mut self.rng);
            self.note("localisation is 10 cm and 6° off");
        }
    }

    /// Lets someone take, relocate or move an object, as the fault says.
    pub fn disturb(&mut self, fault: &Fault) {
        let present: Vec<usize> =
            (0..self.scene.objects.len()).filter(|&i| self.scene.objects[i].is_in_place()).collect();
        let chosen = match &fault.object {
            Some(name) => present
                .into_iter()
                .find(|&i| &self.scene.objects[i].name == name || &self.scene.objects[i].kind == name),
            None if present.is_empty() => None,
            None => Some(present[self.rng.random_range(0..present.len())]),
        };
        let Some(i) = chosen else {
            self.note("somebody found nothing to take or move");
            return;
        };
        let name = self.scene.objects[i].name.clone();
        if fault.kind == FaultKind::ObjectTaken {
            self.scene.objects[i].stands = Stand::Away;
            self.note(format!("somebody takes \"{name}\" away"));
        } else if fault.kind == FaultKind::ObjectRelocated {
            match self.relocate_object(i, fault.to.as_deref()) {
                Some(surface) => self.note(format!("somebody puts \"{name}\" on \"{surface}\"")),
                None => self.note(format!("somebody wants to put \"{name}\" elsewhere and finds no room")),
            }
        } else if self.move_object(i, fault.by_m) {
            self.note(format!("somebody moves \"{name}\" by {:.2} m", fault.by_m));
        } else {
            self.note(format!("somebody wants to move \"{name}\" and finds no room"));
        }
    }

    /// Drops the held object to the floor where the base was at the estimated pose `on_the_way`; if `None`,
    /// at the current place.
    pub fn drop_held(&mut self, on_the_way: Option<&Pose2>) {
        let Some(i) = self.held() else { return };
        let at = on_the_way.map_or(self.map_from_base(), |pose| self.really(pose)).translation;
        let o = &mut self.scene.objects[i];
        o.stands = Stand::Floor;
        o.map_from_object = upright(at.x, at.y, 0.0, 0.0);
        let name = o.name.clone();
        self.note(format!("\"{name}\" falls out of the hand"));
    }

    /// Lets someone shut a door in which the base does not stand.
    pub fn shut_a_door(&mut self, fault: &Fault, radius_m: f64) {
        let here = self.map_from_base().translation.vector.xy().into();
        let free = |d: &HungDoor| !d.shut && d.doorway.distance_m(&here) > radius_m;
        let open: Vec<usize> = (0..self.scene.doors.len()).filter(|&i| free(&self.scene.doors[i])).collect();
        let chosen = match &fault.door {
            Some(name) => open.into_iter().find(|&i| &self.scene.doors[i].doorway.name == name),
            None if open.is_empty() => None,
            None => Some(open[self.rng.random_range(0..open.len())]),
        };
        let Some(i) = chosen else {
            self.note("somebody found no door to shut");
            return;
        };
        self.scene.doors[i].shut = true;
        self.note(format!("somebody shuts \"{}\"", self.scene.doors[i].doorway.name));
    }

    /// Moves an object to a random place on another surface, or on the one named `to`; returns the surface's
    /// name, `None` without room.
    fn relocate_object(&mut self, i: usize, to: Option<&str>) -> Option<String> {
        let o = &self.scene.objects[i];
        let goes = |s: &&SurfaceSpec| {
            let wanted = to.map_or(o.surface() != Some(s.name.as_str()), |to| s.name == to);
            wanted && o.shape.height_m() <= headroom_m(&self.scene.surfaces, s)
        };
        let others: Vec<SurfaceSpec> = self.scene.surfaces.iter().filter(goes).cloned().collect();
        for _ in 0..if others.is_empty() { 0 } else { MOVE_TRIES } {
            let surface = &others[self.rng.random_range(0..others.len())];
            let [x, y] = surface.size_m.map(|s| s * (self.rng.random::<f64>() - 0.5));
            let mut moved = self.scene.objects[i].clone();
            moved.stands = Stand::On(surface.name.clone());
            let yaw_rad = self.rng.random_range(0.0..std::f64::consts::TAU);
            moved.map_from_object = surface.map_from_top() * upright(x, y, 0.0, yaw_rad);
            if fits(&moved, surface, self.scene.objects.iter(), 0.0) {
                self.scene.objects[i] = moved;
                return Some(surface.name.clone());
            }
        }
        None
    }

    fn move_object(&mut self, i: usize, by_m: f64) -> bool {
        let surface = self.scene.objects[i].surface().and_then(|s| self.scene.surface(s)).cloned();
        let Some(surface) = surface else { return false };
        for _ in 0..MOVE_TRIES {
            let angle = self.rng.random_range(0.0..std::f64::consts::TAU);
            let step = Vector3::new(by_m * angle.cos(), by_m * angle.sin(), 0.0);
            let mut moved = self.scene.objects[i].clone();
            moved.map_from_object = Translation3::from(step) * moved.map_from_object;
            if fits(&moved, &surface, self.scene.objects.iter(), 0.0) {
                self.scene.objects[i] = moved;
                return true;
            }
        }
        false
    }
}
