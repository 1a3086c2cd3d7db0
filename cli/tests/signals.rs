//! Signals: the body is stopped first and receives no further request, the record stays intact, and the run
//! resumes where it was.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::binary::{check, outcome, start};
use crate::body::{body_in, check_nothing_twice, has_python, heard};
use tempfile::TempDir;

fn signal(name: &str, process: u32) {
    let sent = Command::new("sh").args(["-c", &format!("kill -{name} {process}")]).status();
    assert!(sent.is_ok_and(|status| status.success()), "{name} could not be sent");
}

/// Waits until the body has received a request a number of times.
fn wait_for(folder: &Path, word: &str, times: usize) {
    let began = Instant::now();
    while heard(folder).iter().filter(|line| *line == word).count() < times {
        assert!(
            began.elapsed() < Duration::from_secs(60),
            "{word} was not heard {times} times: {:?}",
            heard(folder)
        );
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Sends a signal once the body has received a request a number of times. Expects an exit code, `stop` as the
/// last request, an intact record, and that the run resumes to its end without repeating completed actions.
fn check_stopped(name: &str, exit: i32, word: &str, times: usize) {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let robot = body_in(folder);
    let goal = ["find", "cup A", "--robot", robot, "--run", "run"];
    let child = start(folder, &goal);
    wait_for(folder, word, times);
    signal(name, child.id());
    let ended = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stderr);
    let context = format!("{name} at {word} {times}: {:?}\n{said}", heard(folder));
    assert_eq!(ended.status.code(), Some(exit), "{context}");
    assert!(said.contains("do --resume run"), "{context}");
    wait_for(folder, "stop", 1);
    assert_eq!(heard(folder).last().map(String::as_str), Some("stop"), "{context}");
    assert_eq!(check(folder, &["memory", "verify", "run", "--json"], 0)["whole"], true, "{context}");
    let refused = outcome(folder, &["do", "--resume", "run"]);
    assert_eq!(refused.status.code(), Some(2), "a record runs no program unless it is allowed");
    let report = check(folder, &["do", "--resume", "run", "--allow-programs", "--json"], 1);
    assert_ne!(report["verdict"], "failed", "{context}\n{report}");
    check_nothing_twice(folder);
    let again = check(folder, &["replay", "run", "--json"], 0);
    assert_eq!(again["same"], true, "{context}\n{again}");
}

#[test]
fn a_signal_stops_the_body_first_and_the_run_goes_on() {
    if !has_python() {
        eprintln!("SKIPPED: there is no python3");
        return;
    }
    for (name, exit, word, times) in [
        ("INT", 130, "drive_to", 1),
        ("TERM", 143, "drive_to", 2),
        ("HUP", 129, "sense", 1),
        ("TERM", 143, "look_at", 2),
    ] {
        check_stopped(name, exit, word, times);
    }
}

/// So many towns that nobody has seen every way round them before a test is over.
fn towns(count: usize) -> [String; 2] {
    let domain = "(define (domain round) (:requirements :strips :action-costs) (:predicates (at ?t) (seen ?t) (town ?t))
      (:functions (far ?a ?b) (total-cost))
      (:action go :parameters (?a ?b) :precondition (and (at ?a) (town ?b))
        :effect (and (not (at ?a)) (at ?b) (seen ?b) (increase (total-cost) (far ?a ?b)))))";
    let names: Vec<String> = (0..count).map(|town| format!("t{town}")).collect();
    let all = |word: &str| names.iter().map(|name| format!(" ({word} {name})")).collect::<String>();
    let far = |a: usize, b: usize| format!(" (= (far t{a} t{b}) {})", 1 + (a * 37 + b * 61) % 50);
    let far: String = (0..count * count).map(|pair| far(pair / count, pair % count)).collect();
    let problem = format!(
        "(define (problem p) (:domain round) (:objects {}) (:init (at t0){}{far} (= (total-cost) 0))
           (:goal (and{})) (:metric minimize (total-cost)))",
        names.join(" "),
        all("town"),
        all("seen")
    );
    [domain.to_string(), problem]
}

#[test]
fn the_best_plan_so_far_is_printed_when_planning_is_stopped() {
    let folder = TempDir::new().expect("a folder can be made");
    let [domain, problem] = towns(30);
    std::fs::write(folder.path().join("d.pddl"), domain).expect("the folder is writable");
    std::fs::write(folder.path().join("p.pddl"), problem).expect("the folder is writable");
    let mut child = Command::new(env!("CARGO_BIN_EXE_descry"))
        .args(["plan", "d.pddl", "p.pddl", "--anytime"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let first = crate::binary::first_line(&mut child);
    assert!(first.contains("steps"), "{first}");
    signal("INT", child.id());
    let ended = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stdout);
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.matches("(go t").count() >= 29, "{said}");
}

const BATCH: &str = r#"
name = "batch"
kind = "tasks"
about = "A few runs"
domain = "tabletop"
scene = "default"
runs = 3
first_seed = 1
policies = ["plan"]

[[goal]]
say = "find cup A"
targets = ["cup A"]
truly = "found"
"#;

#[test]
fn a_batch_that_is_stopped_goes_on_with_the_same_command() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    std::fs::write(folder.join("batch.toml"), BATCH).expect("the folder is writable");
    let batch = ["experiment", "batch.toml", "--out", "out", "--jobs", "2"];
    let mut child = start(folder, &batch);
    let lines = || std::fs::read_to_string(folder.join("out/jobs.jsonl")).unwrap_or_default();
    let began = Instant::now();
    while lines().lines().count() < 2 {
        assert!(began.elapsed() < Duration::from_secs(120), "no job ended");
        std::thread::sleep(Duration::from_millis(5));
    }
    signal("INT", child.id());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    let done = lines();
    assert!(
        !done.contains("\"error\"") && done.lines().count() < 4,
        "what was under way is not done: {done}"
    );
    assert_eq!(outcome(folder, &batch).status.code(), Some(0));
    assert!(lines().starts_with(&done) && lines().lines().count() == 4, "{}", lines());
}
