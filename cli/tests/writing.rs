//! Authoring aids: formatting, why-not questions, completions, man pages.

use crate::binary;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

const DOMAIN: &str = "(define (domain toy) (:requirements :strips :typing) (:types place)
(:predicates (at ?p - place) (road ?a ?b - place) (bridge ?a ?b - place)) ; words
(:action move :parameters (?a ?b - place) :precondition (and (at ?a) (road ?a ?b)) :effect (and (not (at ?a)) (at ?b)))
(:action swim :parameters (?a ?b - place) :precondition (and (at ?a) (bridge ?a ?b)) :effect (and (not (at ?a)) (at ?b)))
(:action burn :parameters (?a - place) :precondition (at ?a) :effect (not (at ?a))))";
const PROBLEM: &str = "(define (problem p) (:domain toy) (:objects a b c d - place)
  (:init (at a) (road a b) (road b c) (road a d) (road d b)) (:goal (at c)))";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("domain.pddl"), DOMAIN).expect("written");
    std::fs::write(folder.path().join("problem.pddl"), PROBLEM).expect("written");
    folder
}

/// Checks the answer to a why-not question.
fn check_why_not(action: &str, said: &[&str], in_plan: bool) {
    let folder = folder();
    let asked = ["plan", "domain.pddl", "problem.pddl", "--why-not", action];
    let outcome = binary::outcome(folder.path(), &asked);
    let text = String::from_utf8_lossy(&outcome.stderr).into_owned();
    assert!(outcome.status.success(), "{text}");
    for word in said {
        assert!(text.contains(word), "{action}: {word:?} is not in {text}");
    }
    let json: Value = binary::check(folder.path(), &[&asked[..], &["--json"]].concat(), 0);
    assert_eq!(json["why_not"]["in_plan"], in_plan, "{json}");
}

#[test]
fn why_an_action_is_not_in_the_plan() {
    check_why_not(
        "(move d b)",
        &[
            "cannot be taken at once: it needs (at d)",
            "(move a d), then (move d b)",
            "3 steps, cost 3, and one without it that is 2 steps",
        ],
        false,
    );
    check_why_not("(swim a b)", &["it needs (bridge a b)", "can never be taken"], false);
    check_why_not("(burn a)", &["could be taken at once", "No plan that has it reaches the goal"], false);
    check_why_not("(move b c)", &["The plan that was found has it"], true);
    let folder = folder();
    for (asked, because) in [
        ("(fly a)", "no action is called `fly`"),
        ("(move a)", "takes 2 arguments"),
        ("move a b", "--why-not"),
        ("", "one action was expected"),
    ] {
        binary::check_refused(
            folder.path(),
            &["plan", "domain.pddl", "problem.pddl", "--why-not", asked],
            2,
            &[because],
        );
    }
}

fn code(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let outcome = binary::outcome(folder, arguments);
    (outcome.status.code(), String::from_utf8_lossy(&outcome.stdout).into_owned())
}

#[test]
fn files_are_laid_out_once() {
    let folder = folder();
    let path = folder.path();
    std::fs::write(path.join("a.plan"), "0:(move  a b)[1] ; go\n").expect("written");
    assert_eq!(code(path, &["fmt", "--check", "."]).0, Some(1));
    assert_eq!(std::fs::read_to_string(path.join("domain.pddl")).expect("text"), DOMAIN);
    let (exit, named) = code(path, &["fmt", "."]);
    assert_eq!((exit, named.lines().count()), (Some(0), 3), "{named}");
    assert_eq!(code(path, &["fmt", "--check", "."]), (Some(0), String::new()));
    assert_eq!(
        std::fs::read_to_string(path.join("a.plan")).expect("text"),
        "0.000: (move a b) [1.000]  ; go\n"
    );
    let laid_out = std::fs::read_to_string(path.join("domain.pddl")).expect("text");
    assert!(
        laid_out.contains("; words")
            && laid_out.contains("\n  (:action move\n    :parameters (?a ?b - place)\n"),
        "{laid_out}"
    );
    binary::check(path, &["plan", "domain.pddl", "problem.pddl", "--json"], 0);
    std::fs::write(path.join("torn.pddl"), "(define (domain d)\n  (:types a b)").expect("written");
    binary::check_refused(path, &["fmt", "torn.pddl"], 2, &["torn.pddl"]);
    assert_eq!(
        std::fs::read_to_string(path.join("torn.pddl")).expect("text"),
        "(define (domain d)\n  (:types a b)"
    );
    binary::check_refused(path, &["fmt", "missing.pddl"], 2, &["missing.pddl"]);
    assert_eq!(std::fs::read_dir(path).expect("a folder").count(), 4, "nothing is left behind");
}

#[test]
fn standard_input_is_laid_out() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_descry"));
    let mut child =
        command.arg("fmt").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it starts");
    child.stdin.take().expect("it hears").write_all(b"(define (problem p)(:goal ( a )))").expect("it hears");
    let said = child.wait_with_output().expect("it ends");
    assert_eq!(String::from_utf8_lossy(&said.stdout), "(define (problem p)\n  (:goal (a)))\n");
}

#[test]
fn shells_and_man_know_every_command() {
    let folder = folder();
    let path = folder.path();
    for shell in ["bash", "zsh", "fish"] {
        let (exit, script) = code(path, &["completions", shell]);
        assert!(exit == Some(0) && script.contains("explain") && script.contains("why-not"), "{shell}");
    }
    let (exit, page) = code(path, &["man"]);
    assert!(exit == Some(0) && page.contains(".TH descry 1") && page.contains("explain"), "{page}");
    assert_eq!(code(path, &["man", "--out", "man"]).0, Some(0));
    let page = std::fs::read_to_string(path.join("man/descry-plan.1")).expect("a page");
    assert!(page.contains(".TH descry\\-plan 1") || page.contains(".TH descry-plan 1"), "{page}");
    assert!(page.contains("why\\-not") && page.contains("Examples"), "{page}");
    assert!(path.join("man/descry-memory-query.1").is_file());
}
