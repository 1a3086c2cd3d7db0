//! Conformance test for any implementation of [`Robot`]: checks the guarantees that every body gives.
//!
//! The test drives the body, turns its head, takes frames and sweeps its laser; the body needs one reachable
//! place besides its own, open doors, an empty hand, and no faults. [`check_carrying`] is for bodies with a
//! hand and needs an object.

mod doors;
mod hand;
mod laser;
mod sight;

pub use hand::check_carrying;

use crate::body::{
    CancellationToken, Grasp, Place, Placing, Pose2, Pouring, Progress, Push, Robot, Sensed, Stamp, Watch,
};
use crate::failure::Failure;
use crate::parts::{Base, Camera, Description};
use crate::request::{Answer, Request};
use nalgebra::{Isometry3, Point3, Vector2};
use std::pin::Pin;
use std::sync::Mutex;

/// A guarantee of the [`Robot`] trait that a body violated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{promise}: {found}")]
pub struct Breach {
    /// The guarantee, as one sentence.
    pub promise: &'static str,
    /// Observed behaviour.
    pub found: String,
}

/// All violated guarantees, in the order of the checks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct Breaches(pub Vec<Breach>);

/// Tolerance for rounding on values that should be equal: metres, radians, lengths of unit vectors.
const ROUNDING: f64 = 1e-6;
/// Maximum time, seconds, by which a drive may take longer on the clock than the body says, for messages, if
/// the body is not simulated. From: chosen, a busy computer.
const LATE_S: f64 = 1.0;
/// Maximum distance of the estimated pose from the goal after a drive, in standard deviations of the
/// localisation.
const ARRIVED_SIGMAS: f64 = 5.0;
/// Maximum number of places, spread over the map, that are used for route queries.
const PLACES: usize = 40;

fn ensure(holds: bool, promise: &'static str, found: impl FnOnce() -> String) -> Result<(), Breach> {
    if holds { Ok(()) } else { Err(Breach { promise, found: found() }) }
}

fn done<T>(answer: Result<T, Failure>, promise: &'static str) -> Result<T, Breach> {
    answer.map_err(|f| Breach { promise, found: f.to_string() })
}

/// Future of a running check.
type Checking<'a> = Pin<Box<dyn Future<Output = Result<(), Breach>> + Send + 'a>>;
/// A check, begun for a body.
type Check = for<'a> fn(&'a dyn Robot) -> Checking<'a>;

/// All checks with their names, in the order of execution.
pub const CHECKS: [(&str, Check); 12] = [
    ("what it is", |robot| Box::pin(async { check_description(robot).and_then(|()| check_stations(robot)) })),
    ("a frame", |robot| Box::pin(check_frame(robot))),
    ("routes and a drive", |robot| {
        Box::pin(async {
            if robot.description().base.is_none() {
                return Ok(());
            }
            let goal = check_travel(robot).await?;
            check_drive(robot, &goal).await
        })
    }),
    ("a frame after the drive", |robot| Box::pin(check_frame(robot))),
    ("the surfaces of its map", |robot| Box::pin(sight::check_sight(robot))),
    ("a sweep of the laser", |robot| Box::pin(laser::check_scan(robot))),
    ("its other senses", |robot| Box::pin(check_senses(robot))),
    ("what it refuses", |robot| Box::pin(check_refusals(robot))),
    ("doors", |robot| Box::pin(doors::check_doors(robot))),
    ("the hand", |robot| Box::pin(hand::check_hand(robot))),
    ("being stopped", |robot| Box::pin(check_stops(robot))),
    ("a frame after it was stopped", |robot| Box::pin(check_frame(robot))),
];

/// Runs every check, even after a failure.
///
/// # Errors
/// The violated guarantees with the observations, at most one for each check, in the order of the checks.
pub async fn check(robot: &dyn Robot) -> Result<(), Breaches> {
    let mut breaches = Vec::new();
    for (_, begin) in CHECKS {
        breaches.extend(begin(robot).await.err());
    }
    if breaches.is_empty() { Ok(()) } else { Err(Breaches(breaches)) }
}

