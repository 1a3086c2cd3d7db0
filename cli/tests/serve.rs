//! `descry serve`: goals over HTTP, each of which ends in one verdict.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

struct Server {
    process: Child,
    address: String,
    /// Lines before that with the address.
    before: String,
    told: BufReader<ChildStderr>,
}

impl Server {
    fn begin(folder: &Path, more: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_descry"));
        command.args(["serve", "--listen", "127.0.0.1:0", "--folder"]).arg(folder).args(more);
        let mut process = command.stderr(Stdio::piped()).spawn().expect("it starts");
        let mut told = BufReader::new(process.stderr.take().expect("it tells"));
        let (mut before, mut line) = (String::new(), String::new());
        while !line.contains("http://") {
            before += &std::mem::take(&mut line);
            assert!(told.read_line(&mut line).expect("it tells where") > 0, "{before}");
        }
        let address =
            line.split("http://").nth(1).unwrap_or_default().trim().trim_end_matches('/').to_string();
        assert!(!address.is_empty(), "{line}");
        Server { process, address, before, told }
    }

    /// Status and JSON body of a response.
    fn ask(&self, method: &str, path: &str, body: &str, header: &str) -> (u16, Value) {
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        let host = &self.address;
        let length = body.len();
        write!(stream, "{method} /{path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{header}Content-Length: {length}\r\n\r\n{body}")
            .expect("it hears");
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("it answers");
        let status = text.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or_default();
        let body = text.split_once("\r\n\r\n").map_or("", |(_, body)| body);
        (status, serde_json::from_str(body).unwrap_or_else(|e| panic!("{e}: {text}")))
    }

    fn give(&self, goal: &str, urgent: bool) -> u64 {
        let (status, given) =
            self.ask("POST", "goals", &json!({ "goal": goal, "urgent": urgent }).to_string(), "");
        assert_eq!(status, 202, "{given}");
        given["id"].as_u64().expect("a number")
    }

    /// Waits for a goal to meet a condition.
    fn wait(&self, id: u64, is: impl Fn(&Value) -> bool) -> Value {
        let began = Instant::now();
        loop {
            let (_, goal) = self.ask("GET", &format!("goals/{id}"), "", "");
            if is(&goal) {
                return goal;
            }
            assert!(began.elapsed() < Duration::from_secs(60), "{goal}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
        let mut rest = String::new();
        let _ = self.told.read_to_string(&mut rest);
    }
}

#[test]
fn goals_are_taken_told_and_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let server = Server::begin(folder.path(), &[]);
    assert_eq!(server.ask("GET", "openapi.json", "", "").1["openapi"], "3.1.0");
    let (status, said) = server.ask("POST", "goals", "{\"gaol\": 1}", "");
    assert!(
        status == 400 && said["error"].as_str().is_some_and(|why| why.contains("expected {\"goal\"")),
        "{said}"
    );
    assert_eq!(server.ask("GET", "goals/7", "", "").0, 404);
    assert_eq!(server.ask("GET", "goals", "", "Origin: http://elsewhere.example\r\n").0, 403);
    let id = server.give("find the unknown", false);
    let ended = server.wait(id, |goal| goal["state"] == "ended");
    assert_eq!(ended["report"]["verdict"], "failed", "{ended}");
    assert!(ended["report"]["why"].as_str().is_some_and(|why| why.contains("unknown")), "{ended}");
    assert_eq!(server.ask("DELETE", &format!("goals/{id}"), "", "").1["state"], "ended");
}

#[test]
fn a_token_is_asked_for_where_one_was_given() {
    let folder = tempfile::tempdir().expect("a folder");
    let token = folder.path().join("token");
    std::fs::write(&token, "open sesame\n").expect("it is written");
    let server = Server::begin(folder.path(), &["--token", token.to_str().expect("text")]);
    assert_eq!(server.ask("GET", "goals", "", "").0, 401);
    assert_eq!(server.ask("GET", "goals", "", "Authorization: Bearer open sesam\r\n").0, 401);
    assert_eq!(server.ask("GET", "goals", "", "Authorization: Bearer open sesame\r\n").0, 200);
    let mut open = Command::new(env!("CARGO_BIN_EXE_descry"));
    let refused = open
        .args(["serve", "--listen", "0.0.0.0:0", "--folder"])
        .arg(folder.path())
        .output()
        .expect("it ends");
    assert_eq!(refused.status.code(), Some(2));
}

/// The standard error of a server that ends at once.
fn refused(folder: &Path, exit: i32) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_descry"));
    let ended = command.args(["serve", "--listen", "127.0.0.1:0", "--folder"]).arg(folder).output();
    let ended = ended.expect("it ends");
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(exit), "{said}");
    said
}

