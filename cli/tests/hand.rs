//! Manipulation in a flat with injected faults.

use crate::binary;
use std::fs;

use descry_domains::load::Domain;
use tempfile::TempDir;

/// Exit code and narration of a goal pursued in the flat with these faults.
fn pursued(goal: &str, seed: u64, faults: &str) -> (Option<i32>, String) {
    let folder = TempDir::new().expect("a folder can be made");
    let scene = Domain::load("home").expect("a built-in domain").scenes["default"].clone();
    fs::write(folder.path().join("flat.toml"), format!("{scene}\n{faults}")).expect("a scene");
    let seed = seed.to_string();
    let run = ["do", goal, "--domain", "home", "--scene", "flat.toml", "--seed", &seed, "--run", "run"];
    let output = binary::outcome(folder.path(), &run);
    let said = [output.stderr, output.stdout].concat();
    (output.status.code(), String::from_utf8_lossy(&said).into_owned())
}

/// Narration of a goal that is achieved in the flat with these faults.
fn achieved(goal: &str, seed: u64, faults: &str) -> String {
    let (code, said) = pursued(goal, seed, faults);
    assert_eq!(code, Some(0), "{said}");
    said
}

#[test]
#[ignore = "slow: a drop in the home"]
fn what_was_lost_out_of_the_hand_is_not_said_not_to_be_there() {
    let faults = "[[fault]]\nkind = \"object_dropped\"\nchance = 1.0\n";
    let (code, said) = pursued("bring cup A to the desk", 92002, faults);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("cannot tell: ") && said.contains("it was lost out of the hand"), "{said}");
}

#[test]
fn the_hand_reaches_for_what_was_seen_from_where_the_body_stands() {
    let faults = "[[fault]]\nkind = \"bad_localisation\"\nchance = 0.5\n";
    let said = achieved("pick up cup A", 92005, faults);
    assert!(!said.contains("the hand closed on nothing"), "{said}");
}

#[test]
fn what_is_in_the_hand_is_said_to_be_there_and_nowhere_else() {
    let folder = TempDir::new().expect("a folder can be made");
    let run = ["do", "pick up cup A", "--domain", "home", "--seed", "95001", "--run", "run", "--json"];
    let report = binary::check(folder.path(), &run, 0);
    assert!(report["position_m"].is_null() && report["on"].is_null(), "{report}");
    let held = report["objects"].as_array().expect("a list").iter().find(|o| o["asked"] == true);
    assert!(held.is_some_and(|held| held["position_m"].is_null()), "{report}");
    assert!(!report["true_position_m"].is_null(), "{report}");
}

#[test]
#[ignore = "slow: a slip in the home"]
fn what_slid_out_of_the_hand_is_looked_for_where_it_did() {
    let said = achieved("bring cup A to the desk", 93014, "[[fault]]\nkind = \"grasp_slips\"\nat = 1\n");
    let (_, after) = said.split_once("it slid out of the hand").expect("it slips once");
    let look = after.split("do        looking at the ").nth(1);
    assert!(look.is_some_and(|look| look.starts_with("kitchen table from ")), "{look:?}: {said}");
}

#[test]
#[ignore = "slow: a slip in the home"]
fn what_was_found_is_not_looked_for_elsewhere() {
    let said = achieved("bring cup A to the desk", 91004, "[[fault]]\nkind = \"grasp_slips\"\nat = 1\n");
    let taken = said.find("the hand is closed to").expect("it was taken");
    assert!(said[..taken].contains("cup A              8"), "it had been found: {said}");
    assert!(!said[..taken].contains(" from desk-"), "{said}");
}

#[test]
fn what_is_just_beyond_the_hand_is_taken_from_elsewhere() {
    let said = achieved("bring cup A to the desk", 82001, "");
    assert!(!said.contains("the arm reaches"), "{said}");
}