fn check_description(robot: &dyn Robot) -> Result<(), Breach> {
    let d = robot.description();
    ensure(!d.name.trim().is_empty(), "a body has a name", || "it is empty".into())?;
    let radius_m = d.radius_m();
    ensure(radius_m.is_finite() && radius_m >= 0.0, "a footprint has a size", || radius_m.to_string())?;
    if let Some(Base { speeds, .. }) = &d.base {
        ensure(
            above_zero(speeds.linear_m_s) && above_zero(speeds.angular_rad_s),
            "speeds are above zero",
            || format!("{speeds:?}"),
        )?;
    }
    if let Some(Camera { intrinsics: c, range_m, .. }) = &d.camera {
        let sound = c.width > 0 && c.height > 0 && above_zero(c.fx) && above_zero(c.fy);
        ensure(sound, "the camera has pixels", || format!("{c:?}"))?;
        ensure(range_m.0 >= 0.0 && range_m.0 < range_m.1, "the range is one", || format!("{range_m:?}"))?;
    }
    if let Some(arm) = &d.arm {
        ensure(above_zero(arm.reach_m), "an arm reaches somewhere", || format!("{arm:?}"))?;
    }
    ensure(
        above_zero(d.pose_sigma_m) && above_zero(d.pose_sigma_rad),
        "no body knows its pose exactly",
        || format!("{} m, {} rad", d.pose_sigma_m, d.pose_sigma_rad),
    )?;
    let names = frames(d);
    let double = (1..names.len()).any(|n| names[..n].contains(&names[n]));
    ensure(!double, "frames have names of their own", || format!("{names:?}"))?;
    let length = d.up.map_or(1.0, |up| up.norm());
    ensure((length - 1.0).abs() < ROUNDING, "\"up\" is a unit vector", || format!("of length {length}"))
}

fn above_zero(x: f64) -> bool {
    x.is_finite() && x > 0.0
}

/// Names of the coordinate frames of a body: map, base, camera, laser.
fn frames(body: &Description) -> Vec<&str> {
    let camera = body.camera.as_ref().map(|camera| camera.frame.as_str());
    let laser = body.laser.as_ref().map(|laser| laser.frame.as_str());
    [Some(body.frames.map.as_str()), Some(body.frames.base.as_str()), camera, laser]
        .into_iter()
        .flatten()
        .collect()
}

fn check_stations(robot: &dyn Robot) -> Result<(), Breach> {
    let Some(stations) = robot.stations() else {
        return ensure(robot.map().is_some(), "a body has stations or a map", || "it has neither".into());
    };
    ensure(!stations.is_empty(), "a body with stations has at least one", || "it has none".into())?;
    for (i, s) in stations.iter().enumerate() {
        let double = stations[..i].iter().any(|other| other.name == s.name);
        ensure(!double, "stations have names of their own", || format!("two are called \"{}\"", s.name))?;
    }
    let stays = robot.description().base.is_none();
    ensure(!stays || stations.len() == 1, "who has no base has one station", || {
        format!("it has {}", stations.len())
    })
}

/// Difference between two transforms: the larger of the distance in metres and the angle in radians.
fn gap(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    let moved = (a.translation.vector - b.translation.vector).norm();
    moved.max(a.rotation.angle_to(&b.rotation))
}

async fn check_frame(robot: &dyn Robot) -> Result<(), Breach> {
    let watch = Watch::default();
    let estimate = done(robot.pose().await, "a body knows where it is")?;
    ensure(estimate.stamp_ns <= robot.now_ns(), "an estimate is not of the future", || {
        format!("{} after {}", estimate.stamp_ns, robot.now_ns())
    })?;
    ensure(
        estimate.station.is_some() == robot.stations().is_some(),
        "a body with stations stands at one",
        || format!("{:?}", estimate.station),
    )?;
    let Some(camera) = &robot.description().camera else { return Ok(()) };
    let ahead = estimate.map_from_base * Point3::new(1.0, 0.1, 0.7);
    done(robot.look_at(&ahead, &watch).await, "a body can be told where to look")?;
    let before_ns = robot.now_ns();
    let sensed = done(robot.sense(&watch).await, "a body takes frames")?;
    let earliest_ns = before_ns.saturating_sub((camera.latency_s * 1e9) as Stamp);
    ensure(sensed.stamp_ns >= earliest_ns && sensed.stamp_ns <= robot.now_ns(), "a frame is of now", || {
        format!("{} outside {earliest_ns} to {}", sensed.stamp_ns, robot.now_ns())
    })?;
    ensure(robot.now_ns() > before_ns, "taking a frame takes time", || "the clock stood still".into())?;
    check_pixels(camera, &sensed)?;
    check_chain(robot, camera, &sensed)?;
    let expected =
        done(robot.camera_at(&estimate.place(), Some(&ahead)), "a body can say where its camera would be")?;
    let off = gap(&expected, &sensed.map_from_camera);
    ensure(off < ROUNDING, "the camera is where the body said it would be", || format!("{off} off"))
}

