//! `descry explain RUN`: why a run went as it did, from its record alone.

mod binary;

use std::path::Path;

use descry_agent::body::{scene_spec, simulate};
use descry_agent::explain;
use descry_agent::run::{self, Folder, Settings, Task, Watcher};
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::Domain;
use descry_robots::sim::FaultPlan;
use serde_json::Value;

/// A run of the binary, explained; the words that the explanation must have.
fn check(arguments: &[&str], exit: i32, words: &[&str]) -> Value {
    let folder = tempfile::tempdir().expect("a folder");
    let run = binary::outcome(folder.path(), &[arguments, &["--run", "run"]].concat());
    assert_eq!(run.status.code(), Some(exit), "{}", String::from_utf8_lossy(&run.stderr));
    explained(folder.path(), words)
}

fn explained(folder: &Path, words: &[&str]) -> Value {
    let said = binary::outcome(folder, &["explain", "run"]);
    let text = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(said.status.success(), "{text}\n{}", String::from_utf8_lossy(&said.stderr));
    // A line holds 80 letters; what stands in one piece may be longer.
    let long = text.lines().find(|l| l.chars().count() > 80 && l.trim().contains(' ') && !l.contains('('));
    assert_eq!(long, None, "{text}");
    let one_line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for word in words {
        assert!(one_line.contains(word), "{word:?} is not in\n{text}");
    }
    binary::check(folder, &["explain", "run", "--json"], 0)
}

#[test]
fn what_was_found_is_explained() {
    let told = check(
        &["find", "cup A", "--seed", "1"],
        0,
        &[
            "the run began, and there was no plan",
            "of 9 ways to get further, (move start table-5) (observe table-5 table) [+",
            "is the quickest, but would not be expected to be enough by itself",
            "plan 1 was carried out to its end, and (confidence cup-a) is 0",
            "achieved: cup A stands on the table",
            "of where cup A may be, this was seen:",
            "of the table from 2 places",
            "other objects are surely not cup A",
            "it ended because the goal held",
        ],
    );
    assert_eq!(told["plans"].as_array().map(Vec::len), Some(2), "{told}");
}

#[test]
fn what_is_not_there_is_explained() {
    check(
        &["find", "cup A", "--seed", "5", "--scene", "no-cup-a"],
        1,
        &[
            "not found: cup A is not there",
            "% of the table from 4 places",
            "the probability that it is there after all",
            "nothing more could be done about it: worth-a-look (whether a look from there may settle anything that is in doubt) is no in all of",
        ],
    );
}

#[test]
fn a_policy_is_not_called_the_planner() {
    check(
        &["find", "cup A", "--seed", "9", "--policy", "nearest"],
        0,
        &["chosen by the policy nearest", "The policy nearest goes by its own rule"],
    );
}

#[test]
fn a_run_that_was_cut_off_and_gone_on_with_is_explained() {
    let folder = tempfile::tempdir().expect("a folder");
    binary::kill_after(folder.path(), &["find", "cup A", "--seed", "1", "--run", "run"], 6);
    explained(folder.path(), &["It has not ended", "there is no verdict: the run was cut off"]);
    let run = binary::outcome(folder.path(), &["do", "--resume", "run"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let words = [
        "achieved: cup A stands on the table",
        "It was cut off once, and gone on with from its record",
        "here the run was cut off",
    ];
    let told = explained(folder.path(), &words);
    assert_eq!(told["plans"].as_array().map(Vec::len), Some(2), "{told}");
    let again = binary::check(folder.path(), &["replay", "run", "--json"], 0);
    assert_eq!(again["same"], true, "{again}");
}

#[test]
fn an_answer_is_explained_as_one() {
    check(
        &["do", "is cup A on the table", "--seed", "4"],
        0,
        &["the answer is yes (achieved): cup A stands on the table", "(presence …) is how sure it is that"],
    );
}

#[test]
fn what_is_nearly_hidden_is_pushed_for_and_what_a_slip_leaves_is_said() {
    check(
        &["find", "cup A", "--seed", "2", "--scene", "ring-of-boxes"],
        0,
        &[
            "(push-aside table-3 object-0) failed: slipped",
            "From then on (at here-9) holds; (at table-3) no longer holds",
        ],
    );
}

#[test]
fn a_recorded_body_is_explained() {
    let folder = tempfile::tempdir().expect("a folder");
    binary::check(folder.path(), &["find", "cup A", "--seed", "1", "--run", "first", "--json"], 0);
    let again = ["find", "cup A", "--robot", "recorded:first", "--run", "run", "--json"];
    binary::check(folder.path(), &again, 0);
    explained(folder.path(), &["asked of the body recorded:first,", "the only way known to get further"]);
}

#[test]
fn what_the_record_does_not_say_is_said_not_to_be_known() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = ["find", "cup A", "--seed", "3", "--run", "run", "--max-bytes", "3MB"];
    binary::outcome(folder.path(), &run);
    let path = folder.path().join("run");
    let header = run::header(&path).expect("a run");
    let record = descry_agent::keeping::open(&path).expect("a record");
    let told = explain::of(&record, &header, None).expect("it can be read").to_string();
    assert!(told.contains("there is no verdict"), "{told}");
}

/// A run in which things go wrong on purpose, explained.
fn faulty(goal: &str, seed: u64, faults: &str) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = Domain::load("home").expect("a built-in domain");
    let faults = FaultPlan::parse("faults.toml", faults).expect("faults");
    let spec = scene_spec(None, &domain).expect("a scene");
    let body = simulate(&spec, seed, faults).expect("a body");
    let lexicon = Lexicon::new(&domain, &Places::of_body(&*body.robot));
    let goal = descry_domains::goal::read(goal, &domain, &lexicon).expect("it is understood");
    let into = Folder::of_new_run(Some(&folder.path().join("run")), &goal).expect("a folder");
    let settings = Settings {
        robot: "sim".into(),
        scene: None,
        seed,
        domain: "home".into(),
        policy: policies::PLAN.into(),
        keeping: descry_agent::keeping::Keeping::default(),
        remember: None,
    };
    let chooser = policies::named(policies::PLAN, seed, None).expect("a policy");
    let watcher = Watcher { stop: &Stop::default(), tell: &mut |_| {} };
    let task = Task { domain: &domain, goal: &goal, past: None };
    let report = run::pursue(task, &body, &into, &settings, chooser, watcher).expect("it ends");
    let header = run::header(into.path()).expect("a run");
    let record = descry_agent::keeping::open(into.path()).expect("a record");
    let told = explain::of(&record, &header, Some(&report)).expect("it is explained").to_string();
    println!("{told}");
    told.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn failures_are_named_as_the_causes_of_new_plans() {
    let told = faulty(
        "pick up cup A",
        2,
        "[[fault]]\nkind = \"door_shut\"\nat = 1\n\n[[fault]]\nkind = \"grasp_slips\"\nat = 1\n",
    );
    for words in [
        "failed: blocked:",
        "What follows from that: (shut",
        "failed: slipped: it slid out of the hand. From then on (at ",
        "(confidence cup-a) is 0.",
        "Hoped of it: (presence cup-a ",
        "and by what was done since that look: (holding cup-a) holds",
        "achieved",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
    assert!(!told.contains("the attachment of"), "{told}");
}
