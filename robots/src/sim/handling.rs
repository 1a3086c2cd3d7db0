//! Arm of the simulated body: pushing, grasping, placing, opening doors.

use crate::body::{
    Grasp, Grasped, Opened, Placed, Placing, Pose2, Poured, Pouring, Progress, Push, Pushed, Robot, Watch,
};
use crate::failure::Failure;
use crate::request::{Answer, Request};
use crate::sim::body::{HAND_OPENING_M, REACH_M};
use crate::sim::faults::FaultKind;
use crate::sim::hand::{self, NoPlace, Taken};
use crate::sim::push::{self, Effect};
use crate::sim::robot::{SimRobot, cancelled, timed_out};
use crate::sim::state::State;
use nalgebra::{Point2, Point3};
use rand::Rng;

/// Duration of a push without the motion in contact, seconds.
const PUSH_S: f64 = 8.0;
/// Speed of the hand while it pushes, metres a second.
const HAND_M_S: f64 = 0.1;
/// Share of the requested distance below which a push that ends early is reported as slipped.
const SLIPPED_SHARE: f64 = 0.5;
/// Duration of a grasp, from the first move of the arm until the object is lifted, seconds.
const GRASP_S: f64 = 12.0;
/// Duration of a placement, from the first move of the arm until the hand is withdrawn, seconds.
const PLACE_S: f64 = 10.0;
/// Duration of a pour, from the first move of the arm until the vessel is upright again, seconds.
const POUR_S: f64 = 8.0;
/// Duration of opening a door, seconds.
const DOOR_S: f64 = 6.0;
/// Maximum distance of the base from the centre of a door to open it, metres.
const DOOR_REACH_M: f64 = 1.2;
/// Probability that the hand slips off a door.
const DOOR_SLIP_CHANCE: f64 = 0.08;
/// Time between two moments at which the arm can be stopped, seconds.
const WORK_STEP_S: f64 = 0.5;

fn unreachable(because: impl Into<String>) -> Failure {
    Failure::Unreachable { because: because.into() }
}

fn slipped(because: impl Into<String>) -> Failure {
    Failure::Slipped { because: because.into(), moved_m: 0.0 }
}

fn unable(because: impl Into<String>) -> Failure {
    Failure::Unable { because: because.into() }
}

/// Checks that a target of the arm is finite, within its reach and not behind a wall.
fn in_reach(state: &State, what: &str, at: &Point3<f64>) -> Result<(), Failure> {
    let reach_m = (at.xy() - state.estimate.point()).norm();
    if reach_m <= REACH_M && at.z.is_finite() {
        let really = state.truth_from_estimate() * at;
        let base = state.map_from_base().translation;
        return match state.scene.is_between(&Point3::new(base.x, base.y, really.z), &really) {
            true => Err(unreachable(format!("there is a wall before {what}"))),
            false => Ok(()),
        };
    }
    if !(reach_m.is_finite() && at.z.is_finite()) {
        return Err(unreachable(format!("{at} is no place for {what}")));
    }
    Err(unreachable(format!("{what} is {reach_m:.2} m away and the arm reaches {REACH_M:.2} m")))
}

impl SimRobot {
    /// Carries out a request of the arm.
    pub(super) async fn handle(&self, request: &Request, watch: &Watch<'_>) -> Result<Answer, Failure> {
        match request {
            Request::PushAside(push) => self.push(push, watch).map(Answer::Pushed),
            Request::OpenDoor(door) => self.open(door, watch).await.map(Answer::Opened),
            Request::Grasp(grasp) => self.take(grasp, watch).await.map(Answer::Grasped),
            Request::Place(placing) => self.put(placing, watch).await.map(Answer::Placed),
            Request::Pour(pouring) => self.pour(pouring, watch).await.map(Answer::Poured),
            other => Err(other.beyond(self.description())),
        }
    }

