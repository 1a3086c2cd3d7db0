//! Programs as bodies: the template conforms, and every violation is a failure with its reason.

use descry_robots::conformance;
use descry_robots::nalgebra::{Point3, Vector2};
use descry_robots::program::{Limits, ProgramRobot};
use descry_robots::{
    Answer, CancellationToken, Failure, Grasp, Place, Pose2, Push, Request, Robot, Travel, Watch,
};
use std::path::Path;
use std::time::Duration;

/// Limits short enough for tests.
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

/// A program started externally.
struct Elsewhere(std::process::Child);

impl Drop for Elsewhere {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a Python file that listens at an address, and connects once it does.
fn reached(
    file: &str,
    what: &[&str],
    address: &str,
    limits: Limits,
) -> (Elsewhere, Result<ProgramRobot, Failure>) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let started = std::process::Command::new("python3").arg(file).args(what).arg(address).spawn();
    let program = Elsewhere(started.unwrap());
    for _ in 0..400 {
        match ProgramRobot::connect(address, limits) {
            Err(Failure::Broken { because }) if because.contains("nobody answers there") => {
                std::thread::sleep(Duration::from_millis(50));
            }
            answer => return (program, answer),
        }
    }
    panic!("nobody ever listened on {address}");
}

fn free_port() -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().to_string()
}

#[tokio::test]
async fn the_template_conforms_over_sockets_to_one_after_the_other() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let unix = folder.path().join("robot").display().to_string();
    for address in [unix, free_port()] {
        let (_program, robot) = reached("python/template.py", &[], &address, Limits::default());
        conformance::check(&robot.unwrap()).await.unwrap();
        let again = ProgramRobot::connect(&address, Limits::default()).unwrap();
        assert!(again.now_ns() > 0, "it is the same body, and its clock has gone on");
        again.pose().await.unwrap();
    }
}

#[test]
fn where_nobody_listens_the_reason_says_so() {
    let check = |address: &str, words: &str| {
        let failure = ProgramRobot::connect(address, HURRIED).map(|_| ()).unwrap_err();
        assert!(failure.kind() == "broken" && failure.because().contains(words), "{address}: {failure}");
    };
    check("/nowhere/robot", "nobody answers there");
    check(&free_port(), "start the robot first");
    check("robot", "expected HOST:PORT");
}

/// A socket gives the same failures as pipes, without the exit status of the program.
#[tokio::test]
async fn a_rogue_program_on_a_socket_is_a_failure_with_its_reason() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (at, (what, kind, words)) in [
        ("hangs", "broken", "it was told to stop drive_to and did not within 1 s"),
        ("silent", "timed_out", "nothing was heard of drive_to for 2 s"),
        ("dies", "broken", "it has closed the connection"),
        ("endless line", "broken", "a line has more than 4194304 bytes"),
        ("endless feedback", "broken", "501 messages of feedback"),
        ("huge frame", "broken", "announced 1099511627776 bytes"),
        ("clock goes back", "broken", "its clock went from"),
        ("another request", "broken", "answered request 6 while 1 was open"),
        ("no rotation", "broken", "a transform with the quaternion"),
        ("short frame", "broken", "a frame of 6142 bytes, expected 6144"),
    ]
    .into_iter()
    .enumerate()
    {
        let address = folder.path().join(at.to_string()).display().to_string();
        let (_program, robot) = reached("tests/programs/rogue.py", &[what], &address, HURRIED);
        check_rogue_body(&robot.unwrap(), what, kind, &[words]).await;
    }
    let address = folder.path().join("mute");
    let mute = std::os::unix::net::UnixListener::bind(&address).unwrap();
    let limits = Limits { hello_s: 0.3, ..HURRIED };
    let failure = ProgramRobot::connect(&address.display().to_string(), limits).map(|_| ()).unwrap_err();
    assert!(failure.because().contains("no hello came within 0.3 s"), "{failure}");
    drop(mute);
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

/// Checks that an invalid program is refused, with these words in the reason.
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
    check_refused("a table in millimetres", &["\"table\"", "m wide, expected 30 m", "not in millimetres"]);
    check_refused("a door in millimetres", &["the door \"way\"", "is 900", "not millimetres"]);
    check_refused("a door to nowhere", &["the door \"way\"", "\"yard\"", "[\"hall\"]"]);
    check_refused("a table nowhere", &["the surface \"table\"", "\"hal\""]);
    check_refused("a heading in degrees", &["pose_sigma_rad is 2", "not degrees"]);
    check_refused("a head in millimetres", &["head.base_from_head is 1400", "not millimetres"]);
    check_refused("short map", &["9999 bytes follow the hello", "10000 cells"]);
    check_refused("two cameras", &["camera.base_from_camera", "there is a head"]);
    check_refused("hardly drives", &["base.linear_m_s is 0.000000001", "expected 0.001 or more"]);
    check_refused("hardly turns", &["base.angular_rad_s is", "expected 0.0001 or more"]);
    check_refused("keeps away from everything", &["base.clearance_m is", "expected 0 to 10"]);
    check_refused("a map of dust", &["map.resolution_m is", "expected 0.001 to 10"]);
    check_refused("only a head", &["there is a head, and no camera that it turns"]);
    check_refused("nowhere", &["it has no base", "expected one station"]);
    check_refused("no map", &["neither a map nor stations"]);
}

