//! A taped body replays its answers, resumes at the end of the tape, and reports where it cannot.

use crate::{folders, scenes};
use descry_robots::Pixels;
use descry_robots::nalgebra::Point3;
use descry_robots::program::{Limits, ProgramRobot};
use descry_robots::recorded::{Entry, Known, RecordedRobot, Tape, TapedRobot};
use descry_robots::sim::{FaultPlan, SimOptions, SimRobot};
use descry_robots::{Failure, Place, Pose2, Robot, Sensed, Stamp, Watch, conformance};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// A tape in memory, serialised as in a record.
#[derive(Default)]
struct Memory {
    entries: Mutex<Vec<String>>,
    pixels: Mutex<BTreeMap<Stamp, Pixels>>,
}

impl Memory {
    fn entries(&self) -> Vec<Entry> {
        self.entries.lock().unwrap().iter().map(|text| serde_json::from_str(text).unwrap()).collect()
    }

    /// An empty tape with the pixels of this one.
    fn with_pixels_alone(&self) -> Memory {
        Memory { pixels: Mutex::new(self.pixels.lock().unwrap().clone()), ..Memory::default() }
    }

    fn remember(&self, sensed: &Sensed) {
        let pixels = Pixels { cloud: sensed.cloud.clone(), colour: sensed.colour.clone() };
        self.pixels.lock().unwrap().insert(sensed.stamp_ns, pixels);
    }
}

impl Tape for Memory {
    fn keep(&self, entry: &Entry) -> Result<(), String> {
        self.entries.lock().unwrap().push(serde_json::to_string(entry).unwrap());
        Ok(())
    }

    fn pixels(&self, stamp_ns: Stamp) -> Result<Pixels, String> {
        self.pixels.lock().unwrap().get(&stamp_ns).cloned().ok_or_else(|| "no such frame".into())
    }
}

/// A simulated body that loses its second frame, since failures are answers as well.
fn simulated(seed: u64) -> Arc<dyn Robot> {
    let scene = scenes::cup_on_a_table(5);
    let text = "[[fault]]\nkind = \"dropped_frame\"\nat = 2\n";
    let faults = FaultPlan::parse("faults.toml", text).unwrap();
    Arc::new(SimRobot::new(scene, SimOptions { seed, faults, ..SimOptions::default() }))
}

/// A recorded body with frames of a few pixels, and no fourth one.
fn recorded(folder: &Path) -> Arc<dyn Robot> {
    Arc::new(RecordedRobot::open(folder).unwrap().0)
}

/// The drive and the look of a step; for a body with stations, to its stations and one that does not exist.
fn step(robot: &dyn Robot, n: usize) -> (Place, Point3<f64>) {
    let place = match robot.stations() {
        None => Place::Pose(Pose2::new(-2.0 + 0.1 * n as f64, 0.3, 0.0)),
        Some(all) => Place::Station(all.get(n).map_or("nowhere".into(), |s| s.name.clone())),
    };
    (place, Point3::new(0.0, 0.1 * n as f64, 0.7))
}

/// Drives, looks and takes frames; returns all answers as text.
async fn tour(robot: &dyn Robot, tape: &Memory, steps: std::ops::Range<usize>) -> Vec<String> {
    let mut told = vec![format!("{:?}", robot.pose().await)];
    let watch = Watch::default();
    for n in steps {
        let (place, point) = step(robot, n);
        told.push(format!("{:?}", robot.travel(&place, &[step(robot, n + 1).0], &[])));
        told.push(format!("{:?}", robot.camera_at(&place, Some(&point))));
        told.push(format!("{:?}", robot.drive_to(&place, &watch).await));
        told.push(format!("{:?}", robot.look_at(&point, &watch).await));
        let sensed = robot.sense(&watch).await;
        if let Ok(sensed) = &sensed {
            tape.remember(sensed);
        }
        told.push(format!("{sensed:?} {}", robot.now_ns()));
    }
    told
}

#[tokio::test]
async fn a_tape_answers_as_the_body_did() {
    let tape = Arc::new(Memory::default());
    let live = TapedRobot::begin(simulated(5), tape.clone());
    let told = tour(&live, &tape, 0..2).await;
    live.finish().unwrap();
    assert!(told.iter().any(|t| t.contains("SensorDropped")), "a failure is part of it");
    let again = Arc::new(tape.with_pixels_alone());
    let robot = TapedRobot::replay(Known::of(&live), again.clone(), tape.entries(), Some(1e6));
    assert_eq!(tour(&robot, &again, 0..2).await, told);
    robot.finish().unwrap();
    assert_eq!(again.entries(), tape.entries(), "what is played is kept as it was");
    assert_eq!(robot.ended(), None);
}

