//! `--live`: the live page as a browser on this machine requests it, and as refused clients do.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Child;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::binary::{check, check_refused, documents, outcome, start};
use crate::body::has_python;
use serde_json::Value;

/// Response: its status, head and body.
struct Answer {
    status: u16,
    head: String,
    text: String,
}

/// Sends a request with these headers; none if the connection is closed.
fn asked(address: &str, first: &str, lines: &[&str]) -> Option<Answer> {
    let mut stream = TcpStream::connect(address).ok()?;
    let request = format!("{first} HTTP/1.1\r\nConnection: close\r\n{}\r\n\r\n", lines.join("\r\n"));
    stream.write_all(request.as_bytes()).ok()?;
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).ok()?;
    let answer = String::from_utf8(bytes).ok()?;
    let (head, text) = answer.split_once("\r\n\r\n")?;
    let status = head.split(' ').nth(1)?.parse().ok()?;
    Some(Answer { status, head: head.to_lowercase(), text: text.to_owned() })
}

fn got(address: &str, path: &str) -> Option<Answer> {
    asked(address, &format!("GET {path}"), &[&format!("Host: {address}")])
}

/// Expects a status for a request, and the security headers of every response.
fn check_status(address: &str, first: &str, lines: &[&str], status: u16) {
    let answer = asked(address, first, lines).unwrap_or_else(|| panic!("{first} {lines:?} was not answered"));
    assert_eq!(answer.status, status, "{first} {lines:?}\n{}\n{}", answer.head, answer.text);
    for line in ["content-security-policy: default-src 'none'", "cross-origin-resource-policy: same-origin"] {
        assert!(answer.head.contains(line), "{first}\n{}", answer.head);
    }
    assert!(!answer.head.contains("access-control"), "nobody else is let in: {}", answer.head);
}

/// Starts a command with a live page; returns its address, and a thread that drains its messages.
fn shown(folder: &Path, arguments: &[&str]) -> (Child, String, JoinHandle<()>) {
    let mut child = start(folder, arguments);
    let mut said = BufReader::new(child.stderr.take().expect("it speaks"));
    let mut line = String::new();
    said.read_line(&mut line).expect("it is text");
    let address = line.trim().strip_prefix("live      http://").and_then(|rest| rest.strip_suffix('/'));
    let address = address.unwrap_or_else(|| panic!("no address is said first: {line}")).to_owned();
    let rest = std::thread::spawn(move || said.lines().map_while(Result::ok).for_each(drop));
    (child, address, rest)
}

/// Follows the event stream to its end; returns the number of updates, and the final response at a path.
fn followed(address: &str, path: &str) -> (usize, Answer) {
    let mut stream = TcpStream::connect(address).expect("it is there");
    write!(stream, "GET /news HTTP/1.1\r\nHost: {address}\r\n\r\n").expect("it listens");
    let lines = BufReader::new(&stream).lines().map_while(Result::ok);
    let mut news = 0;
    for line in lines.filter(|line| line.starts_with("data: ")) {
        news += 1;
        let event: Value = serde_json::from_str(&line["data: ".len()..]).expect("it is JSON");
        if event["ended"] == true {
            return (news, got(address, path).expect("it waits for who listens"));
        }
    }
    panic!("the news break off before the end");
}

/// Requests everything repeatedly until the server is gone.
fn hungry(address: String) {
    while let Some(answer) = got(&address, "/story") {
        let story: Value = serde_json::from_str(&answer.text).unwrap_or_default();
        for look in story["looks"].as_array().into_iter().flatten() {
            let key = look["key"].as_str().expect("a look has a key");
            assert!(look["points"].is_null(), "the points of a look are fetched alone");
            let Some(points) = got(&address, &format!("/points/{key}")) else { return };
            let moved = points.status == 404;
            assert!(moved || points.text.starts_with("{\"min_m\":"), "{}", points.text);
        }
        got(&address, "/");
    }
}

#[test]
fn a_run_is_shown_to_this_machine_alone_and_knows_nothing_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let (mut child, address, rest) =
        shown(folder, &["find", "cup A", "--seed", "3", "--run", "seen", "--live"]);
    let own = format!("Host: {address}");
    let port = address.split(':').nth(1).expect("a port");
    assert!(address.starts_with("127.0.0.1:"), "{address}");
    check_status(&address, "GET /", &[&own], 200);
    check_status(&address, "GET /", &[&format!("Host: localhost:{port}")], 200);
    check_status(&address, "GET /", &[&own, &format!("Origin: http://{address}")], 200);
    for path in ["/", "/story", "/news", "/points/1-00000000"] {
        check_status(&address, &format!("GET {path}"), &[&own, "Origin: http://evil.example"], 403);
        check_status(&address, &format!("GET {path}"), &[&own, "Origin: null"], 403);
        check_status(&address, &format!("GET {path}"), &[&format!("Host: evil.example:{port}")], 403);
    }
    check_status(&address, "POST /story", &[&own, "Content-Length: 0"], 405);
    check_status(&address, "GET /run.json", &[&own], 404);
    check_status(&address, "GET /../run.json", &[&own], 404);
    let readers: Vec<JoinHandle<()>> = (0..3)
        .map(|_| {
            let address = address.clone();
            std::thread::spawn(|| hungry(address))
        })
        .collect();
    let (news, last) = followed(&address, "/story");
    assert!(news >= 2, "{news} news of a run");
    let story: Value = serde_json::from_str(&last.text).expect("it is JSON");
    let told = (&story["report"]["verdict"], &story["goal"], &story["lost"]);
    assert_eq!(told, (&"achieved".into(), &"find cup A".into(), &serde_json::json!([])));
    assert_eq!(
        story["looks"].as_array().map(Vec::len),
        story["report"]["views"].as_u64().map(|n| n as usize)
    );
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    rest.join().expect("it was heard");
    readers.into_iter().for_each(|reader| reader.join().expect("a reader got what it should"));
    // The same without anybody who reads.
    check(folder, &["find", "cup A", "--seed", "3", "--run", "alone", "--json"], 0);
    assert!(documents(folder, "seen") == documents(folder, "alone"), "readers are in the record");
}

