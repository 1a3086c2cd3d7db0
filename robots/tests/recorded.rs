//! Reading of recordings: contents, and messages about faults.

use crate::folders;
use descry_robots::nalgebra::{Point3, Vector3};
use descry_robots::recorded::{RecordedRobot, Recording};
use descry_robots::{Failure, Place, Robot, Watch};
use std::fs;
use std::path::{Path, PathBuf};

fn names(recording: &Recording) -> Vec<&str> {
    recording.frames.iter().map(|f| f.name.as_str()).collect()
}

#[tokio::test]
async fn frames_side_by_side_are_read() {
    let folder = folders::side_by_side();
    let robot = RecordedRobot::open(folder.path()).unwrap().0;
    assert_eq!(names(&Recording::open(folder.path()).unwrap()), ["frame-9", "frame-10", "frame-100"]);
    let watch = Watch::default();
    let driven = robot.drive_to(&Place::Station("frame-100".into()), &watch).await.unwrap();
    assert!((driven.distance_m - 2.0).abs() < 1e-9);
    assert!((driven.duration_s - 2.0 / 0.3).abs() < 1e-9);
    let sensed = robot.sense(&watch).await.unwrap();
    assert!(sensed.depth_m[0].is_nan() && sensed.depth_m[1].is_nan());
    let (u, v) = (5u32, 7u32);
    let i = (v * folders::SIZE.0 + u) as usize;
    let z = f64::from(folders::depth_mm(2, u, v)) / 1000.0;
    assert!((f64::from(sensed.depth_m[i]) - z).abs() < 1e-6);
    let p = sensed.cloud.points[i];
    let expected = Point3::new((5.0 - 8.0) / 20.0 * z, (7.0 - 6.0) / 21.0 * z, z);
    assert!((p.cast::<f64>() - expected).norm() < 1e-6);
    // The rows of the pose: camera z is the world's x, so depth moves along it.
    let world = sensed.map_from_camera * Point3::new(0.0, 0.0, 1.0);
    assert!((world - Point3::new(3.5, 0.25, 1.2)).norm() < 1e-9);
    assert!(sensed.colour.is_none() && sensed.cloud.colours.is_none());
    robot.drive_to(&Place::Station("frame-10".into()), &watch).await.unwrap();
    let sensed = robot.sense(&watch).await.unwrap();
    assert!(sensed.colour.is_some_and(|c| !c.registered));
    assert!(sensed.cloud.colours.is_none(), "colours of other pixels are no colours of the points");
}

#[tokio::test]
async fn lists_are_read() {
    let folder = folders::listed();
    let robot = RecordedRobot::open(folder.path()).unwrap().0;
    assert_eq!(names(&Recording::open(folder.path()).unwrap()), ["1", "2", "10"]);
    assert_eq!(robot.description().up, Some(Vector3::z()));
    assert_eq!(robot.pose().await.unwrap().station.as_deref(), Some("2"), "the start that was asked for");
    let sensed = robot.sense(&Watch::default()).await.unwrap();
    assert_eq!(sensed.cloud.colours.unwrap()[3], [3, 0, 2]);
    assert!((sensed.map_from_camera.translation.vector - Vector3::x()).norm() < 1e-9);
    let looked = robot.look_at(&Point3::new(1.0, 0.0, 5.0), &Watch::default()).await.unwrap();
    assert!(looked.miss_rad < 1e-6);
}

/// Checks the message for one fault in a valid folder.
fn check_mistake(make: fn() -> tempfile::TempDir, spoil: &dyn Fn(&Path), line: usize, words: &[&str]) {
    let folder = make();
    spoil(folder.path());
    let error = match Recording::open(folder.path()) {
        Ok(_) => panic!("nothing was said, expected {words:?}"),
        Err(error) => error,
    };
    let text = error.to_string();
    assert_eq!(error.line, line, "{text}");
    for word in words {
        assert!(text.contains(word), "no {word:?} in: {text}");
    }
}

fn put(name: &'static str, text: &'static str) -> impl Fn(&Path) {
    move |folder: &Path| fs::write(folder.join(name), text).unwrap()
}

fn gone(name: &'static str) -> impl Fn(&Path) {
    move |folder: &Path| fs::remove_file(folder.join(name)).unwrap()
}

fn eight_bits(name: &'static str) -> impl Fn(&Path) {
    let image = descry_robots::image::GrayImage::new(folders::SIZE.0, folders::SIZE.1);
    move |folder: &Path| image.save(folder.join(name)).unwrap()
}

