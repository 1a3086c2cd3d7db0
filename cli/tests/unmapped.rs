//! Recordings without a map: every visible surface is a support surface, and one that may be the floor proves
//! nothing.

use std::fs;
use std::path::Path;

use crate::binary::check;
use descry_robots::image::{ImageBuffer, Luma};
use descry_robots::nalgebra::Point3;
use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::{Place, Pose2, Robot, Watch};
use tempfile::TempDir;

const TABLES: &str = r#"
title = "Two tables side by side, one higher"
[room]
size_m = [8.0, 8.0]
[[surface]]
name = "low"
position_m = [-0.75, 0.0]
size_m = [1.0, 0.8]
height_m = 0.60
[[surface]]
name = "high"
position_m = [0.75, 0.0]
size_m = [0.9, 0.7]
height_m = 0.90
[start]
position_m = [0.0, -2.2]
[[object]]
name = "mug"
on = "low"
shape.mug = { diameter_m = 0.080, height_m = 0.095 }
[[object]]
name = "box"
on = "high"
shape.box = { size_m = [0.07, 0.07, 0.20] }
"#;

const CUP: &str = r#"
[[object]]
name = "cup A"
on = "high"
shape.cup = { diameter_m = 0.070, height_m = 0.104 }
"#;

/// A plane that extends beyond every view: a large table, or the floor.
const PLANE: &str = r#"
title = "A level plane without an edge"
[room]
size_m = [12.0, 12.0]
[[surface]]
name = "plane"
position_m = [0.0, 0.6]
size_m = [9.0, 6.0]
height_m = 0.10
[start]
position_m = [0.0, -2.9]
[[object]]
name = "mug"
on = "plane"
position_m = [0.0, -1.8]
shape.mug = { diameter_m = 0.080, height_m = 0.095 }
"#;

/// Writes simulated camera views from some positions, each turned to a point, as a recording.
fn record(folder: &Path, scene: &str, looks: &[([f64; 2], [f64; 3])]) {
    let spec = SceneSpec::parse("scene.toml", scene).expect("the scene is right");
    let options = SimOptions { seed: 7, ..SimOptions::default() };
    let robot = SimRobot::new(arrange(&spec, 7).expect("it can be laid out"), options);
    let watch = Watch::default();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    fs::create_dir(folder).expect("a folder can be made");
    for (k, (from, at)) in looks.iter().enumerate() {
        let at = Point3::from(*at);
        let sensed = runtime.block_on(async {
            robot
                .drive_to(&Place::Pose(Pose2::facing(from[0], from[1], &at.xy())), &watch)
                .await
                .expect("a way");
            robot.look_at(&at, &watch).await.expect("it turns");
            robot.sense(&watch).await.expect("it sees")
        });
        let c = sensed.intrinsics;
        let millimetres = |u: u32, v: u32| (sensed.depth_m[v as usize * c.width + u as usize] * 1e3) as u16;
        let depth = ImageBuffer::from_fn(c.width as u32, c.height as u32, |u, v| Luma([millimetres(u, v)]));
        depth.save(folder.join(format!("frame-{k}.depth.png"))).expect("it is written");
        let pose: Vec<String> = sensed
            .map_from_camera
            .to_homogeneous()
            .row_iter()
            .map(|r| format!("{} {} {} {}", r[0], r[1], r[2], r[3]))
            .collect();
        fs::write(folder.join(format!("frame-{k}.pose.txt")), pose.join("\n")).expect("it is written");
        let matrix = format!("{} 0 {}\n0 {} {}\n0 0 1\n", c.fx, c.cx, c.fy, c.cy);
        fs::write(folder.join("camera-intrinsics.txt"), matrix).expect("it is written");
    }
    fs::write(folder.join("recording.toml"), "up = [0.0, 0.0, 1.0]\n").expect("it is written");
}

/// Viewpoints around both tables, each turned to their middle.
fn both_tables(from: [[f64; 2]; 6]) -> Vec<([f64; 2], [f64; 3])> {
    from.map(|from| (from, [0.0, 0.0, 0.75])).to_vec()
}

#[test]
fn every_surface_in_view_is_looked_at() {
    let folder = TempDir::new().expect("a folder can be made");
    let near = [[0.0, -1.9], [1.9, -1.2], [2.0, 1.0], [0.0, 1.9], [-1.9, 1.2], [-1.9, -1.1]];
    record(&folder.path().join("with"), &format!("{TABLES}{CUP}"), &both_tables(near));
    let said = check(folder.path(), &["find", "cup A", "--robot", "recorded:with", "--json"], 0);
    let height_m = said["position_m"][2].as_f64().expect("a position");
    assert!((height_m - 0.952).abs() < 0.02, "it stands on the higher one: {said}");
    assert!(said["on"].as_str().is_some_and(|on| on.contains("table")), "{said}");
}

