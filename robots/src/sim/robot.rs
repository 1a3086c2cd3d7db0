//! The simulated body in its room.

use crate::body::{
    CancellationToken, Colour, Door, Driven, Hand, Looked, Place, Pose2, PoseEstimate, Progress, Robot, Room,
    Scanned, Sensed, Stamp, StampedTransform, Station, SurfaceHint, Travel, Watch,
};
use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::head::{self, Gaze};
use crate::parts::{Camera, Description};
use crate::request::{Answer, Request};
use crate::sim::body::{self, HEAD, HEAD_SPEED_RAD_S, RADIUS_M, SAFETY_M, SPEEDS};
use crate::sim::drive::{self, Localisation};
use crate::sim::faults::{Fault, FaultKind, FaultPlan};
use crate::sim::frame::Frame;
use crate::sim::laser::{self, LaserModel};
use crate::sim::noise::{self, DepthNoise};
use crate::sim::render::{render, visible_share};
use crate::sim::routes::{Doors, Routes};
use crate::sim::scene::{RoomSpec, SurfaceSpec};
use crate::sim::state::{End, State};
use crate::sim::world::{LABEL_OBJECT, LABEL_ROOM, Scene};
use crate::truth::Truth;
use nalgebra::{Isometry3, Point3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Time from the trigger to the camera frame, seconds.
const FRAME_S: f64 = 0.1;

/// Time from the trigger to the laser sweep, seconds.
const SWEEP_S: f64 = 0.03;

/// Options of the simulator besides the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SimOptions {
    /// Seed of noise, localisation and faults. The arrangement has a separate seed.
    pub seed: u64,
    /// Injected faults.
    pub faults: FaultPlan,
    /// Accuracy of localisation.
    pub localisation: Localisation,
    /// Noise of the camera.
    pub noise: DepthNoise,
    /// The laser.
    pub laser: LaserModel,
}

/// A simulated body in a scene. [`SimRobot::truth`] gives the ground truth; the [`Robot`] trait exposes only
/// what a real body would.
pub struct SimRobot {
    description: Description,
    camera: Camera,
    options: SimOptions,
    map: OccupancyGrid,
    surfaces: Vec<SurfaceHint>,
    rooms: Vec<Room>,
    doors: Vec<Door>,
    mapped: bool,
    state: Mutex<State>,
}

/// A planned drive, before the base moves.
struct Departure {
    number: u64,
    steps: Vec<drive::DriveStep>,
    /// Number of steps after which the drive ends early, and the reason; `None` if the base arrives.
    end: Option<(usize, End)>,
}

/// Result of a drive: the last pose reached, time, distance, and the failure if the drive ended early.
struct Trip {
    at: Option<Pose2>,
    elapsed_s: f64,
    distance_m: f64,
    /// Number of completed steps.
    done: usize,
    failure: Option<Failure>,
}

impl SimRobot {
    /// Puts the body at the start of a scene.
    pub fn new(scene: Scene, mut options: SimOptions) -> SimRobot {
        if scene.visit > 1 {
            // Nobody errs the same way in every visit.
            options.seed = noise::mix(options.seed ^ scene.visit as u64);
        }
        let mut description = body::description();
        description.pose_sigma_m = options.localisation.sigma_m;
        description.pose_sigma_rad = options.localisation.sigma_rad;
        description.laser = Some(options.laser.part());
        let map = scene.known_map();
        let doorways = scene.doors.iter().map(|d| d.doorway.clone()).collect();
        let routes = Routes::new(map.clone(), doorways, RADIUS_M + SAFETY_M, SPEEDS);
        let hint = |s: &SurfaceSpec| SurfaceHint {
            name: s.name.clone(),
            outline_m: s.outline_m(),
            height_m: s.height_m,
            room: scene.room_at(&s.centre_m()).map(String::from),
        };
        let is_known = |_: &usize| scene.mapped;
        let known = |count: usize| (0..count).filter(is_known);
        let surfaces = known(scene.surfaces.len()).map(|i| hint(&scene.surfaces[i])).collect();
        let room = |r: &RoomSpec| Room { name: r.name.clone(), outline_m: r.outline_m() };
        let rooms = known(scene.rooms.len()).map(|i| room(&scene.rooms[i])).collect();
        let doors = known(scene.doors.len()).map(|i| scene.doors[i].doorway.hint()).collect();
        let mut camera = body::camera();
        camera.range_m = scene.stereo.map_or(camera.range_m, |stereo| stereo.range_m);
        description.camera = Some(camera.clone());
        let mapped = scene.mapped;
        let mut rng = ChaCha8Rng::seed_from_u64(noise::mix(options.seed));
        let error = options.localisation.error(&mut rng);
        let state = State {
            now_ns: 0,
            events: Vec::new(),
            rng,
            routes,
            seen_shut: Doors::new(),
            // The scene says where the body stands, not where it believes to be.
            estimate: Pose2::from_isometry(&(scene.start.isometry() * error)),
            error,
            gaze: Gaze::default(),
            drives: 0,
            frames: 0,
            grasps: 0,
            unreachable: Vec::new(),
            unknown: scene.unknown(),
            scene,
        };
        SimRobot {
            description,
            camera,
            options,
            map,
            surfaces,
            rooms,
            doors,
            mapped,
            state: Mutex::new(state),
        }
    }

