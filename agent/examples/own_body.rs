//! A body of one's own in Rust, and the agent on it: `cargo run --release -p descry-agent --example own_body -- "find cup A"`.
//!
//! A disc on wheels with a pan-tilt depth camera, alone in a room with an empty table. Put your driver where its small simulation is; it
//! has to pass [`conformance::check`], as this one does.

use std::error::Error;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use descry_agent::body::Body;
use descry_agent::keeping::Keeping;
use descry_agent::run::{self, Folder, Settings, Task, Watcher};
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::goal;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::Domain;
use descry_perception::{Cloud, Grid, Intrinsics};
use descry_robots::head::{Gaze, aim, base_from_camera, camera_towards};
use descry_robots::nalgebra::{Isometry3, Point2, Point3, Vector3};
use descry_robots::route::Router;
use descry_robots::{
    Base, Camera, Description, Driven, Failure, Footprint, Frames, Head, Looked, OccupancyGrid, Place, Pose2,
    PoseEstimate, Progress, Robot, Sensed, Speeds, Stamp, StampedTransform, Station, SurfaceHint, Travel,
    Watch, async_trait, conformance,
};

const ROOM_M: f64 = 2.5;
const TABLE_M: (f64, f64) = (0.8, 0.4);
const TABLE_TOP_M: f64 = 0.72;
const STEP_M: f64 = 0.05;
const SPEEDS: Speeds = Speeds { linear_m_s: 0.4, angular_rad_s: 0.8 };
const CAMERA: Intrinsics = Intrinsics { width: 64, height: 48, fx: 58.0, fy: 58.0, cx: 31.5, cy: 23.5 };
const HEAD: Head = Head {
    base_from_head: Point3::new(0.0, 0.0, 1.4),
    pan_limit_rad: 2.6,
    tilt_down_rad: 1.2,
    tilt_up_rad: 0.8,
};

/// The body. What it asks of its hardware would stand where `state` is.
struct Disc {
    description: Description,
    map: OccupancyGrid,
    surfaces: Vec<SurfaceHint>,
    router: Router,
    state: Mutex<State>,
}

struct State {
    clock_s: f64,
    at: Pose2,
    gaze: Gaze,
}

impl Disc {
    fn new() -> Self {
        let footprint = Footprint::Disc { radius_m: 0.25 };
        let corner = Point2::new(ROOM_M, ROOM_M);
        let mut map = OccupancyGrid::covering(-corner, corner, 0.05);
        map.occupy(|p| p.x.abs() < TABLE_M.0 && p.y.abs() < TABLE_M.1);
        let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
        let table = SurfaceHint {
            name: "table".into(),
            outline_m: corners.map(|(i, j)| Point2::new(i * TABLE_M.0, j * TABLE_M.1)).to_vec(),
            height_m: TABLE_TOP_M,
            room: None,
        };
        let description = Description {
            name: "disc".into(),
            simulated: true,
            base: Some(Base { footprint: footprint.clone(), speeds: SPEEDS }),
            head: Some(HEAD),
            arm: None,
            camera: Some(Camera {
                frame: "camera".into(),
                intrinsics: CAMERA,
                range_m: (0.4, 6.0),
                latency_s: 0.0,
                colour: false,
            }),
            laser: None,
            senses: Vec::new(),
            frames: Frames::default(),
            up: Some(Vector3::z()),
            pose_sigma_m: 0.03,
            pose_sigma_rad: 0.03,
        };
        let router = Router::new(&map, footprint.radius_m(), SPEEDS);
        let at = Pose2::new(-2.0, 0.0, 0.0);
        let state = Mutex::new(State { clock_s: 0.0, at, gaze: Gaze::default() });
        Disc { description, map, surfaces: vec![table], router, state }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn pose_of(place: &Place) -> Result<Pose2, Failure> {
        match place {
            Place::Pose(p) if [p.x_m, p.y_m, p.yaw_rad].iter().all(|x| x.is_finite()) => Ok(*p),
            other => Err(Failure::Unreachable { because: format!("{other} is no pose on the floor") }),
        }
    }

    /// Poses along the route of the base, with the distance and time of each step: a turn, then straight on,
    /// and a turn at the end.
    fn steps(&self, from: &Pose2, to: &Pose2) -> Result<Vec<(Pose2, f64, f64)>, Failure> {
        let Speeds { linear_m_s, angular_rad_s } = SPEEDS;
        let turn = |a: f64, b: f64| descry_robots::route::turn(a, b).abs() / angular_rad_s;
        let mut steps = Vec::new();
        let mut at = *from;
        for next in self.router.route(from, to)?.points_m.iter().skip(1) {
            let way = next - at.point();
            if way.norm() < 1e-9 {
                continue;
            }
            let heading = way.y.atan2(way.x);
            steps.push((Pose2 { yaw_rad: heading, ..at }, turn(at.yaw_rad, heading), 0.0));
            let parts = (way.norm() / STEP_M).ceil();
            for k in 1..=parts as usize {
                let p = at.point() + way * (k as f64 / parts);
                let length_m = way.norm() / parts;
                steps.push((Pose2::new(p.x, p.y, heading), length_m / linear_m_s, length_m));
            }
            at = Pose2::new(next.x, next.y, heading);
        }
        steps.push((*to, turn(at.yaw_rad, to.yaw_rad), 0.0));
        Ok(steps)
    }

    /// Depth along the camera's axis at each pixel: floor and table. NaN where nothing returns.
    fn depths_m(map_from_camera: &Isometry3<f64>) -> Vec<f32> {
        let eye = map_from_camera.translation.vector;
        let depth = |n: usize| {
            let (u, v) = ((n % CAMERA.width) as f64, (n / CAMERA.width) as f64);
            let ray = map_from_camera.rotation * CAMERA.unproject(u, v, 1.0).coords;
            let at = |height_m: f64| (height_m - eye.z) / ray.z;
            let on_table = eye + ray * at(TABLE_TOP_M);
            let is_table = on_table.x.abs() < TABLE_M.0 && on_table.y.abs() < TABLE_M.1;
            let z = if is_table { at(TABLE_TOP_M) } else { at(0.0) };
            if ray.z < -1e-6 && (0.4..6.0).contains(&z) { z as f32 } else { f32::NAN }
        };
        (0..CAMERA.width * CAMERA.height).map(depth).collect()
    }
}

#[async_trait]
impl Robot for Disc {
    fn description(&self) -> &Description {
        &self.description
    }