fn check_pixels(described: &Camera, sensed: &Sensed) -> Result<(), Breach> {
    let camera = &described.intrinsics;
    let as_said = described.colour || sensed.colour.is_none();
    ensure(as_said, "only who has colours gives them", || "a frame has some".into())?;
    ensure(&sensed.intrinsics == camera, "frames are of the described camera", || {
        format!("{:?}", sensed.intrinsics)
    })?;
    let pixels = camera.width * camera.height;
    ensure(
        sensed.depth_m.len() == pixels && sensed.cloud.len() == pixels,
        "a frame has a depth and a point for each pixel",
        || format!("{} depths, {} points, {pixels} pixels", sensed.depth_m.len(), sensed.cloud.len()),
    )?;
    ensure(sensed.cloud.check().is_ok(), "the parts of a cloud fit together", || {
        format!("{:?}", sensed.cloud.check())
    })?;
    let grid = sensed.cloud.grid.map(|g| (g.width, g.height));
    ensure(grid == Some((camera.width, camera.height)), "a frame's cloud is organised", || {
        format!("{grid:?}")
    })?;
    let differs =
        sensed.cloud.points.iter().zip(&sensed.depth_m).position(|(p, d)| {
            if d.is_nan() { p.z.is_finite() } else { *d <= 0.0 || (p.z - d).abs() > 1e-4 }
        });
    ensure(differs.is_none(), "cloud and depth image say the same", || format!("not at pixel {differs:?}"))
}

fn check_chain(robot: &dyn Robot, described: &Camera, sensed: &Sensed) -> Result<(), Breach> {
    let frames = &robot.description().frames;
    let [base, camera] = sensed.transforms.as_slice() else {
        return Err(Breach {
            promise: "a frame comes with the chain map, base, camera",
            found: format!("{} transforms", sensed.transforms.len()),
        });
    };
    let names = [&base.parent, &base.child, &camera.parent, &camera.child];
    ensure(
        names == [&frames.map, &frames.base, &frames.base, &described.frame],
        "the chain is map, base, camera",
        || format!("{names:?}"),
    )?;
    let now = base.stamp_ns == sensed.stamp_ns && camera.stamp_ns == sensed.stamp_ns;
    ensure(now, "the chain is of the frame's time", || format!("{} {}", base.stamp_ns, camera.stamp_ns))?;
    let off = gap(&(base.parent_from_child * camera.parent_from_child), &sensed.map_from_camera);
    ensure(off < ROUNDING, "the chain multiplies to the camera's pose", || format!("{off} off"))
}

/// Places for route queries: the stations, or else points spread over the map; empty without both.
fn places(robot: &dyn Robot) -> Vec<Place> {
    if let Some(stations) = robot.stations() {
        return stations.iter().map(|s| Place::Station(s.name.clone())).collect();
    }
    let Some(map) = robot.map() else { return Vec::new() };
    // The R2 sequence (Roberts 2018) spreads over any map.
    let share = |k: usize, step: f64| (0.5 + step * k as f64).fract();
    (0..PLACES)
        .map(|k| {
            let column = (share(k, 0.754_877_666) * map.width as f64) as usize;
            let row = (share(k, 0.569_840_291) * map.height as f64) as usize;
            let p = map.centre(column, row);
            Place::Pose(Pose2::new(p.x, p.y, k as f64))
        })
        .collect()
}