    /// True state of the scene, for scoring and reports only; no decision may read it.
    pub fn truth(&self) -> Truth {
        let state = self.lock();
        Truth::of(&state.scene, state.now_ns, &state.map_from_base(), &state.events)
    }

    /// Visible share of an object, 0 to 1, from a pose of the base with the head turned to the object; 0 if
    /// it is absent. For the oracle of experiments and for reports.
    pub fn true_visible_share(&self, object: &str, pose: &Pose2) -> f64 {
        let state = self.lock();
        let Some(index) = state.scene.objects.iter().position(|o| o.name == object && o.is_in_place()) else {
            return 0.0;
        };
        let look_at = state.scene.objects[index].centre_m();
        let map_from_camera = head::camera_towards(&HEAD, &pose.isometry(), Some(&look_at));
        let label = LABEL_OBJECT + index as u16;
        visible_share(&state.scene, label, &map_from_camera, &self.camera.intrinsics, 1).unwrap_or(0.0)
    }

    /// The ideal frame at the current time, with a label for each pixel. For reports and tests.
    pub fn true_frame(&self) -> Frame {
        let state = self.lock();
        self.render(&state)
    }

    fn render(&self, state: &State) -> Frame {
        let map_from_camera = state.map_from_base() * head::base_from_camera(&HEAD, &state.gaze);
        let solids = state.scene.solids();
        render(&state.scene.room, &solids, &map_from_camera, &self.camera.intrinsics, state.now_ns)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn pose_of(&self, place: &Place) -> Result<Pose2, Failure> {
        match place {
            Place::Pose(pose) => Ok(*pose),
            Place::Station(name) => Err(Failure::Unreachable {
                because: format!("{} has no station \"{name}\"; give a pose", self.description.name),
            }),
        }
    }

    /// Faults of a kind that happen at the drive, frame or grasp of this number.
    fn strike(&self, kind: FaultKind, number: u64) -> impl Iterator<Item = &Fault> {
        self.options.faults.strike(kind, number, self.options.seed)
    }

    pub(super) fn is_struck(&self, kind: FaultKind, number: u64) -> bool {
        self.strike(kind, number).next().is_some()
    }

    fn depart(&self, goal: &Pose2) -> Result<Departure, Failure> {
        let mut state = self.lock();
        state.drives += 1;
        let number = state.drives;
        for fault in self.strike(FaultKind::DoorShut, number) {
            state.shut_a_door(fault, RADIUS_M);
        }
        let route = state.plan(goal)?;
        if self.is_struck(FaultKind::UnreachablePose, number) {
            state.note("the goal of this drive turns out to be unreachable");
            state.unreachable.push(*goal);
        }
        state.known_unreachable(goal)?;
        let steps = drive::steps(&state.estimate, &route, goal, &SPEEDS);
        let on_the_way = state.rng.random_range(0.2..0.8) * steps.len() as f64;
        let mut end = None;
        if self.is_struck(FaultKind::BlockedPath, number) {
            end = Some((on_the_way as usize, End::Person));
        } else if self.is_struck(FaultKind::TimedOutDrive, number) {
            end = Some((on_the_way as usize, End::Stuck));
        }
        if let Some((at, obstacle)) = state.first_bump(&steps, RADIUS_M)
            && end.as_ref().is_none_or(|(earlier, _)| at < *earlier)
        {
            end = Some((at, End::Obstacle(obstacle)));
        }
        if let Some((at, door)) = state.first_shut_door(&steps, RADIUS_M)
            && end.as_ref().is_none_or(|(earlier, _)| at < *earlier)
        {
            end = Some((at, End::Door(door)));
        }
        Ok(Departure { number, steps, end })
    }

    async fn travel_along(&self, departure: &Departure, watch: &Watch<'_>) -> Trip {
        let total_s: f64 = departure.steps.iter().map(|s| s.seconds).sum();
        let mut trip = Trip { at: None, elapsed_s: 0.0, distance_m: 0.0, done: 0, failure: None };
        for (i, step) in departure.steps.iter().enumerate() {
            if watch.cancel.is_cancelled() {
                trip.failure = Some(cancelled("the drive", trip.elapsed_s));
                return trip;
            }
            if let Some((_, end)) = departure.end.as_ref().filter(|(at, _)| *at == i) {
                trip.failure = Some(self.end_early(end, watch, &mut trip.elapsed_s));
                return trip;
            }
            if trip.elapsed_s + step.seconds > watch.time_limit_s {
                self.lock().pass(watch.time_limit_s - trip.elapsed_s);
                trip.failure = Some(timed_out("the drive", watch.time_limit_s));
                return trip;
            }
            // The base is there at once: who drops this future leaves it where it got to.
            self.lock().follow(step);
            trip.elapsed_s += step.seconds;
            trip.distance_m += step.metres;
            trip.done += 1;
            trip.at = Some(step.pose);
            let fraction = trip.elapsed_s / total_s;
            (watch.progress)(&Progress { elapsed_s: trip.elapsed_s, fraction, distance_m: trip.distance_m });
            tokio::task::yield_now().await;
        }
        trip
    }

    fn end_early(&self, end: &End, watch: &Watch<'_>, elapsed_s: &mut f64) -> Failure {
        let mut state = self.lock();
        match end {
            End::Person => {
                state.note("somebody stands in the way");
                Failure::Blocked { because: "somebody stands in the way".into(), by: None }
            }
            End::Stuck => {
                state.note("the wheels slip until the time is up");
                state.pass((watch.time_limit_s - *elapsed_s).max(0.0));
                *elapsed_s = watch.time_limit_s;
                timed_out("the drive", watch.time_limit_s)
            }
            End::Obstacle(obstacle) => {
                let name = state.unknown.get(*obstacle).map_or("", |o| &o.name).to_string();
                state.note(format!("the base meets \"{name}\", which its map does not show"));
                Failure::Blocked {
                    because: "something stands in the way that the map does not show".into(),
                    by: None,
                }
            }
            End::Door(door) => {
                let name = state.scene.doors[*door].doorway.name.clone();
                state.note(format!("the base stops before \"{name}\", which is shut"));
                Failure::Blocked { because: format!("\"{name}\" is shut"), by: Some(name) }
            }
        }
    }

    /// Applies the faults that happen during a drive: actions of people on objects, and the loss of the held
    /// object.
    fn disturb(&self, departure: &Departure, trip: &Trip) {
        for kind in [FaultKind::ObjectMoved, FaultKind::ObjectTaken, FaultKind::ObjectRelocated] {
            for fault in self.strike(kind, departure.number) {
                self.lock().disturb(fault);
            }
        }
        if self.is_struck(FaultKind::ObjectDropped, departure.number) {
            let half_way = departure.steps[..trip.done].get(trip.done / 2);
            self.lock().drop_held(half_way.map(|step| &step.pose));
        }
    }

    fn turn_head(&self, point: &Point3<f64>, watch: &Watch<'_>) -> Result<Looked, Failure> {
        if !point.iter().all(|x| x.is_finite()) {
            return Err(Failure::Unreachable { because: format!("{point} is no point to look at") });
        }
        let mut state = self.lock();
        let (gaze, miss_rad) = head::aim(&HEAD, &state.estimate.isometry().inverse_transform_point(point));
        let turned =
            (gaze.pan_rad - state.gaze.pan_rad).abs().max((gaze.tilt_rad - state.gaze.tilt_rad).abs());
        let duration_s = turned / HEAD_SPEED_RAD_S;
        if duration_s > watch.time_limit_s {
            state.pass(watch.time_limit_s);
            return Err(timed_out("turning the head", watch.time_limit_s));
        }
        state.gaze = gaze;
        state.pass(duration_s);
        Ok(Looked { duration_s, miss_rad })
    }

    /// Triggers a camera frame or a laser sweep that is due after `seconds`; returns its number unless it is
    /// lost.
    fn trigger(&self, state: &mut State, seconds: f64) -> Result<u64, Failure> {
        state.pass(seconds);
        state.frames += 1;
        let (number, stamp_ns) = (state.frames, state.now_ns);
        if self.is_struck(FaultKind::DroppedFrame, number) {
            state.note("a frame is lost");
            let because = format!("frame {number} was triggered and did not come");
            return Err(Failure::SensorDropped { because, stamp_ns });
        }
        Ok(number)
    }

    fn sweep(&self) -> Result<Scanned, Failure> {
        let mut state = self.lock();
        let number = self.trigger(&mut state, SWEEP_S)?;
        let part = self.options.laser.part();
        let map_from_base = state.estimate.isometry();
        let pose =
            |map_from_base: &Isometry3<f64>| Pose2::from_isometry(&(map_from_base * part.base_from_laser));
        let (truly, stated) = (pose(&state.map_from_base()), pose(&map_from_base));
        let mut rng = ChaCha8Rng::seed_from_u64(noise::mix(noise::mix(self.options.seed ^ 0x5ca9) ^ number));
        let scan = laser::sweep(&state.scene, &self.options.laser, &truly, &stated, &mut rng);
        state.notice(&scan, &self.map);
        let frames = &self.description.frames;
        let stamp_ns = state.now_ns;
        let link = |parent: &str, child: &str, parent_from_child| StampedTransform {
            stamp_ns,
            parent: parent.into(),
            child: child.into(),
            parent_from_child,
        };
        Ok(Scanned {
            stamp_ns,
            scan,
            transforms: vec![
                link(&frames.map, &frames.base, map_from_base),
                link(&frames.base, &part.frame, part.base_from_laser),
            ],
            pose_sigma_m: self.description.pose_sigma_m,
            pose_sigma_rad: self.description.pose_sigma_rad,
        })
    }

    fn expose(&self) -> Result<Sensed, Failure> {
        let mut state = self.lock();
        let number = self.trigger(&mut state, FRAME_S)?;
        let stamp_ns = state.now_ns;
        let mut frame = self.render(&state);
        let base_from_camera = head::base_from_camera(&HEAD, &state.gaze);
        let map_from_base = state.estimate.isometry();
        let truly = state.map_from_base() * base_from_camera;
        let (stereo, light, seed) = (state.scene.stereo, state.scene.light, self.options.seed);
        drop(state);
        if let Some(light) = light {
            light.fall_on(&mut frame, seed, number);
        }
        let depth_m = match stereo {
            Some(stereo) => stereo.observe(&frame, &truly, |label| label == LABEL_ROOM, seed, number),
            None => noise::observe(&frame, &self.options.noise, self.camera.range_m, seed, number),
        };
        let intrinsics = self.camera.intrinsics;
        let mut cloud = intrinsics
            .cloud_from_depth(&depth_m)
            .map_err(|e| Failure::Broken { because: format!("the camera: {e}") })?;
        cloud.colours = Some(frame.colour.clone());
        let frames = &self.description.frames;
        let link = |parent: &str, child: &str, parent_from_child| StampedTransform {
            stamp_ns,
            parent: parent.into(),
            child: child.into(),
            parent_from_child,
        };
        Ok(Sensed {
            stamp_ns,
            cloud,
            depth_m,
            colour: Some(Colour { image: frame.image(), registered: true }),
            intrinsics,
            transforms: vec![
                link(&frames.map, &frames.base, map_from_base),
                link(&frames.base, &self.camera.frame, base_from_camera),
            ],
            map_from_camera: map_from_base * base_from_camera,
            pose_sigma_m: self.description.pose_sigma_m,
            pose_sigma_rad: self.description.pose_sigma_rad,
        })
    }
}

pub(super) fn cancelled(what: &str, after_s: f64) -> Failure {
    Failure::Cancelled { because: format!("{what} was stopped after {after_s:.1} s") }
}

pub(super) fn timed_out(what: &str, limit_s: f64) -> Failure {
    Failure::TimedOut { because: format!("{what} took longer than {limit_s:.1} s") }
}

fn go_on(cancel: &CancellationToken, what: &str) -> Result<(), Failure> {
    if cancel.is_cancelled() { Err(cancelled(what, 0.0)) } else { Ok(()) }
}

#[async_trait::async_trait]
impl Robot for SimRobot {
    fn description(&self) -> &Description {
        &self.description
    }

