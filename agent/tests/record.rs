//! What the record of a run is good for: it is played again, serves as a body, and lets a run that was killed go on.

mod beside;
mod binary;

use std::path::Path;

use beside::shared;
use binary::{check, check_refused, kill_after};
use serde_json::Value;
use tempfile::TempDir;

/// Everything in a record but the bytes of blobs.
fn documents(folder: &Path, run: &str) -> Vec<String> {
    let found = check(folder, &["memory", "query", run, "--json"], 0);
    let mut all: Vec<String> =
        found["records"].as_array().expect("a list").iter().map(Value::to_string).collect();
    all.sort();
    all
}

fn report(folder: &Path, run: &str) -> Value {
    let text = std::fs::read_to_string(folder.join(run).join("report.json")).expect("the run has ended");
    let mut report: Value = serde_json::from_str(&text).expect("a report");
    report["wall_s"] = Value::Null;
    report["run"] = Value::Null;
    report
}

/// Pursues a goal three times: undisturbed, and killed (once, and once more while it goes on). All must come to the same, to the last
/// document, and be played again as they were.
fn check_goal(goal: &[&str], kills: &[&[usize]]) {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    check(folder, &[goal, &["--run", "whole", "--json"]].concat(), 0);
    let again = check(folder, &["replay", "whole", "--json"], 0);
    assert_eq!((&again["same"], &again["verdict"]), (&true.into(), &"achieved".into()), "{again}");
    assert!(
        again["compared"].as_array().is_some_and(|c| c.iter().all(|kind| kind[1].as_u64() > Some(0))),
        "{again}"
    );
    let all = documents(folder, "whole");
    for (n, lines) in kills.iter().enumerate() {
        let run = format!("killed-{n}");
        kill_after(folder, &[goal, &["--run", &run]].concat(), lines[0]);
        let cut = check(folder, &["replay", &run, "--json"], 0);
        assert!(cut["cut_off"].is_string() && cut["same"] == true, "{cut}");
        for lines in &lines[1..] {
            kill_after(folder, &["do", "--resume", &run], *lines);
        }
        check(folder, &["do", "--resume", &run, "--json"], 0);
        assert_eq!(documents(folder, &run), all, "killed after {lines:?} lines");
        assert_eq!(report(folder, &run), report(folder, "whole"));
        let report = check(folder, &["memory", "verify", &run, "--json"], 0);
        assert_eq!(report["whole"], true);
    }
}

#[test]
fn a_simulated_run_is_played_again_and_goes_on_after_kills() {
    check_goal(&["find", "cup A"], &[&[2], &[14, 9]]);
}

#[test]
fn a_run_on_real_views_is_played_again_and_goes_on_after_kills() {
    let Some(kitchen) = shared("data/kitchen") else { return };
    let robot = format!("recorded:{}", kitchen.display());
    check_goal(&["find", "mug", "--robot", &robot], &[&[1], &[12, 20]]);
}

/// A run whose body is the record of another finds what that one found, where that one found it.
fn check_as_body(thing: &str, first: &[&str]) {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let found = check(folder, &[&["find", thing, "--run", "first", "--json"], first].concat(), 0);
    let again = check(folder, &["find", thing, "--robot", "recorded:first", "--run", "second", "--json"], 0);
    let place = |report: &Value| -> [f64; 3] {
        serde_json::from_value(report["position_m"].clone()).expect("a position is three numbers")
    };
    let [a, b] = [place(&found), place(&again)];
    let apart_m = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    assert!(apart_m < 0.02, "{apart_m} m apart: {found} {again}");
    assert!(again["views"].as_u64() <= found["views"].as_u64(), "it has no more to look at");
    let third = check(folder, &["find", thing, "--robot", "recorded:second", "--json"], 0);
    assert_eq!(third["verdict"], "achieved", "a record of a record serves as well");
}

#[test]
fn a_record_of_the_simulation_is_a_body() {
    check_as_body("cup A", &[]);
}

#[test]
fn a_record_of_real_views_is_a_body() {
    let Some(kitchen) = shared("data/kitchen") else { return };
    check_as_body("mug", &["--robot", &format!("recorded:{}", kitchen.display())]);
}

#[test]
fn what_cannot_be_played_or_go_on_is_said() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    check_refused(folder, &["replay", "nothing"], 2, &["run.json", "descry runs"]);
    check_refused(folder, &["do", "--resume", "nothing"], 2, &["run.json"]);
    check_refused(folder, &["find", "cup A", "--max-bytes", "much"], 2, &["no size", "500MB"]);
    check_refused(folder, &["replay", "nothing", "--speed", "0"], 2, &["no speed"]);
    if cfg!(not(feature = "mongodb")) {
        let words = ["built without MongoDB", "cargo build --release --features mongodb"];
        check_refused(folder, &["find", "cup A", "--memory", "mongodb://host/runs"], 2, &words);
        check_refused(folder, &["memory", "show", "mongodb://host/runs"], 2, &words);
    }
    std::fs::create_dir_all(folder.join("empty/segments")).expect("a folder can be made");
    check_refused(
        folder,
        &["find", "mug", "--robot", "recorded:empty"],
        2,
        &["no cloud", "folder of depth frames"],
    );
    kill_after(folder, &["find", "cup A", "--run", "cut"], 2);
    check_refused(folder, &["find", "mug", "--resume", "cut"], 2, &["find cup A", "leave the goal out"]);
    check_refused(folder, &["do", "--resume", "cut", "--seed", "3"], 2, &["--seed"]);
    std::fs::remove_dir_all(folder.join("cut/record")).expect("the record can be spoilt");
    std::fs::create_dir_all(folder.join("cut/record/segments")).expect("the record can be spoilt");
    check_refused(folder, &["replay", "cut"], 2, &["does not say what the body was"]);
}

