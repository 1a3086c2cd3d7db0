//! Runs recorded in MongoDB: the same guarantees as for records on disk.

mod binary;
#[path = "../../memory/tests/server/process.rs"]
mod process;

use std::path::Path;

use binary::{check, check_refused, kill_after};
use process::{Process, skipped};
use serde_json::Value;
use tempfile::TempDir;

/// Every document of a record, without the name of the recording robot.
fn documents(folder: &Path, place: &str) -> Vec<Value> {
    let mut found = check(folder, &["memory", "query", place, "--json"], 0);
    let records = found["records"].as_array_mut().expect("a list");
    for record in records.iter_mut() {
        record.as_object_mut().and_then(|fields| fields.shift_remove("robot"));
    }
    std::mem::take(records)
}

/// Number of records of each kind.
fn kinds(folder: &Path, place: &str) -> Vec<(String, Value)> {
    let shown = check(folder, &["memory", "show", place, "--json"], 0);
    let kinds = shown["stats"]["kinds"].as_object().expect("kinds").clone();
    kinds.into_iter().map(|(kind, count)| (kind, count["records"].clone())).collect()
}

#[test]
fn a_run_is_recorded_played_again_and_gone_on_with() {
    let server = match Process::start() {
        Ok(server) => server,
        Err(why) => return skipped(&why),
    };
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let store = format!("{}/runs", server.address());
    let find = ["find", "cup A", "--json"];
    let here = check(folder, &[&find[..], &["--run", "here"]].concat(), 0);
    let there = check(folder, &[&find[..], &["--run", "there", "--memory", &store]].concat(), 0);
    for key in ["verdict", "position_m", "confidence", "views", "sim_time_s"] {
        assert_eq!(here[key], there[key], "{key}");
    }
    let all = documents(folder, "here");
    // What a run was started with, and its report, say where it is kept.
    let is_own = |document: &&Value| ["run", "report"].iter().any(|kind| document["kind"] == *kind);
    let of_both = documents(folder, "there");
    for (there, here) in of_both.iter().zip(&all).filter(|(there, _)| !is_own(there)) {
        assert_eq!(there.to_string(), here.to_string());
    }
    assert_eq!(kinds(folder, "there"), kinds(folder, "here"));
    assert!(!folder.join("there/record").exists());
    let again = check(folder, &["replay", "there", "--json"], 0);
    assert_eq!((&again["same"], &again["verdict"]), (&true.into(), &"achieved".into()), "{again}");

    kill_after(folder, &["find", "cup A", "--run", "cut", "--memory", &store], 12);
    let resumed = check(folder, &["do", "--resume", "cut", "--json"], 0);
    assert_eq!(resumed["position_m"], here["position_m"]);
    assert_eq!(kinds(folder, "cut"), kinds(folder, "here"));
    let again = check(folder, &["replay", "cut", "--json"], 0);
    assert_eq!((&again["same"], &again["verdict"]), (&true.into(), &"achieved".into()), "{again}");

    let name = format!("{store}#there");
    assert_eq!(check(folder, &["memory", "verify", &store, "--json"], 0)["whole"], true);
    let shown = check(folder, &["memory", "show", &store, "--json"], 0);
    assert_eq!(shown["runs"], serde_json::json!(["cut", "there"]));
    assert_eq!(shown["stats"]["records"], 2 * all.len());
    assert_eq!(check(folder, &["memory", "show", &name, "--json"], 0)["stats"]["records"], all.len());
    let exported = check(folder, &["export", &name, "there.mcap", "--json"], 0);
    assert_eq!(exported["records"], all.len());
    let body = format!("recorded:{name}");
    let second = check(folder, &["find", "cup A", "--robot", &body, "--run", "second", "--json"], 0);
    assert_eq!(second["verdict"], "achieved");
    check_refusals(folder, &store);
}

fn check_refusals(folder: &Path, store: &str) {
    let find = |more: &[&'static str], store: &str| {
        let words = [&["find", "cup A", "--memory", store], more].concat();
        words.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>()
    };
    let named = |name: &str| format!("{store}#{name}");
    let cases = [
        (find(&[], &named("there")), 2, "holds a run of that name already"),
        (find(&["--min-free", "1GB"], store), 2, "bound the record by bytes or by age"),
        (find(&[], "mongodb://127.0.0.1:1/runs"), 5, "no server answers"),
        (find(&[], "mongodb://me:secret@127.0.0.1:1/runs"), 2, "DESCRY_MONGODB_LOGIN"),
        (find(&["--robot", "recorded:mongodb://127.0.0.1:1/runs"], store), 2, "name it behind a #"),
    ];
    for (arguments, exit, word) in cases {
        check_refused(folder, &arguments.iter().map(String::as_str).collect::<Vec<_>>(), exit, &[word]);
    }
    check_refused(folder, &["replay", store], 2, &["name the run's folder"]);
    check_refused(folder, &["show", store], 2, &["name the run's folder"]);
    check_refused(folder, &["runs", store], 2, &["descry memory show"]);
    check_refused(folder, &["memory", "show", &named("nobody")], 2, &["there are: cut, there"]);
}
