//! Damaged records: a flipped bit, a truncated or missing file. Every command shows the same as for the
//! undamaged record, or reports a loss and shows nothing that was not in it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::binary::{check, kill_after, outcome};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use tempfile::TempDir;

/// Commands run on every record.
const COMMANDS: [&[&str]; 9] = [
    &["show", "run", "--json"],
    &["runs", ".", "--json"],
    &["memory", "show", "run", "--json"],
    &["memory", "verify", "run", "--json"],
    &["memory", "query", "run", "--json"],
    &["memory", "query", "run", "--kind", "cloud", "--newest", "--limit", "2", "--json"],
    &["export", "run", "all.mcap", "--kind", "event", "--json"],
    &["find", "cup A", "--robot", "recorded:run", "--run", "again", "--json"],
    &["replay", "run", "--json"],
];

/// Outcome of a command: exit code, JSON without parts that differ between runs, and messages.
struct Outcome {
    exit: Option<i32>,
    shown: Value,
    said: String,
}

fn ask(folder: &Path, command: &[&str]) -> Outcome {
    let output = outcome(folder, command);
    let mut shown = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    forget(
        &mut shown,
        &["wall_s", "planning_s", "geometry_s", "bytes", "true_position_m", "true_on", "true_in", "run"],
    );
    Outcome { exit: output.status.code(), shown, said: String::from_utf8_lossy(&output.stderr).into_owned() }
}

fn forget(value: &mut Value, keys: &[&str]) {
    match value {
        Value::Object(fields) => {
            fields.retain(|key, _| !keys.contains(&key.as_str()));
            fields.values_mut().for_each(|v| forget(v, keys));
        }
        Value::Array(all) => all.iter_mut().for_each(|v| forget(v, keys)),
        _ => (),
    }
}

/// Files of a run, by their path in its folder.
fn files(run: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for sub in ["", "record", "record/segments"] {
        let entries = std::fs::read_dir(run.join(sub)).expect("a folder").flatten();
        found.extend(entries.filter(|e| e.path().is_file()).map(|e| Path::new(sub).join(e.file_name())));
    }
    found.sort();
    found
}

/// Damages a file of a run and describes the damage: a segment half of the time, else any other file.
fn spoil(run: &Path, random: &mut ChaCha8Rng) -> String {
    let is_segment = random.random_bool(0.5);
    let of_kind = |path: &PathBuf| path.extension().is_some_and(|e| e == "mcap") == is_segment;
    let all: Vec<PathBuf> = files(run).into_iter().filter(of_kind).collect();
    let name = &all[random.random_range(0..all.len())];
    let path = run.join(name);
    let mut bytes = std::fs::read(&path).expect("it can be read");
    // The file is a link to that of the whole record.
    std::fs::remove_file(&path).expect("it can be removed");
    let at = random.random_range(0..bytes.len().max(1));
    let how = match random.random_range(0..if bytes.is_empty() { 1 } else { 5 }) {
        0 => return format!("{} is missing", name.display()),
        1 => {
            bytes.truncate(at);
            "is cut at"
        }
        _ => {
            bytes[at] ^= 1 << random.random_range(0..8);
            "has a flipped bit at"
        }
    };
    std::fs::write(&path, bytes).expect("it can be written");
    format!("{} {how} {at}", name.display())
}

/// Copies a run by links to its files.
fn linked(from: &Path, to: &Path) {
    std::fs::create_dir_all(to.join("record/segments")).expect("folders can be made");
    for name in files(from) {
        let made = match name.extension().is_some_and(|e| e == "mcap") {
            true => std::fs::hard_link(from.join(&name), to.join(&name)),
            false => std::fs::copy(from.join(&name), to.join(&name)).map(drop),
        };
        made.expect("it can be linked");
    }
}

/// Checks that what is shown of a damaged record is a subset of what is shown of the intact one.
fn check_shown(whole: &Value, shown: &Value, about: &str) {
    for list in ["records", "events"] {
        let all = whole[list].as_array().map_or(&[][..], Vec::as_slice);
        for one in shown[list].as_array().map_or(&[][..], Vec::as_slice) {
            // The newest that are left may be others than the newest of all.
            assert!(
                all.contains(one) || about.contains("--newest"),
                "{about}: {one} is none of the whole record"
            );
        }
    }
    let report =
        |shown: &Value| if shown["events"].is_array() { shown["report"].clone() } else { Value::Null };
    assert!([Value::Null, report(whole)].contains(&report(shown)), "{about}: {}", shown["report"]);
    let count = |shown: &Value| shown["stats"]["records"].as_u64().unwrap_or(0);
    assert!(count(shown) <= count(whole), "{about}: {}", shown["stats"]);
    assert_ne!(shown["same"], Value::Bool(true), "{about}");
}

