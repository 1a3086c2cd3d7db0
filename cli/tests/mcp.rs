//! `descry mcp` with an assistant on its standard input and output.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

/// Client of the server.
struct Assistant {
    server: Child,
    hears: BufReader<ChildStdout>,
    requests: u64,
    folder: tempfile::TempDir,
}

impl Assistant {
    fn begin(more: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let mut command = Command::new(env!("CARGO_BIN_EXE_descry"));
        command.arg("mcp").arg("--folder").arg(folder.path()).args(more);
        let mut server = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it starts");
        let hears = BufReader::new(server.stdout.take().expect("it speaks"));
        let mut assistant = Assistant { server, hears, requests: 0, folder };
        let client = json!({ "name": "a test", "version": "1" });
        let greeted = assistant.ask(
            "initialize",
            json!({ "protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": client }),
        );
        assert_eq!(greeted["result"]["protocolVersion"], "2025-06-18", "{greeted}");
        assistant.send(&json!({ "jsonrpc": "2.0", "method": "notifications/initialized" }));
        assistant
    }

    fn send(&mut self, message: &Value) {
        writeln!(self.server.stdin.as_mut().expect("it hears"), "{message}").expect("it hears");
    }

    fn hear(&mut self) -> Value {
        let mut line = String::new();
        assert!(self.hears.read_line(&mut line).expect("it speaks") > 0, "it has gone");
        serde_json::from_str(&line).expect("it is JSON")
    }

    fn begin_asking(&mut self, method: &str, parameters: Value) -> u64 {
        self.requests += 1;
        let id = self.requests;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": parameters }));
        id
    }

    /// The response to a request, skipping progress notifications.
    fn ask(&mut self, method: &str, parameters: Value) -> Value {
        let id = self.begin_asking(method, parameters);
        loop {
            let heard = self.hear();
            if heard["id"] == id {
                return heard;
            }
        }
    }

    fn call(&mut self, tool: &str, arguments: Value) -> Value {
        self.ask("tools/call", json!({ "name": tool, "arguments": arguments }))
    }

    /// The structured content of a tool's result.
    fn answer(&mut self, tool: &str, arguments: Value) -> Value {
        let heard = self.call(tool, arguments);
        let result = &heard["result"];
        let text = result["content"][0]["text"].as_str().unwrap_or_default();
        assert_eq!(
            serde_json::from_str::<Value>(text).ok().as_ref(),
            Some(&result["structuredContent"]),
            "{heard}"
        );
        result["structuredContent"].clone()
    }
}

impl Drop for Assistant {
    fn drop(&mut self) {
        drop(self.server.stdin.take());
        let ended = self.server.wait().expect("it ends with its input");
        assert!(ended.success(), "{ended}");
    }
}

const DOMAIN: &str = "(define (domain errands) (:requirements :strips :typing) (:types place)
  (:predicates (at ?p - place) (way ?a ?b - place))
  (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
    :effect (and (at ?b) (not (at ?a)))))";
const PROBLEM: &str = "(define (problem home) (:domain errands) (:objects shop park home - place)
  (:init (at shop) (way shop park) (way park home)) (:goal (at home)))";

#[test]
fn every_tool_is_listed_with_what_it_takes() {
    let mut assistant = Assistant::begin(&[]);
    let listed = assistant.ask("tools/list", json!({}));
    let tools = listed["result"]["tools"].as_array().expect("a list").clone();
    let names: Vec<&str> = tools.iter().filter_map(|tool| tool["name"].as_str()).collect();
    let expected = ["check", "format", "plan", "validate", "why_not", "goals", "run", "explain", "recognise"];
    assert_eq!(names, expected);
    assert!(tools.iter().all(|tool| tool["inputSchema"]["type"] == "object"), "{listed}");
    assert_eq!(assistant.ask("ping", json!({}))["result"], json!({}));
}