    fn begins_again(&self) -> bool {
        true
    }

    fn now_ns(&self) -> Stamp {
        self.lock().now_ns
    }

    fn map(&self) -> Option<&OccupancyGrid> {
        self.mapped.then_some(&self.map)
    }

    fn surfaces(&self) -> &[SurfaceHint] {
        &self.surfaces
    }

    fn stations(&self) -> Option<&[Station]> {
        None
    }

    fn rooms(&self) -> &[Room] {
        &self.rooms
    }

    fn doors(&self) -> &[Door] {
        &self.doors
    }

    fn travel(&self, from: &Place, to: &[Place], shut: &[String]) -> Vec<Result<Travel, Failure>> {
        let (router, tried) = {
            let mut state = self.lock();
            let tried = |p: &Place| self.pose_of(p).and_then(|pose| state.known_unreachable(&pose));
            let tried = to.iter().map(tried).collect::<Vec<_>>();
            match state.doors(shut) {
                Ok(shut) => (state.routes.with_shut(&shut), tried),
                Err(failure) => return to.iter().map(|_| Err(failure.clone())).collect(),
            }
        };
        let from = match self.pose_of(from) {
            Ok(pose) => pose,
            Err(failure) => return to.iter().map(|_| Err(failure.clone())).collect(),
        };
        let goals: Vec<Pose2> =
            to.iter().map(|p| self.pose_of(p).unwrap_or(Pose2::new(f64::NAN, f64::NAN, f64::NAN))).collect();
        let found = router.travel_to_each(&from, &goals);
        found.into_iter().zip(tried).map(|(travel, tried)| tried.and(travel)).collect()
    }