#[test]
fn mistakes_beside_frames_are_named() {
    let check = |spoil: &dyn Fn(&Path), line, words: &[&str]| {
        check_mistake(folders::side_by_side, spoil, line, words);
    };
    check(&gone("frame-10.pose.txt"), 0, &["frame-10.depth.png", "frame-10.pose.txt is missing", "4x4"]);
    check(&gone("frame-10.depth.png"), 0, &["frame-10.pose.txt", "without a frame"]);
    check(&gone("camera-intrinsics.txt"), 0, &["camera", "recording.toml", "fx = ...", "16x12"]);
    check(&put("camera-intrinsics.txt", "20 0 8\n0 21\n0 0 1\n"), 2, &["2 numbers", "expected 3"]);
    check(&put("camera-intrinsics.txt", "20 0 8\n0 -21 6\n0 0 1\n"), 2, &["-21", "above zero"]);
    let camera = |text| put("camera-intrinsics.txt", text);
    check(&camera("20 0 8\n0 21 6\n0 0 2\n"), 3, &["2 in column 3", "expected 1"]);
    check(&camera("20 0.5 8\n0 21 6\n0 0 1\n"), 1, &["0.5 in column 2", "expected 0"]);
    check(&camera("20 0 17\n0 21 6\n0 0 1\n"), 1, &["cx is 17", "16 columns"]);
    check(&camera("20 0 8\n0 21 -1\n0 0 1\n"), 2, &["cy is -1", "12 rows"]);
    check(&eight_bits("frame-10.depth.png"), 0, &["frame-10.depth.png", "L8 pixels", "16 bits"]);
    let millimetres = |folder: &Path| {
        for (k, frame) in ["9", "10", "100"].into_iter().enumerate() {
            let text = format!("0 0 1 {k}500\n-1 0 0 250\n0 -1 0 1200\n0 0 0 1\n");
            fs::write(folder.join(format!("frame-{frame}.pose.txt")), text).unwrap();
        }
    };
    check(&millimetres, 0, &["2000 m from that of frame frame-9", "in metres?"]);
    let pose = |text| put("frame-100.pose.txt", text);
    check(
        &pose("1 0 0 0\n0 1 0 0\n0 0 l 0\n0 0 0 1\n"),
        3,
        &["frame-100.pose.txt:3:5", "\"l\" is no number"],
    );
    check(&pose("1 0 0 0\n0 1 0 0\n0 0 1 0\n"), 4, &["3 lines", "expected 4"]);
    check(&pose("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n"), 4, &["0 0 0 1"]);
    check(&pose("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n"), 1, &["no rotation", "scale"]);
    check(&pose("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n"), 1, &["no rotation", "mirror"]);
    check(&put("frame-10.depth.png", "no picture"), 0, &["frame-10.depth.png", "is no image"]);
    check(&put("recording.toml", "start = \"frame-11\"\n"), 0, &["frame-11", "frame-9, frame-10"]);
    check(&put("recording.toml", "depth_scale = 0\n"), 1, &["found 0", "above zero"]);
    check(&put("recording.toml", "\nlinear_m_s = 1e-300\n"), 2, &["found 1e-300", "0.001 or more"]);
    check(&put("recording.toml", "angular_deg_s = 1e-9\n"), 1, &["found 1e-9", "0.01 or more"]);
    check(&put("recording.toml", "\ndeph_scale = 1\n"), 2, &["unknown field", "depth_scale"]);
    check(&put("recording.toml", "folder = \"elsewhere\"\n"), 1, &["no folder", "elsewhere"]);
}

/// Checks the message for a surface in `recording.toml`.
fn check_surface(outline: &str, height: &str, line: usize, words: &[&str]) {
    let text = format!("[[surface]]\nname = \"table\"\noutline_m = {outline}\nheight_m = {height}\n");
    let spoil = |folder: &Path| fs::write(folder.join("recording.toml"), &text).unwrap();
    check_mistake(folders::side_by_side, &spoil, line, words);
}

#[test]
fn surfaces_that_cannot_be_are_named() {
    let check = check_surface;
    let table = "[[-0.6, -0.4], [0.6, -0.4], [0.6, 0.4], [-0.6, 0.4]]";
    check(&table.replace("0.", "60"), "750", 3, &["\"table\"", "1212 m wide", "30 m", "millimetres"]);
    check(table, "750", 4, &["found 750", "within 100 m", "millimetres"]);
    check(table, "nan", 4, &["found NaN", "height"]);
    let another = format!("0.7\n[[surface]]\nname = \"table\"\noutline_m = {table}\nheight_m = 0.7");
    check(table, &another, 6, &["surfaces 1 and 2", "\"table\""]);
    check("[[0, 0], [1, 0]]", "0.7", 3, &["no outline", "three corners"]);
    check("[[0, 0], [1, 1], [2, 2]]", "0.7", 3, &["area of 0 m2", "one line"]);
    check("[[0, 0], [1, 1], [1, 0], [0, 1]]", "0.7", 3, &["after corner 1 and corner 3", "order"]);
}

