//! Recordings of cameras and poses that are not as stated: answers of whole runs of `find`, by fault and its size, beside
//! those about the true recordings of the same scenes.

use std::sync::Arc;

use descry_agent::body::Body;
use descry_agent::keeping::{Keeping, Kept};
use descry_agent::report::{Event, Report};
use descry_agent::run::{self, Folder, Settings, Task, Watcher};
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::conclusion::Verdict;
use descry_domains::contradiction::Contradiction;
use descry_domains::load::Domain;
use descry_domains::note::Note;
use descry_perception::Intrinsics;
use descry_perception::consistency::Fault;
use descry_perception::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use descry_robots::recorded::{Footage, Known, RecordedRobot};
use descry_robots::sim::shape::{Cup, Shape};
use descry_robots::sim::{Scene, SimOptions, SimRobot};
use descry_robots::{Pixels, Place, Pose2, Robot, Station, Watch};

use super::room::{self, BESIDE};
use super::tabletop::Draws;

/// Frames of a recording around the table.
const FRAMES: usize = 8;
/// Distances farther out at which a frame is taken where the body cannot stand, metres.
const OUTWARDS_M: [f64; 4] = [0.1, 0.2, 0.3, 0.4];

const ASKED: &str = r#"
[[object]]
name = "asked"
shape.cup = { diameter_m = 0.070, height_m = 0.104 }
area_m = [1.2, 0.5]
"#;

const MUG: &str = r#"
[[object]]
name = "mug"
shape.mug = { diameter_m = 0.080, height_m = 0.095 }
"#;

/// Difference between a recording and the truth.
#[derive(Clone, Copy, Debug)]
enum Lie {
    None,
    /// Factor on all depths.
    Scale(f64),
    /// Number of frames by which poses lag behind images.
    Late(i64),
    /// Shift of all poses in the map, metres, and turn about the middle of the table, radians.
    Biased(Vector2<f64>, f64),
    Mirrored,
    /// Factor on the stated focal length.
    Focal(f64),
    /// Offset of the stated principal point, pixels.
    Principal(Vector2<f64>),
    /// Factor on all depths by a confused unit of length.
    Unit(f64),
}

/// Rows of the table, each with a draw of the fault.
const ROWS: [(&str, fn(&mut Draws) -> Lie); 14] = [
    ("depth scale 2-4 %", |draws| Lie::Scale(off_one(draws, 0.02, 0.04))),
    ("depth scale 4-7 %", |draws| Lie::Scale(off_one(draws, 0.04, 0.07))),
    ("depth scale 7-10 %", |draws| Lie::Scale(off_one(draws, 0.07, 0.10))),
    ("poses a frame late", |_| Lie::Late(1)),
    ("poses a frame early", |_| Lie::Late(-1)),
    ("poses 0-7 cm off", |draws| biased(draws, 0.0, 0.07)),
    ("poses 7-20 cm off", |draws| biased(draws, 0.07, 0.20)),
    ("mirrored images", |_| Lie::Mirrored),
    ("focal length 2-5 %", |draws| Lie::Focal(off_one(draws, 0.02, 0.05))),
    ("focal length 5-10 %", |draws| Lie::Focal(off_one(draws, 0.05, 0.10))),
    ("principal 4-12 px", |draws| Lie::Principal(any_way(draws, 4.0, 12.0))),
    ("principal 12-30 px", |draws| Lie::Principal(any_way(draws, 12.0, 30.0))),
    ("unit x10, /10, x1000", |draws| Lie::Unit([10.0, 0.1, 1000.0, 0.001][(4.0 * draws.next()) as usize])),
    ("inches", |draws| Lie::Unit(if draws.next() < 0.5 { 1.0 / 0.0254 } else { 0.0254 })),
];

fn between(draws: &mut Draws, low: f64, high: f64) -> f64 {
    low + (high - low) * draws.next()
}

/// A factor above or below one.
fn off_one(draws: &mut Draws, low: f64, high: f64) -> f64 {
    let by = between(draws, low, high);
    if draws.next() < 0.5 { 1.0 + by } else { 1.0 - by }
}

fn any_way(draws: &mut Draws, low: f64, high: f64) -> Vector2<f64> {
    let (length, angle) = (between(draws, low, high), std::f64::consts::TAU * draws.next());
    length * Vector2::new(angle.cos(), angle.sin())
}

