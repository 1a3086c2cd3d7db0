//! Robots that are programs, on the command line.

use std::process::{Command, Output};

use assert_cmd::cargo::CommandCargoExt;
use tempfile::TempDir;

fn has_python() -> bool {
    let found = Command::new("python3").arg("--version").output().is_ok_and(|o| o.status.success());
    if !found {
        println!("SKIPPED: python3 is not here");
    }
    found
}

/// Runs descry and expects an exit code and words in its output.
fn check(arguments: &[&str], exit: i32, words: &[&str]) {
    let folder = TempDir::new().expect("a folder can be made");
    let mut command = Command::cargo_bin("descry").expect("the binary is built");
    let Output { status, stdout, stderr } =
        command.args(arguments).current_dir(folder.path()).output().expect("the binary runs");
    let said = format!("{}\n{}", String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
    assert_eq!(status.code(), Some(exit), "{arguments:?}\n{said}");
    for word in words {
        assert!(said.contains(word), "{arguments:?} does not say {word:?}\n{said}");
    }
}

#[test]
fn a_robot_is_checked_like_a_test() {
    if !has_python() {
        return;
    }
    let robots = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots");
    let template = format!("program:python3 '{robots}/python/template.py'");
    check(&["robot", "check", &template], 0, &["a frame ... ok", "being stopped ... ok", "checks passed"]);
    let rogue = format!("program:python3 '{robots}/tests/programs/rogue.py' 'dies'");
    check(
        &["robot", "check", &rogue, "--json"],
        1,
        &["routes and a drive ... FAILED", "the motors are gone"],
    );
}

#[test]
fn what_is_no_robot_is_said() {
    check(
        &["robot", "check", "program:echo my cameras are gone >&2; exit 3"],
        5,
        &["without a hello", "my cameras"],
    );
    check(&["find", "cup A", "--robot", "program:exit 1", "--scene", "clutter"], 2, &["own world"]);
    check(&["find", "cup A", "--robot", "programm"], 2, &["program:COMMAND"]);
}
