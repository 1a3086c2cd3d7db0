//! Unreadable files, endless input, and system limits: each ends promptly, with the reason and an exit code.

use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use crate::binary::{check_refused, outcome};
use tempfile::TempDir;

/// Runs a shell line in which `descry` is the binary.
fn shell(folder: &Path, line: &str) -> Output {
    let line = line.replace("descry", env!("CARGO_BIN_EXE_descry"));
    Command::new("sh").args(["-c", &line]).current_dir(folder).output().expect("the shell runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn what_is_no_file_is_refused_at_once() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let made = shell(folder, "mkfifo pipe.ply && descry new mine && mkfifo mine/objects/pipe.toml");
    assert!(made.status.success(), "{}", said(&made));
    let started = Instant::now();
    check_refused(folder, &["recognise", "pipe.ply"], 2, &["pipe.ply", "it is a named pipe"]);
    check_refused(folder, &["recognise", "/dev/zero"], 2, &["/dev/zero", "it is a device"]);
    check_refused(folder, &["check", "mine"], 2, &["pipe.toml", "it is a named pipe"]);
    check_refused(folder, &["find", "cup A", "--scene", "/dev/zero"], 2, &["/dev/zero", "it is a device"]);
    assert!(started.elapsed() < Duration::from_secs(10), "{:?}", started.elapsed());
    let given = shell(folder, "echo '(define (domain d))' | descry check /dev/stdin");
    assert!(!said(&given).contains("a file was expected"), "{}", said(&given));
}

/// The content of a recording given by mistake is not printed, text or not.
#[test]
fn an_error_shows_little_of_a_long_line() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let long = format!("#ROSBAG V2.0\n{}", "\0".repeat(1 << 20));
    std::fs::write(folder.join("run.bag"), long).expect("it can be written");
    for command in [["find", "cup A", "--robot", "recorded:run.bag"], ["find", "cup A", "--scene", "run.bag"]]
    {
        let output = outcome(folder, &command);
        assert_eq!(output.status.code(), Some(2), "{command:?}: {}", said(&output));
        assert!(output.stderr.len() < 4000, "{command:?} says {} bytes", output.stderr.len());
    }
}

#[test]
fn a_garbage_segment_is_damage() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    std::fs::create_dir_all(folder.join("run/record/segments")).expect("folders can be made");
    let segment = folder.join("run/record/segments/00000001.mcap");
    let mut bytes = b"\x89MCAP0\r\n\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x06".to_vec();
    bytes.extend(0x4000_0000_0000_0000_u64.to_le_bytes());
    bytes.extend([b'x'; 100]);
    std::fs::write(&segment, &bytes).expect("it can be written");
    for command in [["memory", "verify", "run"], ["memory", "query", "run"], ["memory", "show", "run"]] {
        let output = outcome(folder, &command);
        assert_eq!(output.status.code(), Some(1), "{command:?}: {}", said(&output));
    }
    assert_eq!(std::fs::read(&segment).expect("it is there"), bytes);
}

#[test]
fn a_limit_of_the_length_of_files_is_said() {
    let folder = TempDir::new().expect("a folder can be made");
    let ended = shell(folder.path(), "ulimit -f 100; descry find 'cup A' --run run");
    assert_eq!(ended.status.code(), Some(5), "{}", said(&ended));
    let named = ["File too large", "disk I/O error"].iter().any(|reason| said(&ended).contains(reason));
    assert!(named, "{}", said(&ended));
}

#[test]
fn a_limit_of_the_address_space_is_said() {
    let folder = TempDir::new().expect("a folder can be made");
    let ended = shell(folder.path(), "ulimit -v 200000; descry find 'cup A' --run run");
    assert_eq!(ended.status.code(), Some(4), "{:?}: {}", ended.status, said(&ended));
    assert!(!ended.stderr.is_empty());
}
