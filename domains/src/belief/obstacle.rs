//! Objects that may hide space from every view, and how a push would move them.

use std::sync::OnceLock;

use descry_memory::belief::Track;
use descry_memory::space::Cell;
use descry_perception::nalgebra::{self, Point2, Point3, Vector3};
use descry_planner::{Call, CallError};
use descry_robots::{Place, Push};

use crate::situation::{self, Situation, holding};

/// Distance of a push, metres.
const DISTANCE_M: f64 = 0.25;
/// Depth inside an object's outline to which the hand pushes, metres.
const GRIP_M: f64 = 0.02;
/// Maximum width or height of a pushed object, metres.
const MOST_M: f64 = 0.5;
/// Margin around an object within which voxels may belong to it, metres.
const MARGIN_M: f64 = 0.03;
/// Tangent of the angle by which a sideways push is turned towards the body, so that the object leaves
/// its neighbours.
const OUTWARDS: f64 = 0.5;
/// Spacing of the positions along a push that are checked for free space, metres.
const STEP_M: f64 = 0.02;

/// Object that may be pushed aside.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// PDDL symbol.
    pub symbol: String,
    /// Identifier of the object in the belief.
    pub track: u64,
    /// Index of the surface that the obstacle stands on.
    pub on: usize,
    /// Centre of the footprint, map frame.
    pub at: Point3<f64>,
    /// Unit normal of the support.
    pub up: Vector3<f64>,
    /// Radius of the circle around the footprint, metres.
    pub radius_m: f64,
    /// Height, metres.
    pub height_m: f64,
}

impl Obstacle {
    /// True if a point lies within the upright cylinder around the obstacle, with a margin of
    /// [`MARGIN_M`].
    pub(crate) fn covers(&self, p: &Point3<f64>) -> bool {
        let d = p - self.at;
        let above = d.dot(&self.up);
        above > -MARGIN_M
            && above < self.height_m + MARGIN_M
            && (d - self.up * above).norm() < self.radius_m + MARGIN_M
    }

    /// Radius and height of the cylinder within which a push over this distance may change the
    /// scene, metres.
    pub fn reach_of_push(&self, distance_m: f64) -> (f64, f64) {
        (self.radius_m + distance_m + MARGIN_M, self.height_m + MARGIN_M)
    }
}

/// Objects that may be pushed aside: all small ones on surfaces. None while a view can settle doubt, or
/// if the body has no arm or no push is left.
pub(crate) fn all(situation: &Situation) -> Vec<Obstacle> {
    let alone = situation.doubts().into_iter().any(|doubt| doubt.can_be_settled(situation));
    let body = situation.robot.description();
    if alone || body.arm.is_none() || situation.pushes_left == 0 {
        return Vec::new();
    }
    let small = |t: &&Track| t.size_m.iter().all(|&m| m < MOST_M);
    let known = |t: &Track| {
        let on = situation.surface_of(t)?;
        Some(Obstacle {
            symbol: format!("object-{}", t.id),
            track: t.id,
            on,
            at: t.position_m,
            up: situation.surfaces[on].up,
            radius_m: 0.5 * t.size_m[0].max(t.size_m[1]),
            height_m: t.size_m[2],
        })
    };
    situation.belief.tracks.iter().filter(small).filter_map(known).collect()
}

/// Push by which a body at a candidate moves an obstacle aside: touches the facing side and moves it
/// across the line of sight and slightly towards the body, to the freer side. `None` out of the arm's
/// reach, or if that push failed before.
pub fn push(situation: &Situation, from: usize, obstacle: &Obstacle) -> Option<Push> {
    let Place::Pose(base) = &situation.candidates[from].place else { return None };
    if situation.stuck.contains(&(obstacle.track, from)) {
        return None;
    }
    let towards =
        Vector3::new(base.x_m - obstacle.at.x, base.y_m - obstacle.at.y, 0.0).try_normalize(1e-9)?;
    let touched = obstacle.at + towards * (obstacle.radius_m - GRIP_M).max(0.0);
    let object = touched + obstacle.up * (0.5 * obstacle.height_m);
    let reach_m = situation.robot.description().reach_m()?;
    if nalgebra::distance(&object.xy(), &Point2::new(base.x_m, base.y_m)) > reach_m {
        return None;
    }
    let aside = obstacle.up.cross(&towards);
    let ways = [1.0, -1.0].map(|side| (aside * side + towards * OUTWARDS).normalize());
    let in_the_way = ways.map(|way| obstructions(situation, obstacle, &touched, &way));
    let way = if in_the_way[1] < in_the_way[0] { ways[1] } else { ways[0] };
    Some(Push { object, direction: way.xy(), distance_m: DISTANCE_M })
}

/// Number of positions along a push that are off the surface or not known to be free.
fn obstructions(situation: &Situation, obstacle: &Obstacle, from: &Point3<f64>, way: &Vector3<f64>) -> usize {
    let (surface, space) = (&situation.surfaces[obstacle.on], &situation.spaces[obstacle.on]);
    let steps = ((DISTANCE_M + obstacle.radius_m) / STEP_M) as usize;
    let blocked = |place: &Point3<f64>| {
        let free = |level: f64| {
            let p = place + obstacle.up * (level * obstacle.height_m);
            obstacle.covers(&p) || space.cell(&p) == Cell::Free
        };
        !surface.covers(place, 0.0) || ![0.3, 0.6].into_iter().all(free)
    };
    (1..=steps).map(|k| from + way * (k as f64 * STEP_M)).filter(blocked).count()
}

impl Situation {
    /// Objects that may be pushed aside; none while a view can settle doubt.
    pub fn obstacles(&self) -> &[Obstacle] {
        let obstacles: &Obstacles = self.derived.get(&Obstacles::default);
        obstacles.0.get_or_init(|| all(self))
    }

    /// Index of the obstacle with a symbol.
    ///
    /// # Errors
    ///
    /// [`CallError::Failed`] if there is none.
    pub fn obstacle(&self, name: &str) -> Result<usize, CallError> {
        situation::find(
            self.obstacles().iter().map(|o| &o.symbol),
            name,
            "something that may be pushed aside",
        )
    }

    /// Index of the obstacle that the plan pushes aside before a call, from the `pushed` facts that the
    /// call reads.
    pub(crate) fn planned_push(&self, call: &Call) -> Option<usize> {
        holding(call, "pushed").find_map(|r| self.obstacle(r.arguments.first()?).ok())
    }
}

/// Cache of the obstacles of a situation.
#[derive(Default)]
struct Obstacles(OnceLock<Vec<Obstacle>>);
