//! An attachment that is a program: it reads questions and writes answers, one JSON object a line.
//!
//! A question is `{"id": 7, "module": "path-cost", "kind": "cost", "arguments": ["a", "b"], "readings": [...],
//! "level": "exact"}`; its answer is `{"id": 7, "value": 3.2}` or `{"id": 7, "error": "why not"}`. A value is a number
//! (`"inf"` for infinity) for a cost, true or false for a condition, a list of values for an effect, a list of names for
//! a grounding module. Answers may come in any order; the program is started at its first question and gets many
//! questions at once where the planner has them.

use std::collections::{BTreeMap, VecDeque};
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use descry_planner::{Answer, Attachment, Call, CallError, Level, Read};
use serde::{Deserialize, Serialize};

use crate::config::Program;

/// How many of its last words on standard error are shown when a program ends.
const LAST_WORDS: usize = 5;

/// A program that answers calls.
pub struct ProgramAttachment {
    program: Program,
    folder: Option<PathBuf>,
    running: Mutex<Option<Running>>,
}

/// The process and the threads that keep its pipes from blocking either side.
struct Running {
    child: Child,
    questions: Sender<String>,
    answers: Receiver<String>,
    last_words: Arc<Mutex<VecDeque<String>>>,
    next_id: u64,
}

#[derive(Serialize)]
struct Question<'a> {
    id: u64,
    level: &'static str,
    #[serde(flatten)]
    call: &'a Call,
}

#[derive(Deserialize)]
struct Reply {
    id: u64,
    #[serde(default)]
    value: Option<serde_json::Value>,
    #[serde(default)]
    error: Option<String>,
}

impl ProgramAttachment {
    /// Binds a program that is run in `folder` (none: the current one). It is started by its first question.
    pub fn new(program: Program, folder: Option<PathBuf>) -> Self {
        Self { program, folder, running: Mutex::new(None) }
    }

    fn ask(&self, calls: &[Call], level: Level) -> Vec<Result<Answer, CallError>> {
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        let outcome = self.ensure_started(&mut running).and_then(|r| self.exchange(r, calls, level));
        match outcome {
            Ok(answers) => answers,
            Err(error) => {
                if let Some(mut ended) = running.take() {
                    // A program that is late or has closed its output is of no more use; it is stopped either way.
                    let _ = ended.child.kill();
                    let _ = ended.child.wait();
                }
                calls.iter().map(|_| Err(error.clone())).collect()
            }
        }
    }

    /// Asks one question of any kind, a JSON object without `id`, and waits for the answer: the object that comes back.
    ///
    /// # Errors
    /// [`CallError`] as for calls; [`CallError::Failed`] with its words if the program answers with an `error`.
    pub fn ask_one(&self, question: serde_json::Value) -> Result<serde_json::Value, CallError> {
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        let outcome = self.ensure_started(&mut running).and_then(|r| self.exchange_one(r, question));
        let is_over = matches!(
            outcome,
            Err(CallError::TimedOut { .. } | CallError::Crashed(_) | CallError::WrongAnswer { .. })
        );
        if is_over && let Some(mut ended) = running.take() {
            let _ = ended.child.kill();
            let _ = ended.child.wait();
        }
        outcome
    }

    fn exchange_one(
        &self,
        running: &mut Running,
        mut question: serde_json::Value,
    ) -> Result<serde_json::Value, CallError> {
        let id = running.next_id;
        running.next_id += 1;
        question["id"] = id.into();
        let _ = running.questions.send(format!("{question}\n"));
        let deadline = Instant::now() + self.limit();
        let line = self.line(running, deadline)?;
        let answer: serde_json::Value =
            serde_json::from_str(&line).map_err(|_| unreadable(&line, "{\"id\": 7, \"value\": ...}"))?;
        if answer["id"] != id {
            return Err(unreadable(&line, "the `id` that was asked"));
        }
        match answer["error"].as_str() {
            Some(error) => Err(CallError::Failed(error.to_string())),
            None => Ok(answer),
        }
    }

    fn limit(&self) -> Duration {
        Duration::from_secs_f64(self.program.time_limit_s.clamp(0.001, 3600.0))
    }