/// A common displacement of all poses, its turn in proportion: 5 degrees with 20 cm.
fn biased(draws: &mut Draws, low_m: f64, high_m: f64) -> Lie {
    let shift = any_way(draws, low_m, high_m);
    let turn_rad = between(draws, -1.0, 1.0) * (shift.norm() / 0.2) * 5f64.to_radians();
    Lie::Biased(shift, turn_rad)
}

/// Recording with its true camera and poses, with a frame before and after those that are used.
struct Truthful {
    known: Known,
    camera: Intrinsics,
    poses: Vec<Isometry3<f64>>,
    depths_m: Vec<Vec<f32>>,
    /// True centre of the requested object; `None` while absent.
    centre_m: Option<Point3<f64>>,
}

/// Frames in memory.
struct Frames {
    camera: Intrinsics,
    depths_m: Vec<Vec<f32>>,
}

impl Footage for Frames {
    fn pixels(&self, station: usize) -> Result<Pixels, String> {
        let cloud = self.camera.cloud_from_depth(&self.depths_m[station]).map_err(|e| e.to_string())?;
        Ok(Pixels { cloud, colour: None })
    }
}

impl Truthful {
    /// Recording of a scene by a simulated body that drives around the table.
    async fn of(scene: Scene, seed: u64, present: bool) -> Result<Truthful, String> {
        let mut draws = Draws(seed);
        let centre_m = scene.objects.iter().find(|o| o.name == "asked" && present).map(|o| o.centre_m());
        let surface = &scene.surfaces[0];
        let (middle, height_m) = (surface.centre_m(), surface.height_m);
        let robot = SimRobot::new(scene, SimOptions { seed, ..SimOptions::default() });
        let watch = Watch::default();
        let begin = std::f64::consts::TAU * draws.next();
        let (mut poses, mut depths_m, mut camera) = (Vec::new(), Vec::new(), None);
        for n in 0..FRAMES + 2 {
            let angle = begin + std::f64::consts::TAU * (n as f64 + 0.3 * draws.next()) / FRAMES as f64;
            let distance_m = between(&mut draws, 1.2, 1.6);
            let pose = |outwards_m: f64| {
                let at = middle + (distance_m + outwards_m) * Vector2::new(angle.cos(), angle.sin());
                Place::Pose(Pose2::facing(at.x, at.y, &middle))
            };
            let mut driven = robot.drive_to(&pose(0.0), &watch).await;
            for outwards_m in OUTWARDS_M {
                if driven.is_err() {
                    driven = robot.drive_to(&pose(outwards_m), &watch).await;
                }
            }
            driven.map_err(|e| format!("{e:?}"))?;
            let target = Point3::new(middle.x, middle.y, height_m);
            robot.look_at(&target, &watch).await.map_err(|e| format!("{e:?}"))?;
            let sensed = robot.sense(&watch).await.map_err(|e| format!("{e:?}"))?;
            poses.push(sensed.map_from_camera);
            depths_m.push(sensed.depth_m);
            camera = Some(sensed.intrinsics);
        }
        let camera = camera.ok_or("no frame")?;
        Ok(Truthful { known: Known::of(&robot), camera, poses, depths_m, centre_m })
    }

    /// Body that plays the recording as a lie states it.
    fn told_with(&self, lie: Lie) -> RecordedRobot {
        let mut camera = self.camera;
        match lie {
            Lie::Focal(times) => (camera.fx, camera.fy) = (times * camera.fx, times * camera.fy),
            Lie::Principal(by) => (camera.cx, camera.cy) = (camera.cx + by.x, camera.cy + by.y),
            _ => {}
        }
        let pose = |n: usize| match lie {
            Lie::Late(frames) => self.poses[n.saturating_add_signed(-frames as isize)],
            Lie::Biased(shift, turn_rad) => {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_rad);
                Isometry3::from_parts(Translation3::new(shift.x, shift.y, 0.0), turn) * self.poses[n]
            }
            _ => self.poses[n],
        };
        let depth = |n: usize| {
            let (mut depths_m, columns) = (self.depths_m[n].clone(), self.camera.width);
            match lie {
                Lie::Scale(times) | Lie::Unit(times) => {
                    depths_m.iter_mut().for_each(|depth| *depth *= times as f32)
                }
                Lie::Mirrored => depths_m.chunks_mut(columns).for_each(<[f32]>::reverse),
                _ => {}
            }
            depths_m
        };
        let used = 1..=FRAMES;
        let station = |n: usize| Station { name: n.to_string(), map_from_base: pose(n) };
        let mut known = self.known.clone();
        known.stations = Some(used.clone().map(station).collect());
        known.map = None;
        if let Some(part) = known.description.camera.as_mut() {
            part.intrinsics = camera;
        }
        RecordedRobot::of(known, 0, Box::new(Frames { camera, depths_m: used.map(depth).collect() }))
    }
}

