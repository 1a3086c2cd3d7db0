//! Objects on the floor: learned, named, found, and reported as unknown if never learned.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

fn run(goal: &str, scene: &str, seed: u64, folder: &Path, remember: Option<&Path>) -> Value {
    let mut command = Command::cargo_bin("descry").unwrap();
    let run = folder.join(format!("{scene}-{seed}-{}", goal.replace(' ', "-")));
    command.args(["do", goal, "--domain", "shapes", "--scene", scene, "--json", "--seed"]);
    command.arg(seed.to_string()).arg("--run").arg(&run);
    if let Some(store) = remember {
        command.arg("--remember").arg(store);
    }
    let output = command.output().unwrap();
    // Nothing of what the verdict rests on is missed.
    Command::cargo_bin("descry").unwrap().arg("show").arg(&run).assert().success();
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{goal}: {e}\n{}", String::from_utf8_lossy(&output.stderr)))
}

/// Checks the result for a scene: the verdict, the name if one is given, and the position to ten centimetres.
fn check(
    goal: &str,
    scene: &str,
    seed: u64,
    folder: &Path,
    store: Option<&Path>,
    said: (&str, Option<&str>),
) {
    let report = run(goal, scene, seed, folder, store);
    let found = (report["verdict"].as_str().unwrap(), report["object"].as_str());
    assert_eq!(found, said, "{goal} in {scene}, seed {seed}: {}", report["why"]);
    let at = |key: &str, axis: usize| report[key][axis].as_f64();
    if said.1.is_some() && at("true_position_m", 0).is_some() {
        for axis in 0..2 {
            let off_m = (at("position_m", axis).unwrap() - at("true_position_m", axis).unwrap()).abs();
            assert!(off_m < 0.15, "{goal} in {scene}, seed {seed}: {off_m} m off");
        }
    }
}

#[test]
fn what_is_known_is_named_and_what_is_not_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let which = "which object is this";
    check(which, "garbage-can", 1, folder, None, ("achieved", Some("garbage can")));
    check(which, "dell-box", 2, folder, None, ("achieved", Some("dell box")));
    check(which, "stranger", 300, folder, None, ("not_found", None));
    check(which, "stool", 300, folder, None, ("not_found", None));
}

#[test]
fn what_is_there_is_found_and_what_is_not_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // The body comes to stand in touch of a thing that it has not seen from that side.
    check("where is the garbage can", "default", 308, folder, None, ("achieved", Some("garbage can")));
    check("where is the dell box", "recycle-bin", 501, folder, None, ("not_found", None));
    check("where is the recycle bin", "garbage-can", 502, folder, None, ("not_found", None));
    check("where is the coffee table", "garbage-can", 503, folder, None, ("cannot_tell", None));
}

#[test]
fn nobody_drives_for_a_shape_that_nobody_has_learned() {
    let folder = tempfile::tempdir().unwrap();
    let report = run("find chair", "default", 1, folder.path(), None);
    let moved = (report["verdict"].as_str(), report["distance_m"].as_f64(), report["views"].as_u64());
    assert_eq!(moved, (Some("cannot_tell"), Some(0.0), Some(0)), "{report}");
    let why = report["why"].as_str().unwrap();
    assert!(why.starts_with("nobody has learned what the chair looks like"), "{why}");
}

#[test]
fn what_was_learned_is_known_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, store) = (folder.path(), folder.path().join("store"));
    check("where is the stool", "stool", 301, folder, Some(&store), ("cannot_tell", None));
    let report = run("learn stool", "stool", 302, folder, Some(&store));
    assert_eq!(report["verdict"], "achieved", "{}", report["why"]);
    check(
        "where is the stool with confidence 0.8",
        "stool",
        303,
        folder,
        Some(&store),
        ("achieved", Some("stool")),
    );
}

/// Names of the learned shapes in a store.
fn learned(folder: &Path, store: &Path) -> Vec<String> {
    let asked = ["memory", "query", &store.display().to_string(), "--newest", "--limit", "1", "--json"];
    let found: Value = crate::binary::check(folder, &asked, 0);
    let shapes = found["records"][0]["body"]["shapes"].as_array().cloned().unwrap_or_default();
    shapes.iter().filter_map(|shape| shape["name"].as_str().map(str::to_owned)).collect()
}

#[test]
fn what_others_have_learned_since_stays_where_a_run_is_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let store = folder.join("seen");
    let learn = |name: &str, seed: u64| {
        let said = ("achieved", Some(name));
        check(&format!("learn {name}"), "stool", seed, folder, Some(&store), said);
    };
    learn("armchair", 5);
    learn("coffee table", 6);
    let first = folder.join("stool-5-learn-armchair");
    let resume = ["do", "--resume", &first.display().to_string(), "--json"];
    let _: Value = crate::binary::check(folder, &resume, 0);
    assert_eq!(learned(folder, &store), ["armchair", "coffee table"], "of a run that had ended");
    // As if it had been cut off before it had kept what it saw.
    std::fs::remove_file(first.join("report.json")).unwrap();
    let _: Value = crate::binary::check(folder, &resume, 0);
    assert_eq!(learned(folder, &store), ["armchair", "coffee table"], "of a run that was cut off");
    // As if it had been cut off before anything was recorded.
    std::fs::create_dir(folder.join("cut")).unwrap();
    std::fs::copy(first.join("run.json"), folder.join("cut/run.json")).unwrap();
    let _: Value = crate::binary::check(folder, &["do", "--resume", "cut", "--json"], 0);
    let begun: Value =
        crate::binary::check(folder, &["memory", "query", "cut", "--kind", "run", "--json"], 0);
    assert!(begun["records"][0]["body"]["past"].is_object(), "it begins with what is remembered");
}

#[test]
fn a_run_begins_only_where_what_it_sees_can_be_kept() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("file"), "").unwrap();
    std::fs::create_dir_all(folder.join("run/record")).unwrap();
    for (store, why) in [
        ("file", "it is a file"),
        ("file/seen", "Not a directory"),
        ("run", "it is the folder of a run"),
        ("new", "it is the folder of this run"),
    ] {
        let asked = ["find", "cup A", "--remember", store, "--run", "new"];
        crate::binary::check_refused(folder, &asked, 2, &[store, why, "--remember", "expected a folder"]);
        assert!(!folder.join("new/run.json").exists(), "{store}: nothing was begun");
    }
}