    fn push(&self, push: &Push, watch: &Watch<'_>) -> Result<Pushed, Failure> {
        let mut state = self.lock();
        if state.held().is_some() {
            return Err(unable("the hand is full"));
        }
        in_reach(&state, "the object", &push.object)?;
        if !push.is_definite() {
            return Err(unreachable("a push needs a direction and a distance"));
        }
        let needed_s = PUSH_S + push.distance_m / HAND_M_S;
        if needed_s > watch.time_limit_s {
            state.pass(watch.time_limit_s);
            return Err(timed_out("the push, before the hand touched anything,", watch.time_limit_s));
        }
        let really = state.truth_from_estimate();
        let at = really * push.object;
        let direction = (really.rotation * push.direction.push(0.0)).xy();
        let State { scene, rng, .. } = &mut *state;
        let effect = push::push(scene, &at, &direction, push.distance_m, rng);
        let Effect::Moved { object, moved_m, stopped } = effect else {
            state.pass(PUSH_S);
            return Err(slipped("the hand met nothing there"));
        };
        let duration_s = PUSH_S + moved_m / HAND_M_S;
        state.pass(duration_s);
        let name = state.scene.objects[object].name.clone();
        state.note(format!("the hand pushes \"{name}\" by {moved_m:.3} m"));
        match stopped {
            Some(why) if moved_m < SLIPPED_SHARE * push.distance_m => {
                Err(Failure::Slipped { because: format!("{why} after {moved_m:.2} m"), moved_m })
            }
            _ => Ok(Pushed { moved_m, duration_s }),
        }
    }

    /// Lets the arm work for a duration in seconds, unless the request is cancelled or its time limit passes.
    async fn work(&self, what: &str, seconds: f64, watch: &Watch<'_>) -> Result<(), Failure> {
        let mut elapsed_s = 0.0;
        while elapsed_s < seconds {
            if watch.cancel.is_cancelled() {
                return Err(cancelled(what, elapsed_s));
            }
            let step_s = WORK_STEP_S.min(seconds - elapsed_s);
            if elapsed_s + step_s > watch.time_limit_s {
                self.lock().pass((watch.time_limit_s - elapsed_s).max(0.0));
                return Err(timed_out(what, watch.time_limit_s));
            }
            self.lock().pass(step_s);
            elapsed_s += step_s;
            (watch.progress)(&Progress { elapsed_s, fraction: elapsed_s / seconds, distance_m: 0.0 });
            tokio::task::yield_now().await;
        }
        Ok(())
    }

    async fn take(&self, grasp: &Grasp, watch: &Watch<'_>) -> Result<Grasped, Failure> {
        {
            let state = self.lock();
            if state.held().is_some() {
                return Err(unable("the hand is full"));
            }
            if grasp.width_m > HAND_OPENING_M {
                let width_m = grasp.width_m;
                return Err(unable(format!("the hand opens {HAND_OPENING_M:.2} m, not {width_m:.2} m")));
            }
            if !(grasp.width_m.is_finite() && grasp.width_m > 0.0) {
                return Err(unreachable(format!("{} m is no width of an object", grasp.width_m)));
            }
            in_reach(&state, "the object", &grasp.object)?;
        }
        self.work("the grasp", GRASP_S, watch).await?;
        let mut state = self.lock();
        state.grasps += 1;
        let slips = self.is_struck(FaultKind::GraspSlips, state.grasps);
        let at = state.truth_from_estimate() * grasp.object;
        let State { scene, rng, .. } = &mut *state;
        let taken = hand::take(scene, &at, grasp.width_m, HAND_OPENING_M, slips, rng);
        let name = |state: &State, object: usize| state.scene.objects[object].name.clone();
        match taken {
            Taken::Nothing => Err(slipped("the hand closed on nothing")),
            Taken::TooWide(object) => {
                let name = name(&state, object);
                state.note(format!("\"{name}\" is too wide for the hand"));
                Err(slipped("what stands there is wider than the hand opens"))
            }
            Taken::Slid(object) => {
                let name = name(&state, object);
                state.note(format!("\"{name}\" slides out of the hand"));
                Err(slipped("it slid out of the hand"))
            }
            Taken::Held(object) => {
                let name = name(&state, object);
                state.note(format!("the hand takes \"{name}\""));
                let width_m = state.scene.objects[object].shape.width_m();
                Ok(Grasped { width_m, duration_s: GRASP_S })
            }
        }
    }