    /// The next line that says anything.
    fn line(&self, running: &mut Running, deadline: Instant) -> Result<String, CallError> {
        loop {
            match running.answers.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(line) if line.trim().is_empty() => {}
                Ok(line) => return Ok(line),
                Err(RecvTimeoutError::Timeout) => {
                    return Err(CallError::TimedOut { limit_s: self.program.time_limit_s });
                }
                Err(RecvTimeoutError::Disconnected) => return Err(self.ended(running)),
            }
        }
    }

    fn ensure_started<'a>(&self, running: &'a mut Option<Running>) -> Result<&'a mut Running, CallError> {
        if running.is_none() {
            *running = Some(self.start()?);
        }
        running.as_mut().ok_or_else(|| CallError::Failed("the program did not start".into()))
    }

    fn start(&self) -> Result<Running, CallError> {
        let shown = self.program.program.join(" ");
        let Some((command, arguments)) = self.program.program.split_first() else {
            return Err(CallError::Failed(
                "its `program` is empty; expected a command and its arguments".into(),
            ));
        };
        let mut command = Command::new(command);
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        if let Some(folder) = &self.folder {
            command.current_dir(folder);
        }
        let mut child =
            command.spawn().map_err(|e| CallError::Failed(format!("`{shown}` could not be started: {e}")))?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(mut stdin), Some(stdout), Some(stderr)) = pipes else {
            return Err(CallError::Failed(format!("`{shown}` was started without pipes")));
        };
        let (questions, to_write) = channel::<String>();
        thread::spawn(move || {
            for lines in to_write {
                if stdin.write_all(lines.as_bytes()).and_then(|()| stdin.flush()).is_err() {
                    break;
                }
            }
        });
        let (read, answers) = channel::<String>();
        thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                if read.send(line).is_err() {
                    break;
                }
            }
        });
        let last_words = Arc::new(Mutex::new(VecDeque::new()));
        let words = Arc::clone(&last_words);
        thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                let mut words = words.lock().unwrap_or_else(PoisonError::into_inner);
                if words.len() == LAST_WORDS {
                    words.pop_front();
                }
                words.push_back(line);
            }
        });
        Ok(Running { child, questions, answers, last_words, next_id: 0 })
    }

    fn exchange(
        &self,
        running: &mut Running,
        calls: &[Call],
        level: Level,
    ) -> Result<Vec<Result<Answer, CallError>>, CallError> {
        let first = running.next_id;
        running.next_id += calls.len() as u64;
        let level = if level == Level::Exact { "exact" } else { "relaxed" };
        let mut lines = String::new();
        for (id, call) in (first..).zip(calls) {
            let question = serde_json::to_string(&Question { id, level, call });
            lines.push_str(&question.map_err(|e| CallError::Failed(e.to_string()))?);
            lines.push('\n');
        }
        // A failed send means that the writer has ended with the program; reading then says how.
        let _ = running.questions.send(lines);
        let mut replies: BTreeMap<u64, Result<Answer, CallError>> = BTreeMap::new();
        let mut deadline = Instant::now() + self.limit();
        while replies.len() < calls.len() {
            let line = self.line(running, deadline)?;
            let (id, answer) = read_reply(&line)?;
            if !(first..running.next_id).contains(&id) {
                return Err(unreadable(&line, "an `id` that was asked"));
            }
            replies.insert(id, answer);
            deadline = Instant::now() + self.limit();
        }
        Ok(replies.into_values().collect())
    }

    fn ended(&self, running: &mut Running) -> CallError {
        let status = running.child.wait().map_or_else(|e| e.to_string(), |s| s.to_string());
        // The thread that reads standard error ends with the program; give it the moment that it needs.
        for _ in 0..50 {
            if Arc::strong_count(&running.last_words) == 1 {
                break;
            }
            thread::sleep(Duration::from_millis(2));
        }
        let words = running.last_words.lock().unwrap_or_else(PoisonError::into_inner);
        let words: Vec<String> = words.iter().map(|w| format!("\n    {w}")).collect();
        CallError::Crashed(format!("`{}`, {status}{}", self.program.program.join(" "), words.concat()))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Attachment for ProgramAttachment {
    fn reads(&self) -> Vec<Read> {
        self.program.reads.iter().map(|symbol| Read::All(symbol.to_lowercase())).collect()
    }

    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        let mut answers = self.ask(std::slice::from_ref(call), Level::Exact);
        answers.pop().unwrap_or_else(|| Err(CallError::Failed("no answer".into())))
    }

    fn evaluate_all(&self, calls: &[Call]) -> Vec<Result<Answer, CallError>> {
        self.ask(calls, Level::Exact)
    }
}

fn read_reply(line: &str) -> Result<(u64, Result<Answer, CallError>), CallError> {
    let reply: Reply =
        serde_json::from_str(line).map_err(|_| unreadable(line, "{\"id\": 7, \"value\": 3.2}"))?;
    let answer = match (reply.value, reply.error) {
        (_, Some(error)) => Err(CallError::Failed(error)),
        (Some(serde_json::Value::String(s)), None)
            if matches!(s.as_str(), "inf" | "infinity" | "Infinity") =>
        {
            Ok(Answer::Number(f64::INFINITY))
        }
        (Some(value), None) => {
            let read = serde_json::from_value::<Answer>(value);
            Ok(read.map_err(|_| unreadable(line, "a number, \"inf\", true, false or a list as `value`"))?)
        }
        (None, None) => return Err(unreadable(line, "a `value` or an `error`")),
    };
    Ok((reply.id, answer))
}

fn unreadable(line: &str, expected: &str) -> CallError {
    let shown: String = line.chars().take(120).collect();
    CallError::WrongAnswer { expected: expected.into(), got: format!("`{shown}`") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use descry_planner::CallKind;

    /// What a program written in the shell answers to two calls at once.
    fn check(script: &str, expected: &str) {
        let program = Program {
            program: vec!["sh".into(), "-c".into(), script.into()],
            time_limit_s: 0.5,
            reads: vec![],
        };
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

    #[test]
    fn a_program_that_fails_is_a_clean_error() {
        let crashed = "the attachment's program ended: `sh -c read a; echo broken pipe dream >&2; exit 3`, exit status: 3\n    broken pipe dream";
        check("read a; echo broken pipe dream >&2; exit 3", &format!("{crashed} | {crashed}"));
        let late = "no answer within 0.5 s";
        check("sleep 5", &format!("{late} | {late}"));
        let garbled = "answered `hello`, expected {\"id\": 7, \"value\": 3.2}";
        check("read a; echo hello; sleep 1", &format!("{garbled} | {garbled}"));
    }
}
