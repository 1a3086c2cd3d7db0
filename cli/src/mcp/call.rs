//! Tool call: a descry command in a process of its own.

use serde_json::{Value, json};

use super::Served;
use super::tools::Task;
use crate::child::Child;
use descry_agent::exit::Exit;

/// Maximum size of the narration in the answer on a failure, bytes; its end is kept.
const TOLD_BYTES: usize = 4000;

/// Runs a tool and returns its result in the protocol's form; `None` for a cancelled call.
pub(super) fn carry_out(
    child: &Child,
    task: &Task,
    served: &Served,
    tell: &mut dyn FnMut(&str),
) -> Option<Value> {
    let result = answered(child, task, served, tell).unwrap_or_else(|because| failed(&because, json!({})));
    (!child.end()).then_some(result)
}

fn answered(
    child: &Child,
    task: &Task,
    served: &Served,
    tell: &mut dyn FnMut(&str),
) -> Result<Value, String> {
    let folder = tempfile::tempdir().map_err(|e| format!("no folder for the texts: {e}"))?;
    for (name, text) in &task.files {
        std::fs::write(folder.path().join(name), text).map_err(|e| format!("{name}: {e}"))?;
    }
    // Texts are named as the caller calls them; all else is where runs are.
    let at = if task.files.is_empty() { served.folder.as_path() } else { folder.path() };
    let ended = child.carry_out(&task.words, &task.input, at, |_| {}, tell)?;
    let mut said = match serde_json::from_str::<Value>(&ended.out) {
        Ok(Value::Object(said)) => Value::Object(said),
        _ if ended.out.is_empty() => json!({}),
        _ => json!({ "text": ended.out }),
    };
    said["exit"] = json!(ended.exit);
    if is_failure(ended.exit) {
        if let Some(check) = &task.check {
            let found = child.carry_out(check, "", at, |_| {}, &mut |_| {})?;
            said["findings"] =
                serde_json::from_str::<Value>(&found.out).unwrap_or_default()["findings"].take();
        }
        return Ok(failed(&ended.told, said));
    }
    let text = said.to_string();
    Ok(json!({ "content": [{ "type": "text", "text": text }], "structuredContent": said, "isError": false }))
}

/// True if a command failed; a truthful no is an answer, not a failure.
fn is_failure(exit: i32) -> bool {
    let answers = [Exit::Done, Exit::No, Exit::Unsolvable, Exit::OutOfTime];
    answers.iter().all(|answer| *answer as i32 != exit)
}

fn failed(told: &str, mut said: Value) -> Value {
    let from = told.len().saturating_sub(TOLD_BYTES);
    let from = (from..=told.len()).find(|at| told.is_char_boundary(*at)).unwrap_or_default();
    // A run says itself why it failed.
    if said.get("why").is_none() {
        said["error"] = json!(told[from..].trim());
    }
    let text = said.to_string();
    json!({ "content": [{ "type": "text", "text": text }], "structuredContent": said, "isError": true })
}