    async fn put(&self, placing: &Placing, watch: &Watch<'_>) -> Result<Placed, Failure> {
        let object = {
            let state = self.lock();
            let object = state.held().ok_or_else(|| unable("the hand is empty"))?;
            in_reach(&state, "the place", &placing.foot)?;
            object
        };
        self.work("placing", PLACE_S, watch).await?;
        let mut state = self.lock();
        let foot = state.truth_from_estimate() * placing.foot;
        let yaw_rad = Pose2::from_isometry(&state.map_from_base()).yaw_rad;
        let State { scene, rng, .. } = &mut *state;
        match hand::put(scene, object, &foot, yaw_rad, rng) {
            Ok(surface) => {
                let name = state.scene.objects[object].name.clone();
                state.note(format!("the hand puts \"{name}\" on \"{surface}\""));
                Ok(Placed { duration_s: PLACE_S })
            }
            Err(NoPlace::NoSurface) => Err(unreachable("the hand feels no surface there")),
            Err(NoPlace::Edge(surface)) => {
                Err(unreachable(format!("what the hand holds is too wide for \"{surface}\"")))
            }
            Err(NoPlace::Under(surface)) => Err(Failure::Blocked {
                because: format!("what the hand holds is too high for \"{surface}\""),
                by: Some(surface),
            }),
            Err(NoPlace::Taken) => {
                Err(Failure::Blocked { because: "something stands there".into(), by: None })
            }
        }
    }

    async fn pour(&self, pouring: &Pouring, watch: &Watch<'_>) -> Result<Poured, Failure> {
        let held = {
            let state = self.lock();
            let held = state.held().ok_or_else(|| unable("the hand is empty"))?;
            in_reach(&state, "the vessel", &pouring.over)?;
            held
        };
        self.work("pouring", POUR_S, watch).await?;
        let mut state = self.lock();
        let over = state.truth_from_estimate() * pouring.over;
        let objects = &mut state.scene.objects;
        let litres = std::mem::take(&mut objects[held].holds_l);
        let held = objects[held].name.clone();
        let Some(into) = objects.iter_mut().find(|o| o.is_in_place() && o.has_opening_at(&over)) else {
            state.note(format!("{litres:.2} l of \"{held}\" are spilt"));
            return Err(slipped("there is no vessel below"));
        };
        let (room_l, name) = (into.shape.capacity_l() - into.holds_l, into.name.clone());
        into.holds_l += litres.min(room_l);
        if litres > room_l {
            state.note(format!("{:.2} l of \"{held}\" run over \"{name}\"", litres - room_l));
            return Err(slipped("it ran over"));
        }
        state.note(format!("the hand pours {litres:.2} l of \"{held}\" into \"{name}\""));
        Ok(Poured { litres, duration_s: POUR_S })
    }

    async fn open(&self, name: &str, watch: &Watch<'_>) -> Result<Opened, Failure> {
        let door = {
            let state = self.lock();
            let door = state.door(name).ok_or_else(|| unreachable(format!("there is no door \"{name}\"")))?;
            let centre: Point2<f64> = state.scene.doors[door].doorway.centre_m;
            let off_m = (centre - state.estimate.point()).norm();
            if off_m > DOOR_REACH_M {
                return Err(unreachable(format!(
                    "\"{name}\" is {off_m:.2} m away and can be opened from {DOOR_REACH_M:.2} m"
                )));
            }
            door
        };
        self.work("opening the door", DOOR_S, watch).await?;
        let mut state = self.lock();
        if state.scene.doors[door].shut {
            if state.rng.random_bool(DOOR_SLIP_CHANCE) {
                state.note(format!("the hand slips off \"{name}\""));
                return Err(slipped("the hand slipped off the door"));
            }
            state.scene.doors[door].shut = false;
            state.note(format!("the hand opens \"{name}\""));
        }
        state.seen_shut.remove(&door);
        Ok(Opened { duration_s: DOOR_S })
    }
}