#[tokio::test]
async fn a_run_goes_on_where_its_tape_ends() {
    for folder in [folders::side_by_side(), folders::listed()] {
        check_goes_on(folder.path()).await;
    }
}

/// Checks that a run on a recording, cut anywhere, comes to the same answers and the same tape.
async fn check_goes_on(folder: &Path) {
    let tape = Arc::new(Memory::default());
    let whole = TapedRobot::begin(recorded(folder), tape.clone());
    let told = tour(&whole, &tape, 0..4).await;
    whole.finish().unwrap();
    assert!(told.iter().any(|t| t.contains("no station \\\"nowhere")), "a failure is part of it: {told:?}");
    let all = tape.entries();
    for cut in 0..=all.len() {
        let kept = Arc::new(tape.with_pixels_alone());
        let robot = TapedRobot::go_on(recorded(folder), kept.clone(), all[..cut].to_vec());
        assert_eq!(tour(&robot, &kept, 0..4).await, told, "cut after {cut} of {}", all.len());
        robot.finish().unwrap();
        assert_eq!(kept.entries(), all, "cut after {cut} of {}", all.len());
    }
}

#[tokio::test]
async fn what_is_not_on_the_tape_ends_it() {
    let tape = Arc::new(Memory::default());
    let live = TapedRobot::begin(simulated(5), tape.clone());
    tour(&live, &tape, 0..2).await;
    let replay = |entries| TapedRobot::replay(Known::of(&live), tape.clone(), entries, None);
    let watch = Watch::default();
    let cases = [
        (tape.entries(), "the record has \"say where it is\" where the body is now asked to take a frame"),
        (Vec::new(), "the record ends before the body was asked to take a frame"),
    ];
    for (entries, because) in cases {
        let robot = replay(entries);
        let failure = robot.sense(&watch).await.unwrap_err();
        assert_eq!(failure, Failure::Broken { because: because.into() });
        assert_eq!(robot.ended().as_deref(), Some(because));
    }
    let robot = replay(tape.entries());
    let before = tape.entries().len();
    for n in 7..9 {
        assert!(robot.travel(&step(&robot, n).0, &[step(&robot, n + 1).0], &[])[0].is_err());
    }
    assert!(robot.ended().is_some());
    assert_eq!(tape.entries().len(), before + 1, "where it ended is marked once");
    // A body of another seed took another time for its drives.
    let other = TapedRobot::go_on(simulated(6), tape.clone(), tape.entries());
    let mut answers = vec![other.pose().await.map(|_| ())];
    for n in 0..2 {
        let (place, point) = step(&other, n);
        answers.push(other.drive_to(&place, &watch).await.map(|_| ()));
        answers.push(other.look_at(&point, &watch).await.map(|_| ()));
        answers.push(other.sense(&watch).await.map(|_| ()));
    }
    let broken = |a: &Result<(), Failure>| matches!(a, Err(Failure::Broken { because }) if because.contains("not the body"));
    assert!(answers.iter().any(broken), "{answers:?}");
}

/// The template as a program; none without Python.
fn started() -> Option<Arc<dyn Robot>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/template.py");
    if !std::process::Command::new("python3").arg("--version").output().is_ok_and(|o| o.status.success()) {
        println!("SKIPPED: python3 is not here");
        return None;
    }
    let command = format!("python3 '{}'", file.display());
    Some(Arc::new(ProgramRobot::start(&command, Limits::default()).unwrap()))
}

#[tokio::test]
async fn a_frame_is_of_what_the_head_was_told_to_look_at_also_by_a_body_that_was_started_anew() {
    let (Some(first), Some(second)) = (started(), started()) else { return };
    let tape = Arc::new(Memory::default());
    let begun = TapedRobot::begin(first, tape.clone());
    let (watch, aside) = (Watch::default(), Point3::new(-1.0, 1.0, 0.0));
    begun.pose().await.unwrap();
    begun.look_at(&aside, &watch).await.unwrap();
    let entries = tape.entries();
    let wanted = begun.sense(&watch).await.unwrap();

    let goes_on = TapedRobot::go_on(second, tape.clone(), entries);
    goes_on.pose().await.unwrap();
    goes_on.look_at(&aside, &watch).await.unwrap();
    let taken = goes_on.sense(&watch).await.unwrap();
    assert_eq!(taken.map_from_camera, wanted.map_from_camera);
}

#[tokio::test]
async fn a_body_on_tape_conforms() {
    let scene = scenes::cup_on_a_table(5);
    let live = Arc::new(SimRobot::new(scene, SimOptions { seed: 5, ..SimOptions::default() }));
    conformance::check(&TapedRobot::begin(live, Arc::new(Memory::default()))).await.unwrap();
}
