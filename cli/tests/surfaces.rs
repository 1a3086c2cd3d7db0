//! Several surfaces in one room: every answer concerns the surface in question, and names the place.

use std::fs;
use std::path::Path;

use crate::binary::{check, check_refused, outcome};
use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = r#"
title = "Two tables: the cup on the sideboard, the mug on the table"
[room]
size_m = [8.0, 6.0]
[[surface]]
name = "table"
position_m = [-1.5, 0.0]
size_m = [1.6, 0.8]
height_m = 0.72
[[surface]]
name = "sideboard"
position_m = [2.0, 0.0]
size_m = [1.2, 0.6]
height_m = 0.90
[start]
position_m = [0.3, -2.0]
[[object]]
name = "cup A"
on = "sideboard"
shape.cup = { diameter_m = 0.070, height_m = 0.104 }
[[object]]
name = "handled mug"
kind = "mug"
on = "table"
shape.mug = { diameter_m = 0.080, height_m = 0.095 }
[[object]]
name = "small box"
kind = "box"
on = "table"
shape.box = { size_m = [0.07, 0.07, 0.10] }
"#;

/// Runs a goal in the two-table scene; returns the report.
fn pursue(folder: &Path, goal: &str, seed: u64, exit: i32) -> Value {
    let (seed, run) = (seed.to_string(), format!("{}-{seed}", goal.replace(' ', "-")));
    let arguments = ["do", goal, "--scene", "two.toml", "--seed", &seed, "--run", &run, "--json"];
    check(folder, &arguments, exit)
}

fn scene() -> TempDir {
    let folder = TempDir::new().expect("a folder can be made");
    fs::write(folder.path().join("two.toml"), SCENE).expect("the scene is written");
    folder
}

/// Asks which cups are in a room of the home.
fn check_room(room: &str, exit: i32, verdict: &str, words: &str) {
    let folder = TempDir::new().expect("a folder can be made");
    let goal = format!("which cups are in the {room}");
    let arguments = ["do", &goal, "--domain", "home", "--seed", "95002", "--run", "run", "--json"];
    let report = check(folder.path(), &arguments, exit);
    assert_eq!(report["verdict"], verdict, "{report}");
    assert!(report["why"].as_str().is_some_and(|why| why.contains(words)), "{report}");
}

#[test]
fn what_is_said_of_a_room_names_it() {
    check_room("hall", 1, "cannot_tell", "a cup in the hall: no surface is known there");
}

#[test]
#[ignore = "slow: all cups of a room"]
fn what_is_found_in_a_room_names_it() {
    check_room("kitchen", 0, "achieved", " in the kitchen: ");
}

#[test]
fn none_of_a_kind_is_looked_for_until_that_can_be_said() {
    let folder = TempDir::new().expect("a folder can be made");
    let none = ["--scene", "no-cup-a", "--seed", "95012", "--run", "none", "--json"];
    let report = check(folder.path(), &[&["do", "find all cup A"], &none[..]].concat(), 1);
    let why = report["why"].as_str().unwrap_or_default();
    assert!(why.starts_with("there is no cup A: "), "{report}");
}

#[test]
fn changes_are_told_of_surfaces_that_an_earlier_run_looked_at() {
    let folder = TempDir::new().expect("a folder can be made");
    for (goal, words) in [
        ("find cup A", "cup A stands on the "),
        (
            "what has changed on the lower board",
            "nothing is remembered of the lower board: no earlier run looked at it",
        ),
    ] {
        let with = ["--domain", "home", "--seed", "95002", "--remember", "seen", "--json"];
        let output = outcome(folder.path(), &[&["do", goal], &with[..]].concat());
        let report: Value = serde_json::from_slice(&output.stdout).expect("it is JSON");
        assert!(report["why"].as_str().is_some_and(|why| why.contains(words)), "{report}");
    }
}

#[test]
fn a_verdict_is_about_the_surface_that_was_asked_about() {
    check_verdicts(&[1]);
}

#[test]
#[ignore = "slow: another arrangement"]
fn another_verdict_is_about_the_surface_that_was_asked_about() {
    check_verdicts(&[4]);
}

fn check_verdicts(seeds: &[u64]) {
    let folder = scene();
    for &seed in seeds {
        for (goal, exit, answer, on) in [
            ("find cup A", 0, None, Some("sideboard")),
            ("is cup A on the sideboard", 0, Some("yes"), Some("sideboard")),
            ("is cup A on the table", 1, Some("no"), None),
            ("is mug on the sideboard", 1, Some("no"), None),
        ] {
            let report = pursue(folder.path(), goal, seed, exit);
            let what = format!("{goal}, seed {seed}: {report}");
            assert_eq!(report["answer"].as_str(), answer, "{what}");
            assert_eq!(report["on"].as_str(), on, "{what}");
            let truly = if goal.contains("mug") { "table" } else { "sideboard" };
            assert_eq!(report["true_on"], truly, "{what}");
            if on.is_none() {
                let asked = goal.rsplit(' ').next().expect("a goal has words");
                let why = report["why"].as_str().unwrap_or_default();
                assert!(
                    why.contains(&format!("is not on the {asked}")) && why.contains("was seen from"),
                    "{what}"
                );
            }
        }
    }
}

