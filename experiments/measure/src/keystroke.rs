//! Latency of findings after a keystroke in an editor, for a domain of a given length.
//!
//! `cargo run --release -p descry-measure --bin keystroke [LINES [KEYS]]`, 2,000 lines and 200 keys by
//! default.

use std::time::{Duration, Instant};

use descry_cli::lsp;
use lsp_server::{Connection, Message, Notification, Request, RequestId};
use serde_json::{Value, json};

const URI: &str = "file:///nowhere/domain.pddl";

fn main() {
    let mut arguments = std::env::args().skip(1).filter_map(|text| text.parse().ok());
    let (lines, keys) = (arguments.next().unwrap_or(2_000), arguments.next().unwrap_or(200));
    let (editor, server) = Connection::memory();
    let serving = std::thread::spawn(move || lsp::serve_over(&server));
    ask(&editor, 1, "initialize", json!({ "capabilities": {} }));
    tell(&editor, "initialized", json!({}));
    let text = domain(lines);
    let document = json!({ "uri": URI, "languageId": "pddl", "version": 1, "text": text });
    tell(&editor, "textDocument/didOpen", json!({ "textDocument": document }));
    findings(&editor);
    let line = text.lines().position(|line| line.contains("(linked ?a ?b)")).unwrap_or(0) + lines / 2;
    // A letter more and a letter less, in a word in the middle of the text: a finding comes and goes.
    let mut waited: Vec<Duration> = (0..keys).map(|n| key(&editor, line, n)).collect();
    waited.sort_unstable();
    let ms = |share: f64| waited[((keys - 1) as f64 * share) as usize].as_secs_f64() * 1e3;
    println!(
        "{} lines, {keys} keys: findings after {:.1} ms in the median, {:.1} ms in 95 of 100, {:.1} ms at most",
        text.lines().count(),
        ms(0.5),
        ms(0.95),
        ms(1.0)
    );
    ask(&editor, 2, "shutdown", Value::Null);
    tell(&editor, "exit", Value::Null);
    serving.join().expect("it has ended").expect("it served");
}

/// A domain of at least this many lines: a sequence of actions, six lines each.
fn domain(lines: usize) -> String {
    let mut text = String::from(
        "(define (domain long)\n  (:requirements :typing :negative-preconditions)\n  (:types place)\n\
         \x20 (:predicates (at ?a - place) (linked ?a ?b - place))\n",
    );
    for n in 0..lines.div_ceil(6) {
        text += &format!(
            "  (:action go-{n}\n    :parameters (?a ?b - place)\n    :precondition (and (at ?a)\n\
             \x20     (linked ?a ?b)\n      (not (at ?b)))\n    :effect (and (at ?b) (not (at ?a))))\n"
        );
    }
    text + ")\n"
}

/// Time from a keystroke, in the word `linked` of the action nearest to a line, until all findings have
/// arrived.
fn key(editor: &Connection, line: usize, n: usize) -> Duration {
    let line = (line - 8) / 6 * 6 + 8;
    let (from, to, text) = if n.is_multiple_of(2) { (13, 13, "x") } else { (13, 14, "") };
    let range =
        json!({ "start": { "line": line, "character": from }, "end": { "line": line, "character": to } });
    let changes = json!([{ "range": range, "text": text }]);
    let began = Instant::now();
    tell(
        editor,
        "textDocument/didChange",
        json!({ "textDocument": { "uri": URI, "version": n + 2 }, "contentChanges": changes }),
    );
    let found = findings(editor);
    let waited = began.elapsed();
    assert_eq!(found > 0, n.is_multiple_of(2), "a word that is not declared is found, and no other");
    waited
}

fn tell(editor: &Connection, method: &str, params: Value) {
    let said = Notification { method: method.into(), params };
    editor.sender.send(Message::Notification(said)).expect("it hears");
}

/// Waits for the next diagnostics; returns the number of findings.
fn findings(editor: &Connection) -> usize {
    loop {
        if let Message::Notification(said) = editor.receiver.recv().expect("it speaks") {
            return said.params["diagnostics"].as_array().map_or(0, Vec::len);
        }
    }
}

fn ask(editor: &Connection, id: i32, method: &str, params: Value) {
    let request = Request { id: RequestId::from(id), method: method.into(), params };
    editor.sender.send(Message::Request(request)).expect("it hears");
    while !matches!(editor.receiver.recv().expect("it speaks"), Message::Response(_)) {}
}