/// Result of a run about a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    Right,
    /// Found, farther from the truth than three times the stated spread.
    Off,
    FalseYes,
    FalseNotThere,
    CannotTell,
}

impl Answer {
    fn of(report: &Report, centre_m: Option<Point3<f64>>) -> Answer {
        match (report.verdict, centre_m) {
            (Verdict::Achieved, None) => Answer::FalseYes,
            (Verdict::Achieved, Some(centre_m)) => {
                let off_m = report.position_m.map(|at| (Point3::from(at) - centre_m).norm());
                let is_off = off_m.zip(report.position_sigma_m).is_none_or(|(off, sigma)| off > 3.0 * sigma);
                if is_off { Answer::Off } else { Answer::Right }
            }
            (Verdict::NotFound, Some(_)) => Answer::FalseNotThere,
            (Verdict::NotFound, None) => Answer::Right,
            (Verdict::CannotTell | Verdict::Impossible | Verdict::Failed, _) => Answer::CannotTell,
        }
    }
}

/// True if the named fault is of the kind of the lie.
fn is_named(lie: Lie, contradiction: Contradiction) -> bool {
    match (lie, contradiction) {
        (Lie::Scale(true_times) | Lie::Unit(true_times), Contradiction::Fault(Fault::DepthScale(times))) => {
            (0.5..2.0).contains(&(times.ln() / true_times.ln()))
        }
        (Lie::Mirrored, Contradiction::Fault(Fault::Mirrored))
        | (Lie::Focal(_), Contradiction::Fault(Fault::FocalLength(_)))
        | (Lie::Principal(_), Contradiction::Fault(Fault::PrincipalPoint(_)))
        | (Lie::Biased(..), Contradiction::Fault(Fault::Displaced(..))) => true,
        (Lie::Late(by), Contradiction::Fault(Fault::Late(frames))) => by == frames,
        _ => false,
    }
}

/// Counts of a row.
#[derive(Default)]
pub struct AnswerCounts {
    count: usize,
    /// Runs by their answer: right, off, false yes, false *not there*, cannot tell.
    pub answers: [usize; 5],
    /// Runs that end with a named fault or contradiction, and those among them with the right one.
    told: usize,
    named: usize,
    looks: usize,
}

