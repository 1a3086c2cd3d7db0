//! Tests of `program`.

use descry_domains::config::Program;
use descry_domains::function::Function;
use descry_domains::program::*;
use descry_planner::CallKind;
use descry_planner::{Answer, Attachment, Call, CallError};
use serde_json::{Value, json};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// Checks the answers of a shell program to two calls at once.
fn check(script: &str, expected: &str) {
    let program =
        Program { program: vec!["sh".into(), "-c".into(), script.into()], time_limit_s: 0.5, reads: vec![] };
    let attachment = ProgramAttachment::new(program, None);
    let call = |name: &str| Call {
        module: "m".into(),
        kind: CallKind::Cost,
        arguments: vec![name.into()],
        readings: vec![],
    };
    let answers = attachment.evaluate_all(&[call("a"), call("b")]);
    let shown: Vec<String> = answers
        .iter()
        .map(|a| a.as_ref().map_or_else(ToString::to_string, |answer| format!("{answer:?}")))
        .collect();
    assert_eq!(shown.join(" | "), expected);
}

#[test]
fn answers_come_back_to_their_questions() {
    check(
        r#"read a; read b; echo '{"id":1,"value":"inf"}'; echo '{"id":0,"value":2.5}'"#,
        "Number(2.5) | Number(inf)",
    );
    check(
        r#"read a; read b; echo '{"id":0,"error":"no map"}'; echo '{"id":1,"value":true}'"#,
        "no map | Truth(true)",
    );
}

/// Hears what a program hears, and says the name that it is asked about, or that it is tired.
#[derive(Debug)]
struct Echo;

impl Function for Echo {
    fn answer(&self, question: &Value) -> Result<Value, String> {
        match question["arguments"][0].as_str() {
            Some("a") => Ok(json!(2.5)),
            Some(_) => Err("tired".into()),
            None => Ok(question.clone()),
        }
    }
}

#[test]
fn a_function_answers_in_the_place_of_a_program() {
    let program = Program { program: vec!["function".into()], time_limit_s: 0.5, reads: vec![] };
    let attachment = ProgramAttachment::new(program, None).answered_by(Some(Arc::new(Echo)));
    let call = |name: &str| Call {
        module: "m".into(),
        kind: CallKind::Cost,
        arguments: vec![name.into()],
        readings: vec![],
    };
    let answers = attachment.evaluate_all(&[call("a"), call("b")]);
    assert_eq!(answers, [Ok(Answer::Number(2.5)), Err(CallError::Failed("tired".into()))]);
    let asked = json!({ "fact": "raining", "objects": [] });
    assert_eq!(attachment.ask_one(asked.clone()), Ok(json!({ "value": asked })));
}

#[test]
fn a_program_that_fails_is_a_clean_error() {
    let crashed = "the attachment's program ended: `sh -c read a; echo broken pipe dream >&2; exit 3`, exit status: 3\n    broken pipe dream";
    check("read a; echo broken pipe dream >&2; exit 3", &format!("{crashed} | {crashed}"));
    let late = "no answer within 0.5 s";
    check("sleep 5", &format!("{late} | {late}"));
    let closed = "the attachment's program ended: `sh -c exec >&-; sleep 5`, signal: 9 (SIGKILL)";
    check("exec >&-; sleep 5", &format!("{closed} | {closed}"));
    let garbled = "answered `hello`, expected {\"id\": 7, \"value\": 3.2}";
    check("read a; echo hello; sleep 1", &format!("{garbled} | {garbled}"));
}

/// A program that floods is stopped at the first line that is too long, or none of whose lines is an answer.
#[test]
fn a_flood_is_an_error_and_waits_in_the_pipe() {
    let start = "x".repeat(120);
    let long = format!("answered `{start}`, expected a line of at most 1048576 bytes");
    check("read a; yes x | tr -d '\\n'", &format!("{long} | {long}"));
    let lines = "answered `y`, expected {\"id\": 7, \"value\": 3.2}";
    check("yes", &format!("{lines} | {lines}"));
    check("yes ''", "no answer within 0.5 s | no answer within 0.5 s");
}

/// Processes started by a program end with it, and it gets no secret from the environment.
#[test]
fn a_program_leaves_nothing_behind_and_sees_no_secret() {
    let folder = std::env::temp_dir().join(format!("descry-program-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    let beat = folder.join("beat");
    let shown = beat.display();
    let late = "no answer within 0.5 s";
    check(
        &format!("(while :; do echo x >> {shown}; sleep 0.02; done) & sleep 60"),
        &format!("{late} | {late}"),
    );
    let length = || std::fs::metadata(&beat).map_or(0, |m| m.len());
    let then = length();
    assert!(then > 0, "the child had begun");
    thread::sleep(Duration::from_millis(200));
    assert_eq!(length(), then, "the child has ended");
    // Cargo's own variables stand for any that is not on the list.
    assert!(std::env::var_os("CARGO_MANIFEST_DIR").is_some() && is_seen("PATH") && is_seen("LC_ALL"));
    let env = "read a; read b; env | cut -d= -f1 | grep -c CARGO_ >&2; exit 1";
    let ended = format!("the attachment's program ended: `sh -c {env}`, exit status: 1\n    0");
    check(env, &format!("{ended} | {ended}"));
    std::fs::remove_dir_all(&folder).expect("the folder can be removed");
}
