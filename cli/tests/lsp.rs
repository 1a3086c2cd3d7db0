//! `descry lsp` with an editor on its standard input and output.

use crate::binary;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

/// Client of the language server.
struct Editor {
    server: Child,
    hears: BufReader<ChildStdout>,
    requests: u64,
    published: Vec<Value>,
}

impl Editor {
    fn begin() -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_descry"));
        command.args(["lsp", "--stdio"]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut server = command.spawn().expect("it starts");
        let hears = BufReader::new(server.stdout.take().expect("it speaks"));
        let mut editor = Editor { server, hears, requests: 0, published: Vec::new() };
        let said =
            editor.ask("initialize", json!({ "capabilities": {}, "processId": null, "rootUri": null }));
        assert_eq!(said["serverInfo"]["name"], "descry", "{said}");
        editor.tell("initialized", json!({}));
        editor
    }

    fn send(&mut self, message: &Value) {
        let text = message.to_string();
        let stdin = self.server.stdin.as_mut().expect("it hears");
        write!(stdin, "Content-Length: {}\r\n\r\n{text}", text.len()).expect("it hears");
        stdin.flush().expect("it hears");
    }

    fn hear(&mut self) -> Value {
        let mut length = 0;
        loop {
            let mut line = String::new();
            assert!(self.hears.read_line(&mut line).expect("it speaks") > 0, "it has gone");
            match line.trim().strip_prefix("Content-Length: ") {
                Some(number) => length = number.parse().expect("a number"),
                None if line.trim().is_empty() => break,
                None => {}
            }
        }
        let mut bytes = vec![0; length];
        self.hears.read_exact(&mut bytes).expect("all of it");
        serde_json::from_slice(&bytes).expect("it is JSON")
    }

    fn tell(&mut self, method: &str, params: Value) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    /// The response to a request; diagnostics that arrive meanwhile are stored.
    fn ask(&mut self, method: &str, params: Value) -> Value {
        self.requests += 1;
        let id = self.requests;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }));
        loop {
            let said = self.hear();
            if said["id"] == id {
                assert_eq!(said["error"], Value::Null, "{method}: {said}");
                return said["result"].clone();
            }
            self.published.push(said["params"].clone());
        }
    }

    fn open(&mut self, path: &Path, text: &str) {
        let document = json!({ "uri": uri(path), "languageId": "pddl", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
    }

    /// Replaces the first occurrence of a text.
    fn edit(&mut self, path: &Path, text: &mut String, old: &str, new: &str) {
        let range = json!({ "start": place(text, old, 0), "end": place(text, old, old.len()) });
        *text = text.replacen(old, new, 1);
        let changes = json!([{ "range": range, "text": new }]);
        let document = json!({ "uri": uri(path), "version": 2 });
        self.tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": changes }));
    }

    /// Code and line of the last published findings of a file; a preceding request for symbols ensures that
    /// all have arrived.
    fn findings(&mut self, path: &Path) -> Vec<(String, u64)> {
        self.ask("textDocument/documentSymbol", json!({ "textDocument": { "uri": uri(path) } }));
        let of = self.published.iter().rev().find(|p| p["uri"] == uri(path));
        let list = of.and_then(|p| p["diagnostics"].as_array()).cloned().unwrap_or_default();
        let one = |d: &Value| {
            let line = d["range"]["start"]["line"].as_u64().unwrap_or(u64::MAX);
            (d["code"].as_str().unwrap_or_default().to_string(), line)
        };
        list.iter().map(one).collect()
    }

    /// A request at the first occurrence of a text, `further` bytes in.
    fn at(&mut self, method: &str, path: &Path, text: &str, sought: &str, further: usize) -> Value {
        let position = place(text, sought, further);
        self.ask(method, json!({ "textDocument": { "uri": uri(path) }, "position": position }))
    }

    /// The fixes offered for the last findings of a file: each title, with the resulting text.
    fn mends(&mut self, path: &Path, text: &str) -> Vec<(String, String)> {
        self.findings(path);
        let of = self.published.iter().rev().find(|p| p["uri"] == uri(path));
        let found = of.map_or(Value::Null, |p| p["diagnostics"].clone());
        let range = json!({ "start": place(text, "", 0), "end": place(text, "", text.len()) });
        let document = json!({ "uri": uri(path) });
        let params = json!({ "textDocument": document, "range": range, "context": { "diagnostics": found } });
        let offered = self.ask("textDocument/codeAction", params);
        let mended = |action: &Value| {
            let edits = action["edit"]["changes"][uri(path)].as_array().cloned().unwrap_or_default();
            let mut text = text.to_string();
            for edit in edits.iter().rev() {
                let [from, to] = ["start", "end"].map(|end| byte(&text, &edit["range"][end]));
                text.replace_range(from..to, edit["newText"].as_str().unwrap_or_default());
            }
            (action["title"].as_str().unwrap_or_default().to_string(), text)
        };
        offered.as_array().cloned().unwrap_or_default().iter().map(mended).collect()
    }

    /// Hover text at the first occurrence of a text, `further` bytes in.
    fn hover(&mut self, path: &Path, text: &str, sought: &str, further: usize) -> String {
        let hover = self.at("textDocument/hover", path, text, sought, further);
        hover["contents"]["value"].as_str().unwrap_or_default().to_string()
    }

    fn end(mut self) {
        self.ask("shutdown", Value::Null);
        self.tell("exit", Value::Null);
        assert!(self.server.wait().expect("it ends").success());
    }
}

fn uri(path: &Path) -> String {
    format!("file://{}", path.display())
}

/// Position `further` bytes behind the first occurrence of a text; the texts are ASCII.
fn place(text: &str, sought: &str, further: usize) -> Value {
    let at = text.find(sought).unwrap_or_else(|| panic!("{sought} is not there")) + further;
    let line = text[..at].matches('\n').count();
    json!({ "line": line, "character": at - text[..at].rfind('\n').map_or(0, |n| n + 1) })
}

/// The byte offset of a position.
fn byte(text: &str, position: &Value) -> usize {
    let number = |name: &str| position[name].as_u64().unwrap_or(0) as usize;
    text.split_inclusive('\n').take(number("line")).map(str::len).sum::<usize>() + number("character")
}

const DOMAIN: &str = "(define (domain toy)
  (:requirements :strips :typing)
  (:types place)
  (:predicates
    (at ?p - place)        ; where one is
    (road ?a ?b - place)
    (sunny))
  ; Goes along a road.
  (:action go
    :parameters (?a ?b - place)
    :precondition (and (at ?a) (road ?a ?b))
    :effect (and (not (at ?a)) (at ?b))))