    fn now_ns(&self) -> Stamp {
        (self.state().clock_s * 1e9).round() as Stamp
    }

    fn map(&self) -> Option<&OccupancyGrid> {
        Some(&self.map)
    }

    fn surfaces(&self) -> &[SurfaceHint] {
        &self.surfaces
    }

    fn stations(&self) -> Option<&[Station]> {
        None
    }

    fn travel(&self, from: &Place, to: &[Place], _shut: &[String]) -> Vec<Result<Travel, Failure>> {
        let one = |to: &Place| self.router.travel(&Self::pose_of(from)?, &Self::pose_of(to)?);
        to.iter().map(one).collect()
    }

    fn camera_at(&self, place: &Place, look_at: Option<&Point3<f64>>) -> Result<Isometry3<f64>, Failure> {
        Ok(camera_towards(&HEAD, &Self::pose_of(place)?.isometry(), look_at))
    }

    async fn pose(&self) -> Result<PoseEstimate, Failure> {
        let d = &self.description;
        Ok(PoseEstimate {
            stamp_ns: self.now_ns(),
            map_from_base: self.state().at.isometry(),
            sigma_m: d.pose_sigma_m,
            sigma_rad: d.pose_sigma_rad,
            station: None,
        })
    }

    async fn drive_to(&self, to: &Place, watch: &Watch<'_>) -> Result<Driven, Failure> {
        let goal = Self::pose_of(to)?;
        let from = self.state().at;
        let steps = self.steps(&from, &goal)?;
        let total_s: f64 = steps.iter().map(|(_, seconds, _)| seconds).sum();
        let (mut elapsed_s, mut distance_m) = (0.0, 0.0);
        for (at, seconds, metres) in steps {
            if watch.cancel.is_cancelled() {
                return Err(Failure::Cancelled { because: format!("the drive to {to}") });
            }
            if elapsed_s + seconds > watch.time_limit_s {
                return Err(Failure::TimedOut { because: format!("the drive to {to} takes {total_s:.1} s") });
            }
            (elapsed_s, distance_m) = (elapsed_s + seconds, distance_m + metres);
            {
                let mut state = self.state();
                state.at = at;
                state.clock_s += seconds;
            }
            (watch.progress)(&Progress { elapsed_s, fraction: elapsed_s / total_s.max(1e-9), distance_m });
            tokio::task::yield_now().await;
        }
        Ok(Driven { distance_m, duration_s: elapsed_s, map_from_base: goal.isometry() })
    }