/// How many records a query of a run finds; none is exit code 1.
fn check_query(folder: &Path, conditions: &[&str], expected: std::ops::RangeInclusive<usize>) {
    let exit = i32::from(*expected.end() == 0);
    let found = check(folder, &[&["memory", "query", "run", "--json"], conditions].concat(), exit);
    let found = found["records"].as_array().map_or(0, Vec::len);
    assert!(expected.contains(&found), "{conditions:?} finds {found}, expected {expected:?}");
}

fn place(numbers: &Value) -> String {
    numbers.as_array().expect("a place").iter().map(Value::to_string).collect::<Vec<_>>().join(",")
}

#[test]
fn a_record_is_queried_verified_and_exported() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let report = check(folder, &["find", "cup A", "--run", "run", "--json"], 0);
    let views = report["views"].as_u64().expect("a number") as usize;
    let clouds = check(folder, &["memory", "query", "run", "--kind", "cloud", "--json"], 0);
    let eye = place(&clouds["records"][0]["seen_from_m"]);
    let cup = place(&report["position_m"]);
    check_query(folder, &["--kind", "cloud"], views..=views);
    check_query(folder, &["--kind", "cloud", "--frame", "camera"], views..=views);
    check_query(folder, &["--kind", "cloud", "--frame", "elsewhere"], 0..=0);
    check_query(folder, &["--kind", "cloud", "--nearest", "1", "--tolerance", "1000"], 1..=1);
    check_query(folder, &["--kind", "cloud", "--nearest", "1000000"], 0..=0);
    check_query(folder, &["--kind", "cloud", "--to", "1000000", "--newest", "--limit", "1"], 1..=1);
    check_query(folder, &["--from", "1000000"], 0..=0);
    check_query(folder, &["--object", "cup A", "--min-confidence", "0.5"], 1..=views);
    check_query(folder, &["--object", "cup A", "--min-confidence", "1"], 0..=0);
    check_query(folder, &["--seen-from", &eye, "--radius", "0.01"], 1..=views);
    check_query(folder, &["--covers", &cup, "--radius", "0.01", "--kind", "cloud"], 1..=views);
    check_query(folder, &["--covers", "100,100,100"], 0..=0);
    let shown = check(folder, &["memory", "show", "run", "--json"], 0);
    assert_eq!(shown["stats"]["kinds"]["cloud"]["records"], views);
    assert!(shown["stats"]["pinned"].as_u64() > Some(0), "what the belief rests on is pinned: {shown}");
    let exported = check(folder, &["export", "run", "all.mcap", "--json"], 0);
    assert_eq!(exported["records"], shown["stats"]["records"]);
    check_refused(folder, &["export", "run", "all.mcap"], 2, &["all.mcap is there already"]);
    check(folder, &["memory", "verify", "run", "--json"], 0);
    let segment = folder.join("run/record/segments/00000001.mcap");
    let mut bytes = std::fs::read(&segment).expect("the record has a segment");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&segment, bytes).expect("the segment can be spoilt");
    let spoilt = check(folder, &["memory", "verify", "run", "--json"], 1);
    assert!(spoilt["report"]["faults"].as_array().is_some_and(|f| !f.is_empty()), "{spoilt}");
    assert_eq!(spoilt["whole"], false);
    check_refused(folder, &["memory", "show", "nothing"], 2, &["holds no record"]);
}

/// A bound that cannot hold what is sensed, or what the belief rests on, ends a run with words that say how much would do.
#[test]
fn a_bound_that_is_too_small_is_said() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let cases: [(&str, &[&str]); 2] = [
        ("1MB", &["bounded to 1.0 MB", "more do not fit", "--max-bytes"]),
        ("8MB", &["bounded to 8.0 MB", "records by `views`", "--max-bytes"]),
    ];
    for (bound, words) in cases {
        check_refused(folder, &["find", "cup A", "--run", bound, "--max-bytes", bound], 5, words);
        check(folder, &["memory", "verify", bound, "--json"], 0);
    }
}

/// Old records go while a run is recorded; what its belief and plan rest on stays.
#[test]
fn a_bounded_record_keeps_what_the_belief_rests_on() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let bounds = ["--max-age", "5", "--max-bytes", "60MB", "--durability", "process"];
    check(folder, &[&["find", "cup A", "--run", "run", "--json"], bounds.as_slice()].concat(), 0);
    let shown = check(folder, &["memory", "show", "run", "--json"], 0);
    let beliefs = check(
        folder,
        &["memory", "query", "run", "--kind", "belief", "--newest", "--limit", "1", "--json"],
        0,
    );
    let cites =
        beliefs["records"][0]["body"]["tracks"][0]["cites"].as_array().expect("a belief cites").clone();
    let clouds = check(folder, &["memory", "query", "run", "--kind", "cloud", "--json"], 0);
    let there: Vec<&Value> = clouds["records"].as_array().expect("a list").iter().map(|d| &d["id"]).collect();
    assert!(cites.iter().all(|id| there.contains(&id)), "{cites:?} of {there:?}, {shown}");
    let events = check(folder, &["memory", "query", "run", "--kind", "event", "--json"], 0);
    let first = &events["records"][0]["body"]["event"];
    assert_ne!(first, "goal", "what nothing rests on has gone: {shown}");
    check(folder, &["memory", "verify", "run", "--json"], 0);
}