/// Damages copies of a run, one for each seed, and runs every command; returns how often each reported a
/// loss.
fn check_damage(source: &Path, seeds: std::ops::Range<u64>) -> BTreeMap<String, usize> {
    let run = |folder: &Path| linked(source, &folder.join("run"));
    let whole = TempDir::new().expect("a folder can be made");
    run(whole.path());
    let expected: Vec<Outcome> = COMMANDS.iter().map(|command| ask(whole.path(), command)).collect();
    let mut said_lost = BTreeMap::new();
    for seed in seeds {
        let folder = TempDir::new().expect("a folder can be made");
        run(folder.path());
        let how = spoil(&folder.path().join("run"), &mut ChaCha8Rng::seed_from_u64(seed));
        let mut told = Vec::new();
        for (command, expected) in COMMANDS.iter().zip(&expected) {
            let got = ask(folder.path(), command);
            let about = format!("{how}: descry {}", command.join(" "));
            assert_ne!(got.exit, Some(70), "{about}: {}", got.said);
            if got.exit == expected.exit && got.shown == expected.shown {
                continue;
            }
            told.push(command[..command.len().min(2)].join(" "));
            let is_said =
                ["lost", "damaged", "missing", "holds no record", "No such file", "is not that of its chunk"];
            let all = format!("{}{}", got.said, got.shown);
            assert!(is_said.iter().any(|word| all.contains(word)), "{about}: {all}");
            // What is listed is no less; what is looked for again may be found in the views that are left.
            let may_do = ["runs", "find"].contains(&command[0]);
            assert!(got.exit != Some(0) || may_do, "{about}: {all}");
            check_shown(&expected.shown, &got.shown, &about);
        }
        println!("{seed}: {how}: told by {told:?}");
        for one in if told.is_empty() { vec!["nobody".to_owned()] } else { told } {
            *said_lost.entry(one).or_default() += 1;
        }
    }
    said_lost
}

/// A finished run, in segments of some megabytes.
fn ended(folder: &Path) -> PathBuf {
    check(folder, &["find", "cup A", "--run", "ended", "--max-bytes", "160MB", "--json"], 0);
    folder.join("ended")
}

#[test]
fn a_damaged_record_is_used_as_far_as_it_is_whole() {
    let folder = TempDir::new().expect("a folder can be made");
    check_damage(&ended(folder.path()), 0..2);
}

/// Undamaged files from another run beside a record are recognised as foreign; the record is complete without
/// them.
#[test]
fn files_of_another_run_are_told_from_its_own() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let scene = ["--scene", "no-cup-a", "--json"];
    check(folder, &[&["find", "mug", "--seed", "4", "--run", "run"], &scene[..]].concat(), 0);
    check(folder, &[&["find", "mug", "--seed", "3", "--run", "same"], &scene[..]].concat(), 0);
    check(folder, &["find", "cup B", "--seed", "3", "--run", "other", "--json"], 0);
    let commands = [["show", "run", "--json"], ["explain", "run", "--json"], ["runs", ".", "--json"]];
    let whole = commands.map(|command| ask(folder, &command));
    for (command, whole) in commands.iter().zip(&whole) {
        assert_eq!(whole.said, "", "descry {}", command.join(" "));
    }
    for name in ["report.json", "run.json"] {
        let path = folder.join("run").join(name);
        let own = std::fs::read(&path).expect("it can be read");
        for (other, said) in [
            (Some("same"), "is that of another run"),
            (Some("other"), "is that of another run"),
            (None, "No such file"),
        ] {
            match other {
                Some(other) => std::fs::copy(folder.join(other).join(name), &path).map(drop),
                None => std::fs::remove_file(&path),
            }
            .expect("it can be put there");
            for (command, whole) in commands.iter().zip(&whole) {
                let got = ask(folder, command);
                let about = format!("{name} of {other:?}: descry {}: {}", command.join(" "), got.said);
                let [mut shown, mut expected] = [got.shown, whole.shown.clone()];
                // What only the file says is told to be lost.
                for told in [&mut shown, &mut expected] {
                    forget(told, &["lost"]);
                }
                assert_eq!(shown, expected, "{about}");
                assert!(got.said.contains(said), "{about}");
            }
        }
        std::fs::write(&path, own).expect("it can be written");
    }
}

#[test]
#[ignore = "slow: spoils 100 records and asks nine commands of each: some minutes"]
fn a_hundred_damaged_records_are_used_as_far_as_they_are_whole() {
    let folder = TempDir::new().expect("a folder can be made");
    println!("of 60 runs that had ended: {:?}", check_damage(&ended(folder.path()), 0..60));
    kill_after(folder.path(), &["find", "cup A", "--run", "killed", "--max-bytes", "160MB"], 12);
    println!("of 40 that were killed: {:?}", check_damage(&folder.path().join("killed"), 60..100));
}