";
const PROBLEM: &str = "(define (problem p)
  (:domain toy)
  (:objects home shop - place)
  (:init (at home) (road home shop) (sunny))
  (:goal (at shop)))
";

#[test]
fn a_domain_and_its_problem_are_served() {
    let folder = tempfile::tempdir().expect("a folder");
    let (domain, problem) = (folder.path().join("d.pddl"), folder.path().join("p.pddl"));
    let (mut text, goal) = (DOMAIN.to_string(), PROBLEM.to_string());
    std::fs::write(&domain, &text).expect("written");
    let mut editor = Editor::begin();
    editor.open(&problem, &goal);
    assert_eq!(editor.findings(&problem), []);
    editor.open(&domain, &text);
    assert_eq!(editor.findings(&domain), []);

    // A fault as it is typed; what is open counts, not the disk; the problem depends on it.
    editor.edit(&domain, &mut text, "(road ?a ?b)", "(raod ?a ?b)");
    assert_eq!(editor.findings(&domain), [("undeclared-predicate".to_string(), 10)]);
    editor.edit(&domain, &mut text, "(raod ?a ?b)", "(road ?a ?b)");
    assert_eq!(editor.findings(&domain), []);
    editor.edit(&domain, &mut text, "(sunny)", "(rainy)");
    let codes: Vec<String> = editor.findings(&problem).into_iter().map(|(code, _)| code).collect();
    assert!(codes.contains(&"undeclared-predicate".to_string()), "{codes:?}");
    editor.edit(&domain, &mut text, "(rainy)", "(sunny)");
    assert_eq!(editor.findings(&problem), []);

    let hover = editor.at("textDocument/hover", &problem, &goal, "(at shop)", 2);
    let said = hover["contents"]["value"].as_str().expect("a text");
    assert!(said.contains("(at ?p - place)") && said.contains("where one is"), "{said}");
    let hover = editor.at("textDocument/hover", &domain, &text, "(:action go", 9);
    let said = hover["contents"]["value"].as_str().expect("a text");
    assert!(said.contains(":parameters") && !said.contains("where one is"), "{said}");

    let definition = editor.at("textDocument/definition", &problem, &goal, "(road home", 2);
    assert_eq!(definition[0]["uri"], uri(&domain), "{definition}");
    assert_eq!(definition[0]["range"]["start"], place(&text, "(road ?a", 1));
    let definition = editor.at("textDocument/definition", &domain, &text, "(at ?b)", 4);
    assert_eq!(definition["range"]["start"], place(&text, "?b - place)\n    :pre", 0), "{definition}");

    let labels = |items: Value| -> Vec<String> {
        let list = items.as_array().cloned().unwrap_or_default();
        list.iter().filter_map(|item| item["label"].as_str().map(str::to_string)).collect()
    };
    let offered = labels(editor.at("textDocument/completion", &problem, &goal, "(at shop)", 1));
    assert!(["at", "road", "and"].iter().all(|word| offered.iter().any(|o| o == word)), "{offered:?}");
    let offered = labels(editor.at("textDocument/completion", &problem, &goal, "at shop", 3));
    assert!(offered.contains(&"home".to_string()) && !offered.contains(&"road".to_string()), "{offered:?}");
    let offered = labels(editor.at("textDocument/completion", &domain, &text, "?p - place)        ;", 5));
    assert_eq!(offered, ["place"]);
    // What is put in takes the place of what was typed, the sign too.
    let offered = editor.at("textDocument/completion", &domain, &text, "?p - place)        ;", 1);
    let edit = &offered[0]["textEdit"];
    let characters = ["start", "end"].map(|end| edit["range"][end]["character"].as_u64().unwrap_or(0));
    assert_eq!(characters[1] - characters[0], 1, "{offered}");
    assert!(edit["newText"].as_str().is_some_and(|text| text.starts_with('?')), "{offered}");

    let symbols =
        editor.ask("textDocument/documentSymbol", json!({ "textDocument": { "uri": uri(&domain) } }));
    let names: Vec<&str> =
        symbols.as_array().expect("a list").iter().filter_map(|s| s["name"].as_str()).collect();
    assert_eq!(names, ["place", "at", "road", "sunny", "go"]);

    let untidy = "(define (problem p) (:domain toy)\n(:goal  (at shop) ) )\n";
    editor.edit(&problem, &mut goal.clone(), &goal, untidy);
    let options = json!({ "tabSize": 2, "insertSpaces": true });
    let edits = editor.ask(
        "textDocument/formatting",
        json!({ "textDocument": { "uri": uri(&problem) }, "options": options }),
    );
    assert_eq!(
        edits[0]["newText"], "(define (problem p)\n  (:domain toy)\n  (:goal (at shop)))\n",
        "{edits}"
    );
    editor.end();
}