#[test]
#[ignore = "slow: what is nowhere is looked for on both tables"]
fn every_surface_in_view_is_searched_for_what_is_not_there() {
    let folder = TempDir::new().expect("a folder can be made");
    let far = [[0.0, -2.35], [2.35, -1.5], [2.45, 1.3], [0.0, 2.35], [-2.35, 1.5], [-2.35, -1.4]];
    record(&folder.path().join("without"), TABLES, &both_tables(far));
    let said = check(folder.path(), &["find", "cup A", "--robot", "recorded:without", "--json"], 1);
    let why = said["why"].as_str().unwrap_or_default();
    assert!(
        why.contains("of the table was seen from") && why.contains("of the second table was seen from"),
        "{why}"
    );
}

/// Writes a recording again as Replica's renderings are laid out, without what only our own layout states.
fn as_replica(own: &Path, other: &Path) {
    fs::create_dir_all(other.join("results")).expect("a folder can be made");
    let mut poses = String::new();
    let frames = (0..).take_while(|k| own.join(format!("frame-{k}.depth.png")).is_file());
    for k in frames {
        let depth = other.join(format!("results/depth{k:06}.png"));
        fs::copy(own.join(format!("frame-{k}.depth.png")), depth).expect("it is copied");
        let pose = fs::read_to_string(own.join(format!("frame-{k}.pose.txt"))).expect("it was written");
        poses += &(pose.replace('\n', " ") + "\n");
    }
    fs::write(other.join("traj.txt"), poses).expect("it is written");
    let matrix = fs::read_to_string(own.join("camera-intrinsics.txt")).expect("it was written");
    let n: Vec<&str> = matrix.split_whitespace().collect();
    let camera = format!("\"fx\": {}, \"fy\": {}, \"cx\": {}, \"cy\": {}", n[0], n[4], n[2], n[5]);
    let text = format!("{{\"camera\": {{{camera}, \"scale\": 1000}}}}");
    fs::write(other.join("cam_params.json"), text).expect("it is written");
}

#[test]
#[ignore = "slow: three searches of one recording"]
fn a_published_layout_gives_the_verdict_of_our_own() {
    let folder = TempDir::new().expect("a folder can be made");
    let near = [[0.0, -1.9], [1.9, -1.2], [2.0, 1.0], [0.0, 1.9], [-1.9, 1.2], [-1.9, -1.1]];
    record(&folder.path().join("own"), &format!("{TABLES}{CUP}"), &both_tables(near));
    as_replica(&folder.path().join("own"), &folder.path().join("other"));
    let find = |robot: &str| check(folder.path(), &["find", "cup A", "--robot", robot, "--json"], 0);
    let own = find("recorded:own");
    let said = check(folder.path(), &["import", "other", "imported", "--json"], 0);
    assert_eq!((said["layout"].as_str(), said["frames"].as_u64()), (Some("replica"), Some(6)), "{said}");
    for robot in ["recorded:other", "recorded:imported"] {
        let found = find(robot);
        let at = |said: &serde_json::Value| -> [f64; 3] {
            serde_json::from_value(said["position_m"].clone()).expect("three numbers")
        };
        let apart_m: f64 = at(&found).iter().zip(at(&own)).map(|(a, b)| (a - b).abs()).sum();
        assert_eq!((&found["verdict"], apart_m < 0.02), (&own["verdict"], true), "{robot}: {found}");
    }
}

#[test]
fn what_may_be_the_floor_proves_nothing() {
    let folder = TempDir::new().expect("a folder can be made");
    let looks = [[0.0, -2.9], [-1.0, -2.9], [1.0, -2.9]].map(|from| (from, [0.0, -1.2, 0.1]));
    record(&folder.path().join("plane"), PLANE, &looks);
    let said = check(folder.path(), &["find", "cup A", "--robot", "recorded:plane", "--json"], 1);
    let why = said["why"].as_str().unwrap_or_default();
    assert_eq!(said["verdict"], "cannot_tell", "{said}");
    assert!(why.contains("may be the floor") || why.contains("is the floor"), "{why}");
}

#[test]
fn what_takes_a_hand_is_refused_for_want_of_one() {
    let folder = TempDir::new().expect("a folder can be made");
    record(&folder.path().join("plane"), PLANE, &[([0.0, -2.9], [0.0, -1.2, 0.1])]);
    let pick = ["do", "pick up cup A", "--domain", "home", "--robot", "recorded:plane", "--json"];
    let said = check(folder.path(), &pick, 1);
    assert_eq!((&said["verdict"], &said["views"]), (&"impossible".into(), &0.into()), "{said}");
    assert!(said["why"].as_str().is_some_and(|why| why.starts_with("the body has no hand")), "{said}");
}
