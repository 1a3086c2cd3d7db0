//! Output of commands on a terminal of 80 columns.

use std::path::Path;
use std::process::{Command, Stdio};

/// Lines that a command prints on a terminal; none if no terminal is available.
fn on_a_terminal(folder: &Path, command: &str) -> Option<Vec<String>> {
    let typed = format!("stty cols 80; {} {command}", env!("CARGO_BIN_EXE_descry"));
    let mut script = Command::new("script");
    script.args(["-qec", &typed, "/dev/null"]).current_dir(folder).stdin(Stdio::null());
    let said = script.env("NO_COLOR", "1").output().ok()?;
    let text = String::from_utf8_lossy(&said.stdout).into_owned();
    Some(text.lines().map(|line| line.trim_end_matches('\r').to_string()).collect())
}

#[test]
fn nothing_is_wider_than_the_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let commands = [
        "find 'cup A' --seed 3",
        "runs",
        "show runs/find-cup-a-001",
        "explain runs/find-cup-a-001",
        "replay runs/find-cup-a-001",
        "check tabletop",
        "check home",
        "goals",
        "goals --domain nosuch",
        "find nosuch --domain home",
        "do 'fly to the moon' --domain home",
        "memory query runs/find-cup-a-001 --kind percepts",
        "--help",
        "find --help",
        "plan --help",
        "experiment --help",
        "memory query --help",
    ];
    for command in commands {
        let Some(lines) = on_a_terminal(folder.path(), command) else {
            eprintln!("SKIPPED: there is no `script` that makes a terminal");
            return;
        };
        assert!(lines.len() > 1 || command == "runs", "{command}: {lines:?}");
        let wide: Vec<&String> = lines.iter().filter(|line| line.chars().count() > 80).collect();
        assert!(wide.is_empty(), "descry {command}: {wide:#?}");
    }
}

#[test]
fn lines_stay_whole_where_programs_read_them() {
    let said =
        Command::new(env!("CARGO_BIN_EXE_descry")).args(["check", "tabletop"]).output().expect("it runs");
    let text = String::from_utf8_lossy(&said.stdout);
    assert!(text.lines().any(|line| line.ends_with("the thing stands on the surface, 0 to 1")), "{text}");
}