async fn check_travel(robot: &dyn Robot) -> Result<Place, Breach> {
    let here = done(robot.pose().await, "a body knows where it is")?.place();
    let before_ns = robot.now_ns();
    let to = places(robot);
    let answers = robot.travel(&here, &to, &[]);
    ensure(answers.len() == to.len(), "each question about a route has an answer", || {
        format!("{} answers to {} questions", answers.len(), to.len())
    })?;
    ensure(answers == robot.travel(&here, &to, &[]), "the same question has the same answer", || {
        "two answers differ".into()
    })?;
    ensure(robot.now_ns() == before_ns, "asking for routes takes no time", || "the clock moved".into())?;
    for (place, answer) in to.iter().zip(&answers) {
        match answer {
            Ok(t) => {
                let sound = t.distance_m.is_finite() && t.distance_m >= 0.0 && t.duration_s >= 0.0;
                ensure(sound && t.duration_s.is_finite(), "a route costs a number", || {
                    format!("{place}: {t:?}")
                })?;
            }
            Err(Failure::Unreachable { .. }) => {}
            Err(other) => {
                return Err(Breach {
                    promise: "what has no route is unreachable",
                    found: format!("{place}: {other}"),
                });
            }
        }
    }
    let longest = to.into_iter().zip(answers).filter_map(|(place, t)| Some((place, t.ok()?.duration_s)));
    let goal = longest.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, s)| *s > 0.0);
    let Some((goal, _)) = goal else {
        return Err(Breach { promise: "a body can reach another place", found: "it can reach none".into() });
    };
    Ok(goal)
}

async fn check_drive(robot: &dyn Robot, goal: &Place) -> Result<(), Breach> {
    let here = done(robot.pose().await, "a body knows where it is")?.place();
    let predicted = robot.travel(&here, std::slice::from_ref(goal), &[]).remove(0);
    let predicted = done(predicted, "a route that was found is found again")?;
    let heard: Mutex<Vec<f64>> = Mutex::new(Vec::new());
    let listen = |p: &Progress| {
        if let Ok(mut heard) = heard.lock() {
            heard.push(p.fraction);
        }
    };
    let before_ns = robot.now_ns();
    let watch = Watch { progress: &listen, ..Watch::default() };
    let driven = done(robot.drive_to(goal, &watch).await, "a body drives where a route leads")?;
    let passed_s = (robot.now_ns() - before_ns) as f64 * 1e-9;
    let simulated = robot.description().simulated;
    let (off_s, late_s) = (passed_s - driven.duration_s, if simulated { 0.01 } else { LATE_S });
    ensure(off_s > -0.01 && off_s < late_s, "driving takes the time that it says", || {
        format!("{passed_s} s on the clock, {} s reported", driven.duration_s)
    })?;
    let as_said = (driven.duration_s - predicted.duration_s).abs() <= 0.05 * predicted.duration_s + 0.01;
    ensure(!simulated || as_said, "without mishaps a simulated drive takes what was predicted", || {
        format!("{} s, predicted {} s", driven.duration_s, predicted.duration_s)
    })?;
    let fractions = heard.into_inner().unwrap_or_default();
    let rising = fractions.windows(2).all(|w| w[0] <= w[1] + 1e-9)
        && fractions.iter().all(|f| (0.0..=1.0 + 1e-9).contains(f));
    ensure(rising && !fractions.is_empty(), "progress rises from 0 to 1", || format!("{fractions:?}"))?;
    let estimate = done(robot.pose().await, "a body knows where it is")?;
    match goal {
        Place::Station(name) => ensure(
            estimate.station.as_ref() == Some(name),
            "a body that arrived stands at the station",
            || format!("{:?}", estimate.station),
        ),
        Place::Pose(goal) => {
            let off_m = (Pose2::from_isometry(&estimate.map_from_base).point() - goal.point()).norm();
            ensure(off_m <= ARRIVED_SIGMAS * estimate.sigma_m, "a body that arrived is at its goal", || {
                format!("{off_m} m off")
            })
        }
    }
}