    async fn look_at(&self, point: &Point3<f64>, watch: &Watch<'_>) -> Result<Looked, Failure> {
        if !point.iter().all(|x| x.is_finite()) {
            return Err(Failure::Unreachable { because: format!("{point} is no point") });
        }
        if watch.cancel.is_cancelled() {
            return Err(Failure::Cancelled { because: "the turn of the head".into() });
        }
        let mut state = self.state();
        let (gaze, miss_rad) = aim(&HEAD, &state.at.isometry().inverse_transform_point(point));
        let duration_s =
            (gaze.pan_rad - state.gaze.pan_rad).abs().max((gaze.tilt_rad - state.gaze.tilt_rad).abs());
        if duration_s > watch.time_limit_s {
            return Err(Failure::TimedOut { because: format!("the head takes {duration_s:.1} s") });
        }
        state.gaze = gaze;
        state.clock_s += duration_s;
        Ok(Looked { duration_s, miss_rad })
    }

    async fn sense(&self, watch: &Watch<'_>) -> Result<Sensed, Failure> {
        if watch.cancel.is_cancelled() {
            return Err(Failure::Cancelled { because: "the frame".into() });
        }
        if watch.time_limit_s < 0.1 {
            return Err(Failure::TimedOut { because: "a frame takes 0.1 s".into() });
        }
        let (map_from_base, base_from_camera) = {
            let mut state = self.state();
            state.clock_s += 0.1;
            (state.at.isometry(), base_from_camera(&HEAD, &state.gaze))
        };
        let stamp_ns = self.now_ns();
        let map_from_camera = map_from_base * base_from_camera;
        let depth_m = Self::depths_m(&map_from_camera);
        let point = |(n, &z): (usize, &f32)| {
            CAMERA.unproject((n % CAMERA.width) as f64, (n / CAMERA.width) as f64, f64::from(z)).cast()
        };
        let link = |parent: &str, child: &str, parent_from_child| StampedTransform {
            stamp_ns,
            parent: parent.into(),
            child: child.into(),
            parent_from_child,
        };
        Ok(Sensed {
            stamp_ns,
            cloud: Cloud {
                points: depth_m.iter().enumerate().map(point).collect(),
                grid: Some(Grid { width: CAMERA.width, height: CAMERA.height }),
                ..Cloud::default()
            },
            depth_m,
            colour: None,
            intrinsics: CAMERA,
            transforms: vec![link("map", "base", map_from_base), link("base", "camera", base_from_camera)],
            map_from_camera,
            pose_sigma_m: self.description.pose_sigma_m,
            pose_sigma_rad: self.description.pose_sigma_rad,
        })
    }
}

/// Checks that the body keeps the promises of bodies, then pursues a goal with it; the run is kept in a folder. Returns the verdict in words.
pub fn pursue(said: &str, folder: &Path) -> Result<String, Box<dyn Error>> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(conformance::check(&Disc::new()))?;
    let body = Body::new(Arc::new(Disc::new()));
    let domain = Domain::load("tabletop")?;
    let goal = goal::read(said, &domain, &Lexicon::new(&domain, &Places::of_body(&*body.robot)))?;
    let folder = Folder::of_new_run(Some(folder), &goal)?;
    let settings = Settings {
        robot: "an own body".into(),
        scene: None,
        seed: 1,
        domain: "tabletop".into(),
        policy: policies::PLAN.into(),
        keeping: Keeping::default(),
        remember: None,
    };
    let chooser = policies::named(policies::PLAN, 1, None)?;
    let mut tell = |event: &descry_agent::report::Event| println!("{event}");
    let watcher = Watcher { stop: &Stop::default(), tell: &mut tell };
    let task = Task { domain: &domain, goal: &goal, past: None };
    let report = runtime.block_on(run::pursue(task, &body, &folder, &settings, chooser, watcher))?;
    run::finish(folder.path(), &report)?;
    Ok(report.to_string())
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn Error>> {
    let said = std::env::args().nth(1).unwrap_or_else(|| "find cup A".into());
    let folder = std::env::temp_dir().join(format!("own-body-{}", std::process::id()));
    println!("{}", pursue(&said, &folder)?);
    Ok(())
}
