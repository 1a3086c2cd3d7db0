//! A call: a command of descry in a process of its own.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

use super::Served;
use super::tools::Task;
use descry_agent::exit::Exit;

/// Time that a command has to halt the body and keep its record when it is stopped.
const HALT: Duration = Duration::from_secs(20);
/// Between looks whether a stopped command has ended.
const POLL: Duration = Duration::from_millis(20);
/// Bytes of narration that an answer about a failure has at most: its end.
const TOLD_BYTES: usize = 4000;

/// A call while it is carried out.
#[derive(Default)]
pub(super) struct Call(Mutex<State>);

#[derive(Default)]
struct State {
    /// The process that carries it out.
    process: Option<Pid>,
    is_cancelled: bool,
    has_ended: bool,
}

/// What a command has come to.
struct Ended {
    exit: i32,
    out: String,
    told: String,
}

impl Call {
    pub(super) fn has_ended(&self) -> bool {
        self.state(|state| state.has_ended)
    }

    /// Stops it as a person would.
    pub(super) fn cancel(&self) {
        self.state(|state| {
            state.is_cancelled = true;
            // It may end at this very moment.
            state.process.map(|process| kill_process(process, Signal::INT).ok())
        });
    }

    fn state<T>(&self, of: impl FnOnce(&mut State) -> T) -> T {
        of(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The result of a tool, as the protocol has it; none for a call that was cancelled.
    pub(super) fn carry_out(
        &self,
        task: &Task,
        served: &Served,
        tell: &mut dyn FnMut(&str),
    ) -> Option<Value> {
        let result = self.answered(task, served, tell).unwrap_or_else(|because| failed(&because, json!({})));
        self.state(|state| {
            state.has_ended = true;
            state.process = None;
            (!state.is_cancelled).then_some(result)
        })
    }

    fn answered(&self, task: &Task, served: &Served, tell: &mut dyn FnMut(&str)) -> Result<Value, String> {
        let folder = tempfile::tempdir().map_err(|e| format!("no folder for the texts: {e}"))?;
        for (name, text) in &task.files {
            std::fs::write(folder.path().join(name), text).map_err(|e| format!("{name}: {e}"))?;
        }
        // Texts are named as the caller calls them; all else is where runs are.
        let at = if task.files.is_empty() { served.folder.as_path() } else { folder.path() };
        let ended = self.command(&task.words, &task.input, at, tell)?;
        let mut said = match serde_json::from_str::<Value>(&ended.out) {
            Ok(Value::Object(said)) => Value::Object(said),
            _ if ended.out.is_empty() => json!({}),
            _ => json!({ "text": ended.out }),
        };
        said["exit"] = json!(ended.exit);
        if is_failure(ended.exit) {
            if let Some(check) = &task.check {
                let found = self.command(check, "", at, &mut |_| {})?;
                said["findings"] =
                    serde_json::from_str::<Value>(&found.out).unwrap_or_default()["findings"].take();
            }
            return Ok(failed(&ended.told, said));
        }
        let text = said.to_string();
        Ok(
            json!({ "content": [{ "type": "text", "text": text }], "structuredContent": said, "isError": false }),
        )
    }

    fn command(
        &self,
        words: &[String],
        input: &str,
        at: &Path,
        tell: &mut dyn FnMut(&str),
    ) -> Result<Ended, String> {
        let own = std::env::current_exe().map_err(|e| format!("the program of descry is gone: {e}"))?;
        let mut command = Command::new(own);
        command.args(words).current_dir(at);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|e| format!("descry does not start: {e}"))?;
        let process = Pid::from_child(&child);
        let is_cancelled = self.state(|state| {
            state.process = Some(process);
            state.is_cancelled
        });
        if is_cancelled {
            self.cancel();
        }
        let (stdin, stdout, stderr) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let mut told = String::new();
        let out = std::thread::scope(|scope| {
            scope.spawn(|| {
                // One that reads nothing has ended.
                stdin.map(|mut stdin| stdin.write_all(input.as_bytes()).ok())
            });
            let out = scope.spawn(|| {
                let mut out = Vec::new();
                stdout.map(|mut stdout| stdout.read_to_end(&mut out));
                String::from_utf8_lossy(&out).into_owned()
            });
            for line in stderr.into_iter().flat_map(|stderr| BufReader::new(stderr).split(b'\n')) {
                let Ok(line) = line else { break };
                let line = String::from_utf8_lossy(&line);
                told += &format!("{line}\n");
                if !line.trim().is_empty() {
                    tell(line.trim_end());
                }
            }
            out.join().unwrap_or_default()
        });
        let exit = self.wait(&mut child)?;
        Ok(Ended { exit, out, told })
    }

    /// The exit code of a command whose output has ended; one that was stopped and stays is killed.
    fn wait(&self, child: &mut Child) -> Result<i32, String> {
        let mut stopped: Option<Instant> = None;
        loop {
            if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
                return Ok(status.code().unwrap_or(Exit::Bug as i32));
            }
            if self.state(|state| state.is_cancelled)
                && stopped.get_or_insert_with(Instant::now).elapsed() > HALT
            {
                child.kill().map_err(|e| e.to_string())?;
            }
            std::thread::sleep(POLL);
        }
    }
}

/// Whether a command could not do what it was asked for; an honest no is an answer.
fn is_failure(exit: i32) -> bool {
    let answers = [Exit::Done, Exit::No, Exit::Unsolvable, Exit::OutOfTime];
    answers.iter().all(|answer| *answer as i32 != exit)
}

fn failed(told: &str, mut said: Value) -> Value {
    let from = told.len().saturating_sub(TOLD_BYTES);
    let from = (from..=told.len()).find(|at| told.is_char_boundary(*at)).unwrap_or_default();
    said["error"] = json!(told[from..].trim());
    let text = said.to_string();
    json!({ "content": [{ "type": "text", "text": text }], "structuredContent": said, "isError": true })
}
