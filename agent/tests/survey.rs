//! Rooms of which the body has no map: mapped, and things found in them, in one run and after a restart.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

fn descry(arguments: &[&str]) -> Value {
    let output = Command::cargo_bin("descry").unwrap().args(arguments).output().unwrap();
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{arguments:?}: {e}\n{}", String::from_utf8_lossy(&output.stderr)))
}

/// A run in a scene; what it reports.
fn run(goal: &str, scene: &str, seed: u64, folder: &Path, store: Option<&Path>) -> (Value, String) {
    let seed = seed.to_string();
    let run = folder.join(format!("{scene}-{seed}-{}", goal.replace(' ', "-"))).display().to_string();
    let mut arguments =
        vec!["do", goal, "--domain", "survey", "--scene", scene, "--json", "--seed", &seed, "--run", &run];
    let store = store.map(|store| store.display().to_string());
    arguments.extend(store.iter().flat_map(|store| ["--remember", store]));
    (descry(&arguments), run)
}

fn check_found(report: &Value, goal: &str) {
    assert_eq!(report["verdict"], "achieved", "{goal}: {}", report["why"]);
    let at = |key: &str, axis: usize| report[key][axis].as_f64().unwrap();
    for axis in 0..2 {
        let off_m = (at("position_m", axis) - at("true_position_m", axis)).abs();
        assert!(off_m < 0.12, "{goal}: {off_m} m off");
    }
}

/// The sides of the room of `one-room`, metres.
const SIDES_M: [(usize, f64); 4] = [(0, -2.2), (0, 2.2), (1, -2.0), (1, 2.0)];

#[test]
fn a_room_is_mapped_and_the_cup_is_found_on_that_map_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, store) = (folder.path(), folder.path().join("store"));
    let (report, mapped) = run("map the room", "one-room", 1, folder, Some(&store));
    assert_eq!(report["verdict"], "achieved", "{}", report["why"]);

    let maps = descry(&["memory", "query", &mapped, "--kind", "map", "--json"]);
    let map = &maps["records"].as_array().unwrap().last().unwrap()["body"];
    let number = |value: &Value| value.as_f64().unwrap();
    let pose = |key: &str, axis: usize| number(&map["map_from_chart"][key][axis]);
    // A place in the frame of what was seen first, in the body's map.
    let put = |p: &Value| {
        let (x, y) = (number(&p[0]), number(&p[1]));
        let (cos, sin) = (pose("rotation", 0), pose("rotation", 1));
        [cos * x - sin * y + pose("translation", 0), sin * x + cos * y + pose("translation", 1)]
    };
    let mut length_m = 0.0;
    for wall in map["map"]["walls"].as_array().unwrap() {
        let ends = ["from", "to"].map(|key| put(&wall[key]));
        let on = |(axis, at): &(usize, f64)| ends.iter().all(|end| (end[*axis] - at).abs() < 0.12);
        assert!(SIDES_M.iter().any(on), "no side of the room: {wall}");
        length_m += (ends[0][0] - ends[1][0]).hypot(ends[0][1] - ends[1][1]);
    }
    assert!(length_m > 14.0, "{length_m} m of walls, of 16.8");
    assert_eq!(map["surfaces"].as_array().unwrap().len(), 1, "{}", map["surfaces"]);

    let goal = "find cup A";
    let (report, found) = run(goal, "one-room", 1, folder, Some(&store));
    check_found(&report, goal);
    let maps = descry(&["memory", "query", &found, "--kind", "map", "--json"]);
    assert!(maps["records"].as_array().unwrap().is_empty(), "what is known is not mapped again");
}

#[test]
#[ignore = "two rooms, half a minute"]
fn two_rooms_are_mapped_and_the_cup_is_found_in_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let goal = "map the room and find cup A";
    check_found(&run(goal, "default", 3, folder.path(), None).0, goal);
}