/// Counts for each kind of lie, and last for the true recordings of the same scenes: `count` lies in all, scenes with the
/// requested object and without it in turn, from a seed.
pub fn measured(count: usize, first: u64) -> Result<Vec<(&'static str, AnswerCounts)>, String> {
    let domain = Domain::load("tabletop").map_err(|e| e.to_string())?;
    let spec = room::spec("A cup among others", &format!("{ASKED}{BESIDE}{MUG}"))?;
    let runtime = room::runtime()?;
    let names = ROWS.iter().map(|(name, _)| *name).chain(["none"]);
    let mut tallies: Vec<(&'static str, AnswerCounts)> =
        names.map(|name| (name, AnswerCounts::default())).collect();
    for begin in (0..count).step_by(ROWS.len()) {
        let of_scene = (begin / ROWS.len()) as u64;
        let (seed, present) = (first + of_scene, of_scene.is_multiple_of(2));
        let scene = staged(&spec, seed, present)?;
        let recording = runtime.block_on(Truthful::of(scene, seed, present))?;
        let mut draws = Draws(seed ^ 0x11e5);
        let rows = ROWS.iter().take(count - begin);
        let lies = rows.map(|(_, draw)| draw(&mut draws)).chain([Lie::None]).collect::<Vec<Lie>>();
        for (row, lie) in lies.iter().enumerate() {
            let (report, told) = runtime.block_on(searched(&domain, recording.told_with(*lie), seed))?;
            let answer = Answer::of(&report, recording.centre_m);
            let is_honest = matches!(lie, Lie::None);
            let (_, tally) = &mut tallies[if is_honest { ROWS.len() } else { row }];
            tally.count += 1;
            tally.answers[answer as usize] += 1;
            tally.told += usize::from(told.is_some());
            tally.named += usize::from(told.is_some_and(|told| is_named(*lie, told)));
            tally.looks += report.views;
            if !matches!(answer, Answer::Right | Answer::CannotTell) || is_honest && answer != Answer::Right {
                let off_m =
                    report.position_m.zip(recording.centre_m).map(|(a, b)| (Point3::from(a) - b).norm());
                eprintln!(
                    "{seed}, there {present}, {lie:?}: {answer:?} after {} looks, off {off_m:.3?} of {:.3?}: {}",
                    report.views, report.position_sigma_m, report.why
                );
            }
        }
    }
    Ok(tallies)
}

/// Scene of a seed with the requested cup, or without it: then nothing stands there, or another cup.
fn staged(spec: &descry_robots::sim::SceneSpec, seed: u64, present: bool) -> Result<Scene, String> {
    let mut scene = room::arranged(spec, seed)?;
    let is_asked = |name: &str| name == "asked";
    match seed / 2 % 2 {
        _ if present => {}
        0 => scene.objects.retain(|o| !is_asked(&o.name)),
        _ => {
            let times = off_one(&mut Draws(seed), 0.06, 0.25);
            let cup = Cup {
                diameter_m: 0.070 * times,
                base_diameter_m: None,
                height_m: 0.104 * times,
                wall_m: 0.003,
            };
            scene
                .objects
                .iter_mut()
                .filter(|o| is_asked(&o.name))
                .for_each(|o| o.shape = Shape::Cup(cup.clone()));
        }
    }
    Ok(scene)
}

/// Report of a run of `find` with a recording, and the last contradiction that it told.
async fn searched(
    domain: &Domain,
    robot: RecordedRobot,
    seed: u64,
) -> Result<(Report, Option<Contradiction>), String> {
    let text = |e: &dyn std::fmt::Display| e.to_string();
    let body = Body::new(Arc::new(robot));
    let scratch = tempfile::TempDir::new().map_err(|e| text(&e))?;
    let goal = run::understood("find cup A", domain, &*body.robot, None).map_err(|e| text(&e))?;
    let settings = Settings {
        robot: "recorded".into(),
        scene: None,
        seed,
        domain: domain.config.name.clone(),
        policy: policies::PLAN.into(),
        keeping: Keeping { durability: Some(Kept::Process), ..Keeping::default() },
        remember: None,
    };
    let folder = Folder::made(&scratch.path().join("run")).map_err(|e| text(&e))?;
    let mut told = None;
    let mut hear = |event: &Event| match event {
        Event::Noted(Note::Nothing { contradiction, .. }) => told = *contradiction,
        Event::Noted(Note::Perceived { .. }) => told = None,
        _ => {}
    };
    let watcher = Watcher { stop: &Stop::default(), tell: &mut hear };
    let chooser = policies::named(policies::PLAN, seed, None).map_err(|e| text(&e))?;
    let task = Task { domain, goal: &goal, past: None };
    let report = run::pursue(task, &body, &folder, &settings, chooser, watcher).await;
    Ok((report.map_err(|e| text(&e))?, told))
}

/// Prints the counts of [`measured`] as a table.
pub fn run(count: usize, first: u64) -> Result<(), String> {
    let tallies = measured(count, first)?;
    println!(
        "{:>22} {:>5} {:>6} {:>12} {:>9} {:>15} {:>11} {:>10} {:>13} {:>6}",
        "",
        "count",
        "right",
        "off > 3 sd",
        "false yes",
        "false not there",
        "cannot tell",
        "fault told",
        "named rightly",
        "looks"
    );
    for (name, tally) in tallies.iter().filter(|(_, tally)| tally.count > 0) {
        let [right, off, yes, denied, open] = tally.answers;
        let looks = tally.looks as f64 / tally.count.max(1) as f64;
        println!(
            "{name:>22} {:>5} {right:>6} {off:>12} {yes:>9} {denied:>15} {open:>11} {:>10} {:>13} {looks:>6.1}",
            tally.count, tally.told, tally.named
        );
    }
    Ok(())
}