/// The template robot, which waits for a signal after its first look.
const PATIENT: &str = r#"
import os, sys, time
sys.path.insert(0, "PYTHON")
import descry_robot as descry, template

class Patient(template.Template):
    looks = 0
    def sense(self, request, **given):
        self.looks += 1
        return super().sense(request, **given)
    def drive_to(self, request, **given):
        while self.looks and not os.path.exists("go"):
            time.sleep(0.01)
        return super().drive_to(request, **given)

descry.serve(Patient())
"#;

#[test]
fn each_look_is_shown_when_it_has_come() {
    if !has_python() {
        eprintln!("SKIPPED: there is no python3");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/python");
    let body = PATIENT.replace("PYTHON", &python.display().to_string());
    std::fs::write(folder.join("body.py"), body).expect("the folder is writable");
    let goal = ["find", "cup A", "--robot", "program:python3 body.py", "--run", "run", "--live"];
    let (mut child, address, rest) = shown(folder, &goal);
    let story =
        || got(&address, "/story").and_then(|answer| serde_json::from_str::<Value>(&answer.text).ok());
    let looks = |story: &Value| story["looks"].as_array().map_or(0, Vec::len);
    let seen = (0..6_000).find_map(|_| {
        std::thread::sleep(Duration::from_millis(10));
        story().filter(|story| looks(story) == 1)
    });
    let seen = seen.expect("the first look is shown while the body waits");
    assert_eq!((&seen["report"], &seen["lost"]), (&Value::Null, &serde_json::json!([])), "{seen}");
    std::fs::write(folder.join("go"), "").expect("the folder is writable");
    let (_, last) = followed(&address, "/story");
    let last: Value = serde_json::from_str(&last.text).expect("it is JSON");
    assert!(looks(&last) > 1 && last["report"]["verdict"] == "not_found", "{}", last["report"]);
    assert_eq!(child.wait().expect("it ends").code(), Some(1));
    rest.join().expect("it was heard");
}

#[test]
fn a_port_that_is_taken_is_said_before_anything_begins() {
    let folder = tempfile::tempdir().expect("a folder");
    let taken = TcpListener::bind("127.0.0.1:0").expect("there is a port");
    let port = taken.local_addr().expect("it has an address").port();
    let live = format!("--live={port}");
    check_refused(folder.path(), &["find", "cup A", &live], 2, &[&live, "another port"]);
    assert!(!folder.path().join("runs").exists(), "no run was begun");
}

const BATCH: &str = r#"
name = "batch"
kind = "tasks"
about = "A few runs"
domain = "tabletop"
scene = "default"
runs = 2
first_seed = 1
policies = ["plan", "nearest"]

[[goal]]
say = "find cup A"
targets = ["cup A"]
truly = "found"
"#;

#[test]
#[ignore = "slow: two batches"]
fn a_batch_is_shown_while_it_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("batch.toml"), BATCH).expect("the folder is writable");
    let (mut child, address, rest) =
        shown(folder, &["experiment", "batch.toml", "--out", "seen", "--jobs", "1", "--live"]);
    check_status(&address, "GET /", &[&format!("Host: {address}"), "Origin: http://evil.example"], 403);
    let first = got(&address, "/").expect("it is there");
    assert!(first.text.contains("<progress max=\"4\"") && first.text.contains("follow("), "{}", first.text);
    let (news, last) = followed(&address, "/");
    assert!(news >= 2, "{news} news of a batch");
    for part in ["<progress max=\"4\" value=\"4\">", "<h3>All runs</h3>", "4 of 4 (0 failed)"] {
        assert!(last.text.contains(part), "{part} is not in\n{}", last.text);
    }
    assert!(!last.text.contains("so far"), "{}", last.text);
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    rest.join().expect("it was heard");
    assert_eq!(outcome(folder, &["experiment", "batch.toml", "--out", "alone"]).status.code(), Some(0));
    let table =
        |out: &str| std::fs::read_to_string(folder.join(out).join("tables.md")).expect("there are tables");
    assert_eq!(table("seen"), table("alone"));
}

#[test]
fn who_opens_connections_and_says_nothing_keeps_nobody_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let (mut child, address, rest) =
        shown(folder.path(), &["find", "cup A", "--seed", "3", "--run", "run", "--live"]);
    let silent: Vec<TcpStream> = (0..200).filter_map(|_| TcpStream::connect(&address).ok()).collect();
    assert!(silent.len() > 100, "{}", silent.len());
    let began = Instant::now();
    let page = got(&address, "/").expect("the page is answered");
    assert_eq!(page.status, 200);
    assert!(began.elapsed() < Duration::from_secs(5), "{:?}", began.elapsed());
    drop(silent);
    child.kill().expect("it is ended");
    child.wait().expect("it has ended");
    rest.join().expect("it was heard");
}