#[test]
fn plans_are_found_checked_and_asked_about() {
    let mut assistant = Assistant::begin(&[]);
    let both = |more: Value| {
        let mut arguments = json!({ "domain": DOMAIN, "problem": PROBLEM });
        arguments.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        arguments
    };
    let found = assistant.answer("plan", both(json!({})));
    assert_eq!((&found["status"], &found["exit"]), (&json!("solved"), &json!(0)), "{found}");
    let plan = "(go shop park)\n(go park home)\n";
    assert_eq!(assistant.answer("validate", both(json!({ "plan": plan })))["valid"], true);
    let wrong = assistant.answer("validate", both(json!({ "plan": "(go park home)\n" })));
    assert_eq!((&wrong["valid"], &wrong["exit"]), (&json!(false), &json!(1)), "{wrong}");
    let why = assistant.answer("why_not", both(json!({ "action": "(go home park)" })));
    assert_eq!(why["why_not"]["in_plan"], false, "{why}");
    let laid_out = assistant.answer("format", json!({ "text": DOMAIN }));
    assert!(laid_out["text"].as_str().is_some_and(|text| text.lines().count() > 5), "{laid_out}");
    let unsolvable = PROBLEM.replace("(way park home)", "");
    let none = assistant.answer("plan", json!({ "domain": DOMAIN, "problem": unsolvable }));
    assert_eq!(none["exit"], 3, "{none}");
}

/// Three faults, one hidden behind another: each is fixed at the place of its finding with the suggested
/// text.
#[test]
fn a_domain_is_mended_by_its_findings_alone() {
    let mut assistant = Assistant::begin(&[]);
    let mut domain = DOMAIN
        .replace("(not (at ?a))", "(not (att ?a))")
        .replace("(?a ?b - place) :pre", "(?a ?b - plase) :pre")
        .replace("(way ?a ?b)) \n", "(way ?a ?b))\n")
        .replace("(and (at ?a) (way ?a ?b))", "(and (at ?a) (wya ?a ?b))");
    for _ in 0..6 {
        let said = assistant.answer("check", json!({ "domain": domain, "problem": PROBLEM }));
        let Some(finding) =
            said["findings"].as_array().and_then(|all| all.iter().find(|f| f["severity"] == "error"))
        else {
            break;
        };
        let help = finding["help"].as_str().expect("a mend");
        let mend = help.split('`').nth(1).unwrap_or_else(|| panic!("a mend in {help}"));
        let place = &finding["labels"][0];
        let (start, end) =
            (place["start"].as_u64().unwrap() as usize, place["end"].as_u64().unwrap() as usize);
        domain.replace_range(start..end, mend);
    }
    let found = assistant.answer("plan", json!({ "domain": domain, "problem": PROBLEM }));
    assert_eq!(found["status"], "solved", "{domain}\n{found}");
}

#[test]
fn what_cannot_be_used_is_refused_with_what_was_expected() {
    let mut assistant = Assistant::begin(&[]);
    let refused = |heard: Value, part: &str| {
        let message = heard["error"]["message"].as_str().unwrap_or_default();
        assert!(message.contains(part), "{part}: {heard}");
    };
    refused(assistant.call("plan", json!({ "domain": DOMAIN })), "`problem` is missing");
    refused(assistant.call("plan", json!({ "domain": 3, "problem": PROBLEM })), "expected a text");
    refused(
        assistant.call("plan", json!({ "dominion": "" })),
        "has no argument `dominion`; it has domain, problem",
    );
    refused(assistant.call("fly", json!({})), "there is no tool `fly`; there are check");
    refused(assistant.call("explain", json!({ "run": "/etc" })), "is not below");
    refused(assistant.call("run", json!({ "goal": "--help" })), "begins with a hyphen");
    refused(assistant.call("recognise", json!({ "clouds": [] })), "expected a list of one path or more");
    refused(assistant.call("goals", json!({ "domain": "" })), "`domain` is \"\"; expected the name");
    refused(assistant.ask("resources/list", json!({})), "there is no method");
    assistant.send(&json!("nothing"));
    refused(assistant.hear(), "needs a `method`");
    let broken = assistant
        .answer("plan", json!({ "domain": DOMAIN.replace(":strips", ":stirps)"), "problem": PROBLEM }));
    assert_eq!(broken["exit"], 2, "{broken}");
    assert!(broken["findings"][0]["labels"][0]["line"].is_u64(), "{broken}");
}

