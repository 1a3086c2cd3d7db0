//! Runs the binary as a script does.

// Each test uses some of it.
#![allow(dead_code)]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_descry"));
    command.args(arguments).current_dir(folder);
    command
}

/// Runs descry.
pub fn outcome(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("the binary runs")
}

/// Runs descry and returns what it printed as JSON.
pub fn check(folder: &Path, arguments: &[&str], exit: i32) -> Value {
    let output = outcome(folder, arguments);
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(exit), "{arguments:?}\n{err}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{arguments:?}: {e}\n{err}"))
}

/// Starts descry with its standard error captured.
pub fn start(folder: &Path, arguments: &[&str]) -> Child {
    command(folder, arguments).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().expect("it starts")
}

/// First line of its standard error.
pub fn first_line(child: &mut Child) -> String {
    let mut line = String::new();
    BufReader::new(child.stderr.as_mut().expect("it speaks")).read_line(&mut line).expect("it is text");
    line
}

/// Kills a run after `lines` lines of narration.
pub fn kill_after(folder: &Path, arguments: &[&str], lines: usize) {
    let mut child = start(folder, arguments);
    let said = BufReader::new(child.stderr.take().expect("it speaks"));
    let heard = said.lines().take(lines).filter_map(Result::ok).count();
    assert_eq!(heard, lines, "{arguments:?} ended by itself");
    child.kill().expect("it can be killed");
    child.wait().expect("it is gone");
}

/// Runs descry and expects a failure with an exit code and words.
pub fn check_refused(folder: &Path, arguments: &[&str], exit: i32, words: &[&str]) {
    let output = outcome(folder, arguments);
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(exit), "{arguments:?}\n{err}");
    for word in words {
        assert!(err.contains(word), "{arguments:?} does not say {word:?}: {err}");
    }
}

/// Runs descry with its standard output or standard error closed by the reader; returns the exit code.
pub fn without_readers(folder: &Path, arguments: &[&str], out: bool, err: bool) -> Option<i32> {
    let pipe = |closed: bool| if closed { Stdio::piped() } else { Stdio::null() };
    let mut child =
        command(folder, arguments).stdout(pipe(out)).stderr(pipe(err)).spawn().expect("it starts");
    drop((child.stdout.take(), child.stderr.take()));
    child.wait().expect("it ends").code()
}

/// All documents of a record, without blobs and the start time of the run.
pub fn documents(folder: &Path, run: &str) -> Vec<String> {
    let mut found = check(folder, &["memory", "query", run, "--json"], 0);
    let all = found["records"].as_array_mut().expect("a list");
    let mut all: Vec<String> = all
        .iter_mut()
        .map(|document| {
            if document["kind"] == "run" {
                document["body"]["started_unix_s"] = Value::Null;
            }
            document.to_string()
        })
        .collect();
    all.sort();
    all
}
