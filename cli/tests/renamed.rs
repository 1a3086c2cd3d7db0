//! Actions are known by what they do: a domain that calls them otherwise is lived with alike, whoever chooses where to look.

use std::fs;
use std::path::Path;

use descry_domains::template;
use serde_json::Value;
use tempfile::TempDir;

use crate::binary;

/// The template with other names for its actions.
fn written(folder: &Path, names: [&str; 2]) {
    for (path, text) in template::files("own") {
        let to = folder.join("own").join(&path);
        fs::create_dir_all(to.parent().expect("a folder")).expect("a folder can be made");
        let mut text = text;
        for (own, other) in ["move", "observe"].into_iter().zip(names) {
            let places =
                [format!("(:durative-action {own}"), format!("[action.{own}]"), format!("\n{own} = \"")];
            for place in places {
                text = text.replace(&place, &place.replace(own, other));
            }
        }
        fs::write(to, text).expect("the domain is written");
    }
}

/// The outcome of a run, without wall-clock times.
fn outcome(folder: &Path, policy: &str, seed: &str) -> Value {
    let ask =
        ["find", "mug", "--domain", "own", "--seed", seed, "--policy", policy, "--run", policy, "--json"];
    let output = binary::outcome(folder, &ask);
    let mut report: Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{policy}: {e}"));
    for timed in ["planning_s", "geometry_s", "wall_s", "run"] {
        report[timed] = Value::Null;
    }
    report
}

fn check(seeds: std::ops::Range<u32>) {
    let (usual, other) = (TempDir::new().expect("a folder"), TempDir::new().expect("a folder"));
    written(usual.path(), ["move", "observe"]);
    written(other.path(), ["goto", "look"]);
    for seed in seeds {
        let seed = seed.to_string();
        for policy in ["plan", "nearest", "sweep", "gain-per-second"] {
            let [expected, found] = [&usual, &other].map(|folder| outcome(folder.path(), policy, &seed));
            assert_eq!(found, expected, "{policy}, seed {seed}");
            let done = binary::documents(other.path(), policy);
            let old = |document: &&String| document.contains("(move ") || document.contains("(observe ");
            assert_eq!(done.iter().find(old), None, "{policy}, seed {seed}");
            for folder in [&usual, &other] {
                fs::remove_dir_all(folder.path().join(policy)).expect("the record goes");
            }
        }
    }
}

#[test]
fn a_domain_with_other_names_for_its_actions_is_lived_with_alike() {
    check(1..2);
}

#[test]
#[ignore = "slow: 50 seeds, four ways to choose"]
fn fifty_runs_are_alike_whatever_actions_are_called() {
    check(1..51);
}
