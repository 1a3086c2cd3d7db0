//! A robot program that logs its requests.

// Each test uses some of it.
#![allow(dead_code)]

use std::path::Path;
use std::process::Command;

/// Source of a robot program that logs its requests and drives to the table of the template's room, slowly
/// enough for a test to follow.
const BODY: &str = r#"
import os, sys, time
sys.path.insert(0, "PYTHON")
import descry_robot as descry, template

heard = open("heard", "a", buffering=1)
plain = descry.Request.feedback

def feedback(request, *done):
    time.sleep(0.01)
    plain(request, *done)

descry.Request.feedback = feedback

def told(name):
    def asked(robot, request, **given):
        heard.write(f"{name}\n")
        done = getattr(template.Template, name)(robot, request, **given)
        heard.write(f"{name} done {given}\n")
        return done
    return asked

kinds = {name: told(name) for name in ("drive_to", "look_at", "sense")}
body = type("Body", (template.Template,), {**kinds, "stop": lambda robot: heard.write("stop\n")})()
if os.path.exists("stands"):
    body.at = tuple(float(number) for number in open("stands").read().split())
drive = body.drive_to
def driven(request, **given):
    try:
        return drive(request, **given)
    finally:
        open("stands", "w").write(" ".join(map(str, body.at)))
body.drive_to = driven
descry.serve(body)
"#;

/// True if Python is installed.
pub fn has_python() -> bool {
    Command::new("python3").arg("--version").output().is_ok()
}

/// The logged requests, in order.
pub fn heard(folder: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join("heard")).unwrap_or_default();
    text.lines().map(str::to_string).collect()
}

/// Writes the robot program into a folder; returns the value for `--robot`.
pub fn body_in(folder: &Path) -> &'static str {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/python");
    let body = BODY.replace("PYTHON", &python.display().to_string());
    std::fs::write(folder.join("body.py"), body).expect("the folder is writable");
    "program:python3 body.py"
}

/// Checks that no completed drive was requested again.
pub fn check_nothing_twice(folder: &Path) {
    let drives = heard(folder).into_iter().filter(|line| line.starts_with("drive_to done"));
    let mut once: Vec<String> = drives.collect();
    let all = once.len();
    once.sort();
    once.dedup();
    assert_eq!(once.len(), all, "no drive that ended is asked for again: {:?}", heard(folder));
}