async fn check_refusals(robot: &dyn Robot) -> Result<(), Breach> {
    let watch = Watch::default();
    let before = done(robot.pose().await, "a body knows where it is")?;
    let nowhere = [
        Place::Station("there is no station of this name".into()),
        Place::Pose(Pose2::new(1e6, 1e6, 0.0)),
        Place::Pose(Pose2::new(f64::NAN, 0.0, 0.0)),
        Place::Pose(Pose2::new(
            before.map_from_base.translation.x,
            before.map_from_base.translation.y,
            f64::NAN,
        )),
    ];
    for place in &nowhere {
        let answer = robot.drive_to(place, &watch).await;
        let refused = matches!(&answer, Err(Failure::Unreachable { because }) if !because.is_empty());
        ensure(refused, "a place that is none is unreachable, with a reason", || {
            format!("{place}: {answer:?}")
        })?;
    }
    if robot.description().camera.is_some() {
        let answer = robot.look_at(&Point3::new(f64::NAN, 0.0, 0.0), &watch).await;
        ensure(
            matches!(answer, Err(Failure::Unreachable { .. })),
            "a point that is none cannot be looked at",
            || format!("{answer:?}"),
        )?;
    }
    check_missing_parts(robot, &before.map_from_base).await?;
    let after = done(robot.pose().await, "a body knows where it is")?;
    ensure(before.map_from_base == after.map_from_base, "a body that refuses does not move", || {
        format!("{} off", gap(&before.map_from_base, &after.map_from_base))
    })?;
    Ok(())
}

/// Checks that requests for missing parts fail with [`Failure::Unable`].
async fn check_missing_parts(robot: &dyn Robot, map_from_base: &Isometry3<f64>) -> Result<(), Breach> {
    let object = map_from_base * Point3::new(0.5, 0.0, 0.8);
    let requests = [
        Request::LookAt(object),
        Request::Sense,
        Request::Scan,
        Request::PushAside(Push { object, direction: Vector2::x(), distance_m: 0.1 }),
        Request::Grasp(Grasp { object, width_m: 0.05 }),
        Request::Place(Placing { foot: object }),
        Request::Pour(Pouring { over: object }),
        Request::Hand,
    ];
    for request in requests {
        if request.needs().is_none_or(|part| robot.description().has(part)) {
            continue;
        }
        let (answer, _) = request.ask(robot, &Watch::default()).await;
        let says_so = matches!(&answer, Answer::Failed(Failure::Unable { because }) if !because.is_empty());
        ensure(says_so, "who lacks a part says that it is unable", || {
            format!("asked to {request}: {answer:?}")
        })?;
    }
    let nothing = Request::Read("there is no sense of this name".into());
    let (answer, _) = nothing.ask(robot, &Watch::default()).await;
    ensure(
        matches!(answer, Answer::Failed(Failure::Unable { .. })),
        "a sense that is none says nothing",
        || format!("{answer:?}"),
    )
}

/// Checks that each custom sensor returns a current reading.
async fn check_senses(robot: &dyn Robot) -> Result<(), Breach> {
    for sense in &robot.description().senses {
        let before_ns = robot.now_ns();
        let reading = done(robot.read(&sense.name, &Watch::default()).await, "a sense can be read")?;
        let now = (before_ns..=robot.now_ns()).contains(&reading.stamp_ns);
        ensure(now, "a reading is of now", || format!("{}: {} ns", sense.name, reading.stamp_ns))?;
    }
    Ok(())
}

async fn check_stops(robot: &dyn Robot) -> Result<(), Breach> {
    let cancel = CancellationToken::new();
    cancel.cancel();
    let stopped = Watch { cancel, ..Watch::default() };
    if robot.description().camera.is_some() {
        let answer = robot.sense(&stopped).await;
        ensure(matches!(answer, Err(Failure::Cancelled { .. })), "taking a frame can be stopped", || {
            format!("{:?}", answer.map(|s| s.stamp_ns))
        })?;
    }
    let here = done(robot.pose().await, "a body knows where it is")?.place();
    let to = places(robot);
    let far =
        to.iter().zip(robot.travel(&here, &to, &[])).find(|(_, t)| matches!(t, Ok(t) if t.duration_s > 0.1));
    let Some((far, _)) = far else { return Ok(()) };
    let answer = robot.drive_to(far, &stopped).await;
    ensure(matches!(answer, Err(Failure::Cancelled { .. })), "a drive can be stopped", || {
        format!("{answer:?}")
    })?;
    let hurried = Watch { time_limit_s: 0.01, ..Watch::default() };
    let answer = robot.drive_to(far, &hurried).await;
    ensure(matches!(answer, Err(Failure::TimedOut { .. })), "a drive has a limit", || format!("{answer:?}"))?;
    done(robot.drive_to(far, &Watch::default()).await, "a body that was stopped drives again")?;
    Ok(())
}