/// A scene is named by its domain, or a file below the server's folder; no other file is opened.
#[test]
fn a_scene_lies_below_the_folder() {
    let mut assistant = Assistant::begin(&[]);
    let elsewhere = tempfile::tempdir().expect("a folder");
    let secret = elsewhere.path().join("secret.toml");
    std::fs::write(&secret, "word = \"sesame\"\n").expect("it is written");
    std::os::unix::fs::symlink(&secret, assistant.folder.path().join("link")).expect("a link");
    let ways = [secret.display().to_string(), "../secret.toml".into(), "link".into(), "./link".into()];
    for scene in &ways {
        for (tool, mut call) in [("goals", json!({})), ("run", json!({ "goal": "find mug" }))] {
            call["scene"] = json!(scene);
            let heard = assistant.call(tool, call);
            let why = heard["error"]["message"].as_str().unwrap_or_default();
            assert!(!heard.to_string().contains("sesame"), "{heard}");
            assert!(why.contains("is not below") || why.contains("expected a path below"), "{heard}");
        }
    }
    let said = assistant.answer("goals", json!({ "scene": "no-cup-a" }));
    assert!(said["phrases"].as_array().is_some_and(|all| !all.is_empty()), "{said}");
    std::fs::write(assistant.folder.path().join("own.toml"), "word = \"sesame\"\n").expect("it is written");
    let own = assistant.answer("goals", json!({ "scene": "own.toml" }));
    assert!(own["error"].as_str().is_some_and(|why| why.contains("own.toml")), "{own}");
}

#[test]
fn a_real_robot_is_for_who_starts_the_server_to_give() {
    let goal = json!({ "goal": "find cup A", "real": true });
    let mut assistant = Assistant::begin(&[]);
    let heard = assistant.call("run", goal.clone());
    assert!(
        heard["error"]["message"].as_str().is_some_and(|text| text.contains("descry mcp --robot")),
        "{heard}"
    );
    let mut assistant = Assistant::begin(&["--robot", "program:exit 3"]);
    let heard = assistant.call("run", goal);
    let said = &heard["result"];
    assert_eq!((&said["isError"], &said["structuredContent"]["exit"]), (&json!(true), &json!(5)), "{heard}");
}

/// Needs a run in simulation, with its evidence.
#[test]
fn a_run_tells_its_steps_and_is_explained() {
    let mut assistant = Assistant::begin(&[]);
    let said = assistant.answer("goals", json!({ "domain": "home" }));
    assert!(said["phrases"].as_array().is_some_and(|all| !all.is_empty()), "{said}");
    let call = json!({ "name": "run", "arguments": { "goal": "find cup A" }, "_meta": { "progressToken": "steps" } });
    let id = assistant.begin_asking("tools/call", call);
    let mut steps = Vec::new();
    let run = loop {
        let heard = assistant.hear();
        if heard["id"] == id {
            break heard["result"]["structuredContent"].clone();
        }
        assert_eq!(heard["params"]["progressToken"], "steps", "{heard}");
        steps.push(heard["params"]["message"].as_str().unwrap_or_default().to_string());
    };
    assert!(
        run["verdict"] == "achieved" && steps.iter().any(|step| step.contains("looking at")),
        "{run}\n{steps:?}"
    );
    let why = assistant.answer("explain", json!({ "run": run["run"] }));
    assert!(why["summary"].as_array().is_some_and(|all| !all.is_empty()), "{why}");
    assert!(assistant.folder.path().join("runs").is_dir());
}

#[test]
fn a_call_is_cancelled_and_the_server_goes_on() {
    let mut assistant = Assistant::begin(&[]);
    let call = json!({ "name": "run", "arguments": { "goal": "identify all objects on the table" },
        "_meta": { "progressToken": 7 } });
    let id = assistant.begin_asking("tools/call", call);
    // It has begun when it says so.
    assert_eq!(assistant.hear()["method"], "notifications/progress");
    assistant.send(
        &json!({ "jsonrpc": "2.0", "method": "notifications/cancelled", "params": { "requestId": id } }),
    );
    assert_eq!(assistant.ask("ping", json!({}))["result"], json!({}));
}