#[test]
fn a_folder_has_one_server() {
    let folder = tempfile::tempdir().expect("a folder");
    let first = Server::begin(folder.path(), &[]);
    let said = refused(folder.path(), 2);
    let holder = format!("another server pursues the goals there (process {})", first.process.id());
    assert!(said.contains(&holder) && said.contains("--folder"), "{said}");
    drop(first);
    drop(Server::begin(folder.path(), &[]));
}

/// A damaged last line is named, its bytes stay, and no number is given twice; another one is an error.
#[test]
fn no_goal_goes_silently() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("goals.jsonl");
    let goal = |id: u64| {
        let (run, process, report) = (Value::Null, Value::Null, Value::Null);
        let goal = json!({ "id": id, "goal": "find mug", "urgent": false, "state": "cancelled",
            "run": run, "process": process, "report": report });
        goal.to_string()
    };
    let torn = format!("{}\n{}", goal(1), &goal(2)[..30]);
    std::fs::write(&path, &torn).expect("it is written");
    for next in [3, 4] {
        let server = Server::begin(folder.path(), &[]);
        assert_eq!(server.before.contains("goals.jsonl, line 2: is damaged"), next == 3, "{}", server.before);
        let id = server.give("find the unknown", false);
        assert_eq!(id, next);
        server.wait(id, |goal| goal["state"] == "ended");
        drop(server);
        assert!(std::fs::read_to_string(&path).expect("a journal").starts_with(&torn));
    }
    let garbled = format!("{}\n\u{1}\n{}\n", goal(1), goal(2));
    std::fs::write(&path, &garbled).expect("it is written");
    let said = refused(folder.path(), 5);
    assert!(said.contains("goals.jsonl, line 2: is damaged") && said.contains("sed -i 2d"), "{said}");
    assert_eq!(std::fs::read_to_string(&path).expect("a journal"), garbled);
}

/// An urgent goal interrupts, one is cancelled, the server is killed: each goal ends once.
#[test]
fn each_goal_ends_once_whatever_happens() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut server = Server::begin(folder.path(), &[]);
    let long = server.give("identify all objects on the table", false);
    server.wait(long, |goal| goal["process"].is_u64());
    let urgent = server.give("find mug", true);
    let (next, cancelled) = (server.give("find cup A", false), server.give("find cup B", false));
    assert_eq!(server.ask("DELETE", &format!("goals/{cancelled}"), "", "").1["state"], "cancelled");
    server.wait(urgent, |goal| goal["process"].is_u64());
    server.process.kill().expect("it is killed");
    server.process.wait().expect("it has ended");
    drop(server);
    let server = Server::begin(folder.path(), &[]);
    for id in [urgent, long, next] {
        let ended = server.wait(id, |goal| goal["state"] == "ended");
        assert!(ended["report"]["verdict"].is_string(), "{ended}");
    }
    let journal = std::fs::read_to_string(folder.path().join("goals.jsonl")).expect("a journal");
    let ends = |id: u64| {
        let lines = journal.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        lines
            .filter(|goal| goal["id"] == id && (goal["state"] == "ended" || goal["state"] == "cancelled"))
            .count()
    };
    assert_eq!([long, urgent, next, cancelled].map(ends), [1; 4], "{journal}");
}
