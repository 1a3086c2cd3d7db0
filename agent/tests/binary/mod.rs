//! The binary as a script runs it.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_descry"));
    command.args(arguments).current_dir(folder);
    command
}

/// Runs descry and returns what it printed as JSON.
pub fn check(folder: &Path, arguments: &[&str], exit: i32) -> Value {
    let output: Output = command(folder, arguments).output().expect("the binary runs");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(exit), "{arguments:?}\n{err}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{arguments:?}: {e}\n{err}"))
}

/// Kills a run after it has said so many lines.
pub fn kill_after(folder: &Path, arguments: &[&str], lines: usize) {
    let mut child =
        command(folder, arguments).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().expect("it starts");
    let said = BufReader::new(child.stderr.take().expect("it speaks"));
    let heard = said.lines().take(lines).filter_map(Result::ok).count();
    assert_eq!(heard, lines, "{arguments:?} ended by itself");
    child.kill().expect("it can be killed");
    child.wait().expect("it is gone");
}

/// Runs descry where it cannot do what it is asked, and expects an exit code and words.
pub fn check_refused(folder: &Path, arguments: &[&str], exit: i32, words: &[&str]) {
    let output = command(folder, arguments).output().expect("the binary runs");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(exit), "{arguments:?}\n{err}");
    for word in words {
        assert!(err.contains(word), "{arguments:?} does not say {word:?}: {err}");
    }
}