    fn camera_at(&self, place: &Place, look_at: Option<&Point3<f64>>) -> Result<Isometry3<f64>, Failure> {
        let base = self.pose_of(place)?.isometry();
        Ok(head::camera_towards(&HEAD, &base, look_at))
    }

    async fn pose(&self) -> Result<PoseEstimate, Failure> {
        let state = self.lock();
        Ok(PoseEstimate {
            stamp_ns: state.now_ns,
            map_from_base: state.estimate.isometry(),
            sigma_m: self.description.pose_sigma_m,
            sigma_rad: self.description.pose_sigma_rad,
            station: None,
        })
    }

    #[tracing::instrument(level = "debug", skip_all, fields(%to))]
    async fn drive_to(&self, to: &Place, watch: &Watch<'_>) -> Result<Driven, Failure> {
        go_on(&watch.cancel, "the drive")?;
        let goal = self.pose_of(to)?;
        let departure = self.depart(&goal)?;
        let trip = self.travel_along(&departure, watch).await;
        self.disturb(&departure, &trip);
        let mut state = self.lock();
        let misled = self.is_struck(FaultKind::BadLocalisation, departure.number);
        let wanted = if trip.failure.is_none() { Some(goal) } else { trip.at };
        if let Some(pose) = wanted {
            state.stop(&pose, &self.options.localisation, misled);
        }
        if let (Some(Failure::Blocked { .. }), Some((_, end))) = (&trip.failure, &departure.end) {
            state.learn(end);
        }
        match trip.failure {
            Some(failure) => Err(failure),
            None => Ok(Driven {
                distance_m: trip.distance_m,
                duration_s: trip.elapsed_s,
                map_from_base: state.estimate.isometry(),
            }),
        }
    }