#[test]
fn a_domain_folder_has_the_findings_of_check() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = binary::outcome(folder.path(), &["new", "own"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let own = folder.path().join("own");
    let (pddl, toml) = (own.join("domain.pddl"), own.join("domain.toml"));
    let (pddl_text, mut toml_text) =
        (std::fs::read_to_string(&pddl).expect("text"), std::fs::read_to_string(&toml).expect("text"));
    let mut editor = Editor::begin();
    editor.open(&toml, &toml_text);
    assert_eq!(editor.findings(&toml), []);

    let does = toml_text.lines().find(|l| l.starts_with("means")).expect("a phrase").to_string();
    editor.edit(&toml, &mut toml_text, &does, "means = \"(no-such-word)\"");
    let here = editor.findings(&toml);
    std::fs::write(&toml, &toml_text).expect("written");
    let checked: Value = binary::check(folder.path(), &["check", "own", "--json"], 1);
    let codes = |list: &Value| -> Vec<String> {
        let list = list.as_array().cloned().unwrap_or_default();
        list.iter().filter_map(|f| f["code"].as_str().map(str::to_string)).collect()
    };
    let said = codes(&checked["findings"]["list"]);
    let said = if said.is_empty() { codes(&checked["findings"]) } else { said };
    assert!(!here.is_empty(), "{checked}");
    assert_eq!(here.iter().map(|(code, _)| code.clone()).collect::<Vec<_>>(), said, "{checked}");

    // What is no TOML at all is said at its place.
    editor.edit(&toml, &mut toml_text, "means = \"(no-such-word)\"", "means = (");
    let line = toml_text.lines().position(|l| l == "means = (").expect("it is there") as u64;
    assert_eq!(editor.findings(&toml), [("unreadable".to_string(), line)]);

    editor.open(&pddl, &pddl_text);
    editor.edit(&toml, &mut toml_text, "means = (", &does);
    let word =
        pddl_text.lines().find(|l| l.trim_start().starts_with("(at ")).expect("a word").trim().to_string();
    let hover = editor.at("textDocument/hover", &pddl, &pddl_text, &word, 2);
    let said = hover["contents"]["value"].as_str().expect("a text");
    assert!(said.contains("sensed:"), "{said}");
    editor.end();
}

#[test]
fn a_missing_sign_hides_nothing_else_and_findings_are_mended() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("d.pddl");
    let come = "  (:action come\n    :parameters (?a ?b - place)\n    :precondition (raod ?a ?b)\n    :effect (at ?b)))\n";
    let open = DOMAIN
        .replace("(road ?a ?b))\n", "(raod ?a ?b)\n")
        .replace("(at ?b))))\n", &format!("(at ?b)))\n{come}"));
    let mut editor = Editor::begin();
    editor.open(&path, &open);
    let found = editor.findings(&path);
    let codes: Vec<&str> = found.iter().map(|(code, _)| code.as_str()).collect();
    assert_eq!(codes, ["unbalanced", "undeclared-predicate"], "{found:?}");

    // A call that is not closed is one nevertheless.
    let said = editor.hover(&path, &open, "(at ?a) (raod", 1);
    assert!(said.contains("(at ?p - place)") && said.contains("where one is"), "{said}");

    let mends = editor.mends(&path, &open);
    let titles: Vec<&str> = mends.iter().map(|(title, _)| title.as_str()).collect();
    assert_eq!(titles, ["Add `)`", "Write `road`"]);
    assert!(mends[0].1.contains("(raod ?a ?b))\n    :effect"), "{}", mends[0].1);
    // Everywhere, not only where it stands first.
    assert!(
        !mends[1].1.contains("(raod") && mends[1].1.contains(":precondition (road ?a ?b)\n"),
        "{}",
        mends[1].1
    );
    let whole = mends[0].1.replace("raod", "road");
    editor.edit(&path, &mut open.clone(), &open, &whole);
    assert_eq!(editor.findings(&path), []);
    assert_eq!(editor.mends(&path, &whole), []);
    editor.end();
}