#[test]
fn mistakes_in_lists_are_named() {
    let check = |spoil: &dyn Fn(&Path), line, words: &[&str]| {
        check_mistake(folders::listed, spoil, line, words);
    };
    check(&gone("pose.txt"), 0, &["pose.txt", "tx ty tz qx qy qz qw"]);
    check(&gone("depth/10.pgm"), 5, &["3 poses for 2 frames"]);
    check(&gone("recording.toml"), 0, &["which camera", "[camera]"]);
    check(&put("pose.txt", "0 0 0 0 0 0 1\n1 2 3 0 0 1\n2 0 0 0 0 0 1\n"), 2, &["6 numbers", "expected 7"]);
    check(&put("pose.txt", "0 0 0 0 0 0 1\n0 0 0 0 0 0 1\n2 0 0 0 0 0 2\n"), 3, &["length 2.000"]);
    check(&put("recording.toml", "[camera]\nfx = 0\nfy = 1\ncx = 1\ncy = 1\n"), 2, &["found 0", "focal"]);
    let outside = "[camera]\nfx = 20\nfy = 21\ncx = 8\ncy = 240\n";
    check(&put("recording.toml", outside), 0, &["[camera]: cy is 240", "12 rows"]);
    let twice = |folder: &Path| {
        fs::copy(folder.join("depth/2.pgm"), folder.join("depth/2.png")).unwrap();
    };
    check(&twice, 0, &["2.pgm and 2.png", "remove one"]);
    let empty = |folder: &Path| fs::remove_dir_all(folder.join("depth")).unwrap();
    check(&empty, 0, &["no frames", "NAME.depth.png"]);
}

#[test]
fn a_recording_can_be_described_from_elsewhere() {
    let folder = folders::listed();
    fs::remove_file(folder.path().join("recording.toml")).unwrap();
    let elsewhere = tempfile::TempDir::new().unwrap();
    let file = elsewhere.path().join("room.toml");
    let camera = "[camera]\nfx = 20\nfy = 21\ncx = 8\ncy = 6\n";
    fs::write(&file, format!("folder = {:?}\n{camera}", folder.path())).unwrap();
    assert_eq!(Recording::open(&file).unwrap().frames.len(), 3);
    let missing = Recording::open(&elsewhere.path().join("nothing")).unwrap_err();
    assert!(missing.to_string().contains("no such folder"), "{missing}");
}

#[tokio::test]
async fn frames_where_tracking_was_lost_are_no_stations() {
    let folder = folders::side_by_side();
    let lost = "-inf -inf -inf -inf\n".repeat(3) + "0 0 0 1\n";
    fs::write(folder.path().join("frame-9.pose.txt"), &lost).unwrap();
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(
        (names(&recording), &recording.lost),
        (vec!["frame-10", "frame-100"], &vec!["frame-9".into()])
    );
    for name in ["frame-10", "frame-100"] {
        fs::write(folder.path().join(format!("{name}.pose.txt")), &lost).unwrap();
    }
    assert!(Recording::open(folder.path()).unwrap_err().to_string().contains("no frame has a pose"));
}

#[tokio::test]
async fn a_frame_that_spoils_later_is_dropped_with_its_name() {
    let folder = folders::side_by_side();
    let robot = RecordedRobot::open(folder.path()).unwrap().0;
    let file = folder.path().join("frame-9.depth.png");
    let bytes = fs::read(&file).unwrap();
    fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    match robot.sense(&Watch::default()).await {
        Err(Failure::SensorDropped { because, .. }) => assert!(because.contains("frame-9"), "{because}"),
        other => panic!("{:?}", other.map(|s| s.stamp_ns)),
    }
}

fn shared(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data").join(name);
    assert!(path.is_dir(), "{} is not there", path.display());
    path
}

#[tokio::test]
#[ignore = "data: frames of ../shared/data"]
async fn a_real_kitchen_is_driven_through() {
    let path = shared("kitchen");
    let robot = RecordedRobot::open(&path).unwrap().0;
    let stations = robot.stations().unwrap().to_vec();
    assert!(stations.len() > 10);
    for station in &stations[..3] {
        robot.drive_to(&Place::Station(station.name.clone()), &Watch::default()).await.unwrap();
        let sensed = robot.sense(&Watch::default()).await.unwrap();
        assert!(sensed.cloud.count_finite() > sensed.cloud.len() / 2, "{}", station.name);
    }
}

#[test]
#[ignore = "data: frames of ../shared/data"]
fn a_real_room_asks_for_its_camera() {
    let path = shared("dining_room");
    let error = Recording::open(&path).unwrap_err().to_string();
    assert!(error.contains("which camera"), "{error}");
    let elsewhere = tempfile::TempDir::new().unwrap();
    let file = elsewhere.path().join("dining_room.toml");
    let folder = path.canonicalize().unwrap();
    let camera = "[camera]\nfx = 518.0\nfy = 519.0\ncx = 325.5\ncy = 253.5\n";
    fs::write(&file, format!("folder = {folder:?}\nregistered = true\n{camera}")).unwrap();
    let recording = Recording::open(&file).unwrap();
    let depth_m = recording.depth_m(&recording.frames[0]).unwrap();
    assert!(depth_m.iter().filter(|z| (0.3..10.0).contains(*z)).count() > depth_m.len() / 2);
}
