//! What changes in the simulated room while it runs.

use crate::body::{Pose2, Speeds, Stamp};
use crate::failure::Failure;
use crate::head::Gaze;
use crate::route::Router;
use crate::sim::arrange::fits;
use crate::sim::drive::{self, Localisation};
use crate::sim::faults::{Fault, FaultKind};
use crate::sim::truth::Event;
use crate::sim::world::{MAP_RESOLUTION_M, Scene};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// What stops the base is seen by its own scanner up to this far around it, metres.
const SCANNER_M: f64 = 0.8;
/// Goals within this distance of one that was found unreachable are unreachable too, metres.
const SAME_GOAL_M: f64 = 0.1;
/// Directions tried for an object that somebody moves.
const MOVE_TRIES: usize = 40;

/// The changing part of the simulator.
pub(crate) struct State {
    pub scene: Scene,
    pub now_ns: Stamp,
    pub events: Vec<Event>,
    pub rng: ChaCha8Rng,
    pub router: Arc<Router>,
    pub estimate: Pose2,
    /// `estimate = truth · error`: wrong in the body's own frame.
    pub error: Isometry3<f64>,
    pub gaze: Gaze,
    pub drives: u64,
    pub frames: u64,
    pub unreachable: Vec<Pose2>,
}

/// What ends a drive on its way.
pub(crate) enum End {
    Person,
    Stuck,
    Obstacle(usize),
}

impl State {
    /// Where the base really is.
    pub fn map_from_base(&self) -> Isometry3<f64> {
        self.really(&self.estimate)
    }

    /// Where the base really is when it believes to be at `estimate`.
    fn really(&self, estimate: &Pose2) -> Isometry3<f64> {
        estimate.isometry() * self.error.inverse()
    }

    /// `truth_from_estimate` for points of the map that the body names.
    pub fn truth_from_estimate(&self) -> Isometry3<f64> {
        self.map_from_base() * self.estimate.isometry().inverse()
    }

    pub fn pass(&mut self, seconds: f64) {
        self.now_ns += (seconds * 1e9).round() as Stamp;
    }

    /// Does one step of a drive.
    pub fn follow(&mut self, step: &drive::Step) {
        self.pass(step.seconds);
        self.estimate = step.pose;
    }

    pub fn note(&mut self, what: impl Into<String>) {
        self.events.push(Event { stamp_ns: self.now_ns, what: what.into() });
    }

    /// Checks a goal against those that were tried in vain.
    pub fn known_unreachable(&self, goal: &Pose2) -> Result<(), Failure> {
        let same = |tried: &&Pose2| (tried.point() - goal.point()).norm() <= SAME_GOAL_M;
        match self.unreachable.iter().find(same) {
            Some(tried) => Err(Failure::Unreachable {
                because: format!("({:.2}, {:.2}) was tried and could not be reached", tried.x_m, tried.y_m),
            }),
            None => Ok(()),
        }
    }

    /// The first step at which the footprint touches something that the map does not show, and which obstacle that is.
    pub fn first_bump(&self, steps: &[drive::Step], radius_m: f64) -> Option<(usize, usize)> {
        steps.iter().enumerate().find_map(|(i, step)| {
            let at = self.really(&step.pose).translation.vector.xy().into();
            let bumps = |o: &&crate::sim::scene::ObstacleSpec| !o.on_map && o.touches(&at, radius_m);
            let obstacle = self.scene.obstacles.iter().position(|o| bumps(&o))?;
            Some((i, obstacle))
        })
    }

    /// Draws on the body's own map what its scanner sees of an obstacle, placed by where the body believes to be.
    pub fn learn_obstacle(&mut self, obstacle: usize, radius_m: f64, speeds: Speeds) {
        let Some(obstacle) = self.scene.obstacles.get(obstacle) else { return };
        let (here, really) = (self.estimate.point(), self.truth_from_estimate());
        let mut grid = self.router.map().clone();
        grid.occupy(|p| {
            let there = (really * Point3::new(p.x, p.y, 0.0)).xy();
            (p - here).norm() <= SCANNER_M && obstacle.touches(&there, 0.5 * MAP_RESOLUTION_M)
        });
        self.router = Arc::new(Router::new(&grid, radius_m, speeds));
    }

    /// Stops where the base means to be; draws by how much it misses that and by how much it is wrong about where it is.
    pub fn stop(&mut self, wanted: &Pose2, localisation: &Localisation, misled: bool) {
        self.estimate = localisation.stop(wanted, &mut self.rng);
        self.error = localisation.error(&mut self.rng);
        if misled {
            self.error = Localisation::bad_error(&mut self.rng);
            self.note("localisation is 10 cm and 6° off");
        }
    }

    /// Somebody takes or moves an object.
    pub fn disturb(&mut self, fault: &Fault) {
        let present: Vec<usize> =
            (0..self.scene.objects.len()).filter(|&i| self.scene.objects[i].present).collect();
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
            self.scene.objects[i].present = false;
            self.note(format!("somebody takes \"{name}\" away"));
        } else if self.move_object(i, fault.by_m) {
            self.note(format!("somebody moves \"{name}\" by {:.2} m", fault.by_m));
        } else {
            self.note(format!("somebody wants to move \"{name}\" and finds no room"));
        }
    }

    fn move_object(&mut self, i: usize, by_m: f64) -> bool {
        let surface = self.scene.surfaces.iter().find(|s| s.name == self.scene.objects[i].surface).cloned();
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