    async fn look_at(&self, point: &Point3<f64>, watch: &Watch<'_>) -> Result<Looked, Failure> {
        go_on(&watch.cancel, "turning the head")?;
        self.turn_head(point, watch)
    }

    #[tracing::instrument(level = "debug", skip_all)]
    async fn sense(&self, watch: &Watch<'_>) -> Result<Sensed, Failure> {
        go_on(&watch.cancel, "taking a frame")?;
        if watch.time_limit_s < FRAME_S {
            return Err(timed_out("taking a frame", watch.time_limit_s));
        }
        self.expose()
    }

    #[tracing::instrument(level = "debug", skip_all)]
    async fn scan(&self, watch: &Watch<'_>) -> Result<Scanned, Failure> {
        go_on(&watch.cancel, "a sweep of the laser")?;
        if watch.time_limit_s < SWEEP_S {
            return Err(timed_out("a sweep of the laser", watch.time_limit_s));
        }
        self.sweep()
    }

    #[tracing::instrument(level = "debug", skip_all, fields(%request))]
    async fn manipulate(&self, request: &Request, watch: &Watch<'_>) -> Result<Answer, Failure> {
        go_on(&watch.cancel, request.name())?;
        self.handle(request, watch).await
    }

    async fn hand(&self) -> Result<Hand, Failure> {
        Ok(Hand { holds: self.lock().held().is_some() })
    }

    async fn wait(&self, seconds: f64, watch: &Watch<'_>) -> Result<(), Failure> {
        go_on(&watch.cancel, "waiting")?;
        self.lock().pass(seconds);
        Ok(())
    }
}
