//! Programs as bodies: the template conforms; whatever a program does that it must not is a failure with its reason.

use descry_robots::conformance;
use descry_robots::program::{Limits, ProgramRobot};
use descry_robots::{CancellationToken, Failure, Place, Pose2, Robot, Watch};
use std::path::Path;
use std::time::Duration;

/// Limits that a test can wait for.
const HURRIED: Limits = Limits {
    hello_s: 60.0,
    silence_s: 2.0,
    stop_s: 1.0,
    overrun_s: 2.0,
    feedback: 500,
    memory_bytes: 1 << 30,
};

fn has_python() -> bool {
    let found =
        std::process::Command::new("python3").arg("--version").output().is_ok_and(|o| o.status.success());
    if !found {
        println!("SKIPPED: python3 is not here");
    }
    found
}

fn rogue(what: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/rogue.py");
    format!("python3 '{}' '{what}'", file.display())
}

fn far() -> Place {
    Place::Pose(Pose2::new(-2.0, 1.5, 1.0))
}

#[tokio::test]
async fn the_template_conforms() {
    if !has_python() {
        return;
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/template.py");
    let command = format!("python3 '{}'", file.display());
    let robot = ProgramRobot::start(&command, Limits::default()).unwrap();
    conformance::check(&robot).await.unwrap();
}

/// A program that cannot be a robot is refused, and the reason holds these words.
fn check_refused(what: &str, words: &[&str]) {
    let limits = Limits { hello_s: if what == "no hello" { 0.5 } else { 60.0 }, ..HURRIED };
    let failure =
        ProgramRobot::start(&rogue(what), limits).map(|r| r.description().name.clone()).unwrap_err();
    assert_eq!(failure.kind(), "broken", "{what}: {failure}");
    for word in words {
        assert!(failure.because().contains(word), "{what}: {failure} does not say \"{word}\"");
    }
}

#[test]
fn what_is_no_robot_is_refused_with_the_reason() {
    if !has_python() {
        return;
    }
    check_refused("no hello", &["no hello came within 0.5 s"]);
    check_refused("dies at once", &["ended without a hello", "exit status: 3", "no camera was found"]);
    check_refused("chatters", &["said no JSON object", "my robot 1.0"]);
    check_refused("another version", &["protocol 2", "protocol 1"]);
    check_refused("unknown part", &["unknown field `camra`"]);
    check_refused("no focal length", &["camera.fx is 0"]);
    check_refused("laser beyond a turn", &["laser: 1000 readings", "a full turn at most"]);
    check_refused("two tables of one name", &["two surfaces are called \"table\""]);
    check_refused("short map", &["9999 bytes follow the hello", "10000 cells"]);
    check_refused("no map", &["neither a map nor stations"]);
}

/// What a program does when it is asked; the kind of failure that comes of it, and what the reason says.
async fn check_rogue(what: &str, kind: &str, words: &[&str]) {
    let robot = ProgramRobot::start(&rogue(what), HURRIED).unwrap();
    let watch = Watch { time_limit_s: 1.0, ..Watch::default() };
    let mut failure = robot.pose().await.err();
    if failure.is_none() {
        failure = robot.pose().await.err();
    }
    if failure.is_none() {
        failure = robot.sense(&watch).await.err();
    }
    if failure.is_none() {
        failure = robot.scan(&watch).await.err();
    }
    if failure.is_none() {
        failure = robot.drive_to(&far(), &watch).await.err();
    }
    let failure = failure.unwrap_or_else(|| panic!("{what}: nothing failed"));
    assert_eq!(failure.kind(), kind, "{what}: {failure}");
    for word in words {
        assert!(failure.because().contains(word), "{what}: {failure} does not say \"{word}\"");
    }
    let after = robot.pose().await;
    match failure {
        Failure::Broken { .. } => assert_eq!(after.unwrap_err(), failure, "{what}: what is broken stays so"),
        _ => assert!(after.is_ok(), "{what}: {:?}", after.unwrap_err()),
    }
    if let Some(child) = failure.because().split("child ").nth(1) {
        let child = child.split_whitespace().next().unwrap_or_default();
        let state = std::fs::read_to_string(format!("/proc/{child}/stat")).unwrap_or_default();
        assert!(state.is_empty() || state.contains(" Z "), "{what}: process {child} is alive: {state}");
    }
}

#[tokio::test]
async fn a_rogue_program_is_a_failure_with_its_reason() {
    if !has_python() {
        return;
    }
    check_rogue("hangs", "broken", &["told to stop drive_to", "did not within 1 s", "killed"]).await;
    check_rogue("silent", "timed_out", &["nothing was heard of drive_to for 2 s"]).await;
    check_rogue("goes on", "broken", &["told to stop drive_to"]).await;
    check_rogue("dies", "broken", &["the program has ended", "exit status: 7", "the motors are gone"]).await;
    check_rogue("leaves a child", "broken", &["the program has ended", "child "]).await;
    check_rogue("endless line", "broken", &["a line has more than 4194304 bytes"]).await;
    check_rogue("endless feedback", "broken", &["501 messages of feedback"]).await;
    check_rogue("huge frame", "broken", &["announced 1099511627776 bytes"]).await;
    check_rogue("stops by itself", "blocked", &["the emergency stop was pressed"]).await;
    check_rogue("late", "timed_out", &["drive_to took longer than 1.0 s"]).await;
    check_rogue("past its end", "broken", &["feedback of 1.5"]).await;
    check_rogue("clock goes back", "broken", &["its clock went from"]).await;
    check_rogue("eats memory", "broken", &["MemoryError"]).await;
    check_rogue("another request", "broken", &["answered request 6 while 1 was open"]).await;
    check_rogue("answers twice", "broken", &["answered request 1 while 2 was open"]).await;
    check_rogue("no pose", "broken", &["its answer to pose is none", "map_from_base"]).await;
    check_rogue("no number", "broken", &["said no JSON object"]).await;
    check_rogue("no rotation", "broken", &["a transform with the quaternion"]).await;
    check_rogue("short frame", "broken", &["a frame of 6142 bytes, expected 6144"]).await;
    check_rogue("frame of tomorrow", "broken", &["a frame of"]).await;
    check_rogue("short sweep", "broken", &["a sweep of 716 bytes, expected 720"]).await;
    check_rogue("sweep of yesterday", "broken", &["a sweep of -1 ns"]).await;
}

/// What a program may do: it answers, and what is asked next is answered too.
#[tokio::test]
async fn what_is_allowed_does_not_end_a_program() {
    if !has_python() {
        return;
    }
    for what in ["talks on standard error", "looks for secrets"] {
        let robot = ProgramRobot::start(&rogue(what), Limits::default()).unwrap();
        robot.pose().await.unwrap();
        robot.drive_to(&far(), &Watch::default()).await.unwrap();
    }
}

#[tokio::test]
async fn a_request_is_stopped_by_its_token_and_by_going_away() {
    if !has_python() {
        return;
    }
    let limits = Limits { silence_s: 60.0, stop_s: 20.0, ..HURRIED };
    let robot = ProgramRobot::start(&rogue("silent"), limits).unwrap();
    let cancel = CancellationToken::new();
    let watch = Watch { cancel: cancel.clone(), ..Watch::default() };
    let soon = async {
        tokio::time::sleep(Duration::from_millis(100)).await;
        cancel.cancel();
    };
    let goal = far();
    let (answer, ()) = tokio::join!(robot.drive_to(&goal, &watch), soon);
    assert_eq!(answer.unwrap_err(), Failure::Cancelled { because: "drive_to was stopped".into() });
    let watch = Watch::default();
    tokio::select! {
        _ = robot.drive_to(&goal, &watch) => panic!("it never arrives"),
        () = tokio::time::sleep(Duration::from_millis(300)) => {}
    }
    // The drive that nobody waits for any more was stopped, so the next request has its answer.
    robot.pose().await.unwrap();
}