#[test]
fn words_keys_and_headings_are_told_in_texts_that_are_not_finished() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = binary::outcome(folder.path(), &["new", "own"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let (pddl, toml) = (folder.path().join("own/domain.pddl"), folder.path().join("own/domain.toml"));
    let read = |path: &Path| std::fs::read_to_string(path).expect("text");
    let (mut text, keys) = (read(&pddl), read(&toml));
    let at = text.find(":effect").expect("an effect");
    let closed = text[..at].rfind("))").expect("a condition is closed");
    text.replace_range(closed..closed + 2, ")");

    let mut editor = Editor::begin();
    editor.open(&pddl, &text);
    assert!(editor.findings(&pddl).iter().any(|(code, _)| code == "unbalanced"));
    let said = editor.hover(&pddl, &text, "(at start (at ?", 12);
    assert!(said.contains("sensed:"), "{said}");

    let action = "[action.observe]";
    editor.open(&toml, &keys);
    for (sought, further, word) in [
        (action, 10, ":parameters"),
        (action, 3, "Execution of each action"),
        ("retries", 2, "tries again after a failure"),
        ("[[goal]]", 4, "Phrases that may be said"),
    ] {
        let said = editor.hover(&toml, &keys, sought, further);
        assert!(said.contains(word), "{sought}: {said}");
    }
    editor.end();
}

#[test]
fn odd_texts_and_requests_end_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.pddl");
    let mut editor = Editor::begin();
    for text in [
        "",
        "(",
        ")",
        "(define",
        "(define (domain",
        "?",
        "\u{1d11e}(",
        "0.0: (go a b) [1]\n(",
        "(define (problem",
    ] {
        editor.open(&path, text);
        for method in ["textDocument/hover", "textDocument/definition", "textDocument/completion"] {
            for (line, character) in [(0, 0), (0, 1), (0, 2), (9, 9)] {
                let position = json!({ "line": line, "character": character });
                editor.ask(method, json!({ "textDocument": { "uri": uri(&path) }, "position": position }));
            }
        }
        let options = json!({ "tabSize": 2, "insertSpaces": true });
        editor.ask(
            "textDocument/formatting",
            json!({ "textDocument": { "uri": uri(&path) }, "options": options }),
        );
        editor.findings(&path);
    }
    editor.tell("textDocument/didChange", json!({ "nonsense": true }));
    editor.tell("workspace/didChangeConfiguration", json!({}));
    editor.requests += 1;
    let id = editor.requests;
    editor.send(&json!({ "jsonrpc": "2.0", "id": id, "method": "textDocument/rename", "params": {} }));
    let refused = editor.hear();
    assert_eq!((&refused["id"], &refused["error"]["code"]), (&json!(id), &json!(-32601)), "{refused}");
    editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": uri(&path) } }));
    assert_eq!(editor.hear()["params"]["diagnostics"], json!([]));
    editor.end();
}