/// Checks the kind of failure, and words of its reason, for a misbehaving program.
async fn check_rogue(what: &str, kind: &str, words: &[&str]) {
    check_rogue_body(&ProgramRobot::start(&rogue(what), HURRIED).unwrap(), what, kind, words).await;
}

async fn check_rogue_body(robot: &ProgramRobot, what: &str, kind: &str, words: &[&str]) {
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

/// Requests for missing parts fail with the reason, without reaching the program.
#[tokio::test]
async fn a_body_without_head_arm_and_laser_conforms_and_says_what_it_lacks() {
    if !has_python() {
        return;
    }
    let robot = ProgramRobot::start(&rogue("bare"), HURRIED).unwrap();
    conformance::check(&robot).await.unwrap();
    let watch = Watch::default();
    let lacks = |failure: Failure, part: &str| {
        assert_eq!(failure, Failure::Unable { because: format!("template has no {part}") });
    };
    lacks(robot.scan(&watch).await.unwrap_err(), "laser");
    let push = Push { object: Point3::origin(), direction: Vector2::x(), distance_m: 0.1 };
    lacks(robot.push_aside(&push, &watch).await.unwrap_err(), "arm");
    let grasp = Grasp { object: Point3::origin(), width_m: 0.05 };
    lacks(robot.grasp(&grasp, &watch).await.unwrap_err(), "hand");
    lacks(robot.hand().await.unwrap_err(), "hand");
    // It looks 0.4 rad down and 0.1 rad to the left of where the base faces, whatever it is told.
    let here = robot.pose().await.unwrap().map_from_base;
    let ahead = here * Point3::new(3.0 * 0.1_f64.cos(), 3.0 * 0.1_f64.sin(), 1.4 - 3.0 * 0.4_f64.tan());
    let looked = robot.look_at(&ahead, &watch).await.unwrap();
    assert!(looked.miss_rad < 1e-6 && looked.duration_s == 0.0, "{looked:?}");
    let behind = here * Point3::new(-1.0, 0.0, 1.4);
    assert!(robot.look_at(&behind, &watch).await.unwrap().miss_rad > 2.0);
}

/// Checks that a body without a part conforms, and that requests for the part fail with the reason.
async fn check_without(what: &str, request: Request, part: &str) {
    let robot = ProgramRobot::start(&rogue(what), HURRIED).unwrap();
    conformance::check(&robot).await.unwrap();
    let (answer, _) = request.ask(&robot, &Watch::default()).await;
    let because = format!("template has no {part}");
    assert_eq!(answer, Answer::Failed(Failure::Unable { because }), "{what}");
}

#[tokio::test]
async fn every_part_may_be_missing() {
    if !has_python() {
        return;
    }
    check_without("no camera", Request::Sense, "camera").await;
    check_without("no camera", Request::LookAt(Point3::origin()), "camera").await;
    check_without("no camera", Request::Read("smoke".into()), "sense \"smoke\"").await;
    check_without("bolted down", Request::Hand, "hand").await;
    let bolted = ProgramRobot::start(&rogue("bolted down"), HURRIED).unwrap();
    let away = bolted.drive_to(&far(), &Watch::default()).await;
    assert!(matches!(away, Err(Failure::Unreachable { .. })), "{away:?}");
    let place = Place::Station("its place".into());
    let stays = bolted.travel(&place, std::slice::from_ref(&place), &[]);
    assert_eq!(stays, [Ok(Travel { distance_m: 0.0, duration_s: 0.0 })]);
}

/// A custom sensor returns any JSON value.
#[tokio::test]
async fn a_sense_is_read_by_its_name() {
    if !has_python() {
        return;
    }
    let robot = ProgramRobot::start(&rogue("reads labels"), HURRIED).unwrap();
    conformance::check(&robot).await.unwrap();
    let before_ns = robot.now_ns();
    let reading = robot.read("label reader", &Watch::default()).await.unwrap();
    assert_eq!(reading.said, serde_json::json!({ "by": "label reader", "text": "TEA" }));
    assert_eq!(reading.stamp_ns, before_ns + 200_000_000);
    let early = ProgramRobot::start(&rogue("reads tomorrow"), HURRIED).unwrap();
    let failure = early.read("label reader", &Watch::default()).await.unwrap_err();
    assert_eq!(failure.kind(), "broken");
    assert!(failure.because().contains("a reading of"), "{failure}");
}

/// Behaviour that is allowed: the program answers, and the next request is answered as well.
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