#[test]
fn all_of_a_kind_are_marked_among_what_else_is_there() {
    let folder = scene();
    let report = pursue(folder.path(), "find all cups", 2, 0);
    let marked: Vec<(&str, &str)> = report["objects"]
        .as_array()
        .expect("there are objects")
        .iter()
        .filter(|o| o["asked"] == true)
        .map(|o| (o["label"].as_str().unwrap_or_default(), o["on"].as_str().unwrap_or_default()))
        .collect();
    assert_eq!(marked, [("cup A", "sideboard")], "{report}");
    assert!(report["objects"].as_array().is_some_and(|o| o.len() > 1), "{report}");
}

#[test]
fn one_head_looks_at_one_surface_at_a_time() {
    let folder = scene();
    let output = outcome(folder.path(), &["do", "find all cups", "--scene", "two.toml", "--run", "r"]);
    let said = String::from_utf8_lossy(&output.stderr);
    let mut last_end_s = f64::NEG_INFINITY;
    for line in said.lines().map(str::trim) {
        if line.starts_with("plan") {
            last_end_s = f64::NEG_INFINITY;
        }
        let Some((start, rest)) = line.split_once(" s  looking at ") else { continue };
        let Some(duration) =
            rest.rsplit(", ").next().and_then(|d| d.trim_end_matches(" s").parse::<f64>().ok())
        else {
            continue;
        };
        let start_s: f64 = start.parse().expect("a step has a time");
        assert!(start_s >= last_end_s, "two looks at once: {line}\n{said}");
        last_end_s = start_s + duration;
    }
    assert!(last_end_s > 0.0, "no look in {said}");
}

#[test]
fn a_surface_that_is_not_there_is_refused() {
    let folder = scene();
    check_refused(
        folder.path(),
        &["do", "is cup A on the shelf", "--scene", "two.toml", "--run", "r"],
        2,
        &["\"shelf\"", "table, sideboard"],
    );
}

/// Regressions: the border of a box's shadow mistaken for the end of a table, and a cup erased by a third
/// view.
#[test]
fn a_cup_is_found_where_it_is() {
    check_found(&[("cup A", "two-rooms", "8177")]);
}

/// The last one stands on a board between uprights, of which the first look shows no end.
#[test]
#[ignore = "slow: two more searches"]
fn more_things_are_found_where_they_are() {
    check_found(&[("cup A", "two-rooms", "9124"), ("white cylinder", "default", "31003")]);
}

fn check_found(arrangements: &[(&str, &str, &str)]) {
    let folder = TempDir::new().expect("a folder can be made");
    for &(thing, scene, seed) in arrangements {
        let place = ["--domain", "home", "--scene", scene, "--seed", seed, "--run", seed, "--json"];
        let report = check(folder.path(), &[&["find", thing], place.as_slice()].concat(), 0);
        let [at, truly] = ["position_m", "true_position_m"].map(|key| {
            report[key].as_array().into_iter().flatten().filter_map(Value::as_f64).collect::<Vec<_>>()
        });
        let off_m = at.iter().zip(&truly).map(|(f, t)| (f - t).powi(2)).sum::<f64>().sqrt();
        assert!(off_m < 0.02 && at.len() == 3, "seed {seed}: {off_m:.3} m off: {report}");
    }
}

/// Compares the cups found in two rooms with their true positions, which separate searches report. The agent
/// may remain unsure about further cups, but must not miss one.
fn check_all_cups(arrangements: &[(u64, &str)]) {
    const TOLERANCE_M: f64 = 0.02;
    let folder = TempDir::new().expect("a folder can be made");
    let report = |seed: u64, goal: &str| {
        let (seed, run) = (seed.to_string(), format!("{}-{seed}", goal.replace(' ', "-")));
        let place = ["--domain", "home", "--scene", "two-rooms", "--seed", &seed, "--run", &run, "--json"];
        let output = outcome(folder.path(), &[&["do", goal], place.as_slice()].concat());
        assert!(matches!(output.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).expect("it is JSON")
    };
    let at = |value: &Value| -> Vec<f64> {
        value.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
    };
    for &(seed, cup) in arrangements {
        let all = report(seed, "find all cups with confidence 0.96");
        let found = all["objects"].as_array().into_iter().flatten().find(|o| o["label"] == cup);
        let found = found.unwrap_or_else(|| panic!("seed {seed}: no {cup} in {all}"));
        assert!(found["confidence"].as_f64() > Some(0.8), "seed {seed}: {found}");
        let found = at(&found["position_m"]);
        let truly = at(&report(seed, &format!("find {cup}"))["true_position_m"]);
        let off_m = found.iter().zip(&truly).map(|(f, t)| (f - t).powi(2)).sum::<f64>().sqrt();
        assert!(off_m < TOLERANCE_M, "seed {seed}: {cup} is {off_m:.3} m from where it stands, {truly:?}");
    }
}

/// Regressions: distant views of a board that blur the objects on it, and a circle fitted too near through
/// the few points of a cup at three metres.
#[test]
#[ignore = "slow: four searches of two rooms"]
fn cups_in_two_rooms_are_all_found_and_where_they_are() {
    check_all_cups(&[(11035, "cup A"), (12056, "cup A")]);
}

/// Regressions: a plane that cuts through the wall behind a board, a measurement that no object explains,
/// views that slide along a counter, and a cup at three metres with too few points for an object.
#[test]
#[ignore = "slow: a minute: more arrangements in which a cup was missed"]
fn cups_in_more_rooms_are_all_found_and_where_they_are() {
    check_all_cups(&[(5123, "cup A"), (5103, "cup B"), (7034, "cup B"), (8169, "cup A"), (12020, "cup A")]);
}
