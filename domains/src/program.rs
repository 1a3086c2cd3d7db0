//! Attachment implemented by a program: reads questions and writes answers, one JSON object per
//! line.
//!
//! A question is `{"id": 7, "module": "path-cost", "kind": "cost", "arguments": ["a", "b"], "readings":
//! [...], "level": "exact"}`; its answer is `{"id": 7, "value": 3.2}` or `{"id": 7, "error": "why
//! not"}`. A value is a number (`"inf"` for infinity) for a cost, true or false for a condition, a list
//! of values for an effect, a list of names for a grounding module. Answers may come in any order; the
//! program is started at its first question and gets many questions at once where the planner has them.
//!
//! The program runs in a process group of its own, which is killed as a whole, with at most
//! `MOST_DATA_BYTES` of memory per process (Linux). Of the environment the program sees `SEEN` and
//! `LC_…` and nothing else: no password or token of whoever runs descry. An answer line longer than
//! `MOST_LINE_BYTES` is an error; unread lines wait in the program's pipe.

use std::collections::{BTreeMap, VecDeque};
use std::io::{BufRead, BufReader, Read as _, Write};
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use descry_planner::{Answer, Attachment, Call, CallError, Level, Read};
use rustix::process::{Pid, Signal, kill_process_group};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::config::Program;
use crate::function::Function;

/// Number of last lines of standard error shown when a program ends.
const LAST_WORDS: usize = 5;
/// Maximum length of a kept line of standard error, bytes.
const MOST_WORD_BYTES: u64 = 1 << 10;
/// Maximum length of an answer line, bytes; enough for some ten thousand proposals.
const MOST_LINE_BYTES: u64 = 1 << 20;
/// Number of lines of answer that are read ahead.
const LINES_AHEAD: usize = 16;
/// Maximum memory of a program's process, bytes.
const MOST_DATA_BYTES: u64 = 4 << 30;
/// Grace period for a program to exit after closing its output.
const END_WAIT: Duration = Duration::from_millis(500);
/// Environment variables passed to a program, besides `LC_…`: locations and language.
const SEEN: [&str; 12] = [
    "PATH",
    "HOME",
    "USER",
    "LANG",
    "TZ",
    "TMPDIR",
    "PYTHONPATH",
    "PYTHONHOME",
    "VIRTUAL_ENV",
    "CONDA_PREFIX",
    "LD_LIBRARY_PATH",
    "TERM",
];

/// Tape that records programs' answers and replays those of an earlier session of the run.
pub trait Tape: std::fmt::Debug + Send + Sync {
    /// Gives the answers to `asked`: from the tape, or from the program by `live`, then recorded.
    ///
    /// # Errors
    ///
    /// The reason why there are none.
    fn answer(&self, asked: &Value, live: &dyn Fn() -> Value) -> Result<Value, String>;
}

/// A program that answers calls.
pub struct ProgramAttachment {
    program: Program,
    folder: Option<PathBuf>,
    function: Option<Arc<dyn Function>>,
    tape: Option<Arc<dyn Tape>>,
    running: Mutex<Option<Running>>,
}

/// Process, with the threads that keep its pipes from blocking.
struct Running {
    child: Child,
    questions: Sender<String>,
    answers: Receiver<Result<String, CallError>>,
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
    #[serde(flatten)]
    said: Said,
}

/// Answer of a program to a question.
#[derive(Deserialize)]
struct Said {
    #[serde(default)]
    value: Option<Value>,
    #[serde(default)]
    error: Option<String>,
}

impl ProgramAttachment {
    /// Binds a program to run in `folder` (`None`: the current one); its first question starts it.
    pub fn new(program: Program, folder: Option<PathBuf>) -> Self {
        Self { program, folder, function: None, tape: None, running: Mutex::new(None) }
    }

    /// Records the program's answers on a tape, or replays them from it.
    #[must_use]
    pub fn on(self, tape: Option<Arc<dyn Tape>>) -> Self {
        Self { tape, ..self }
    }

    /// Replaces the program by a function.
    #[must_use]
    pub fn answered_by(self, function: Option<Arc<dyn Function>>) -> Self {
        Self { function, ..self }
    }

    fn ask(&self, calls: &[Call], level: Level) -> Vec<Result<Answer, CallError>> {
        let Some(tape) = &self.tape else { return self.ask_program(calls, level) };
        let asked = json!({ "program": self.program.program, "level": named(level), "calls": calls });
        let live = || self.ask_program(calls, level).iter().map(written).collect();
        let answers = tape.answer(&asked, &live).map_err(CallError::Failed);
        let all = answers.and_then(|answers| read_answers(answers, calls.len()));
        all.unwrap_or_else(|error| calls.iter().map(|_| Err(error.clone())).collect())
    }

    fn ask_program(&self, calls: &[Call], level: Level) -> Vec<Result<Answer, CallError>> {
        if let Some(function) = &self.function {
            return calls.iter().map(|call| ask_function(&**function, call)).collect();
        }
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        let outcome = self.ensure_started(&mut running).and_then(|r| self.exchange(r, calls, level));
        outcome.unwrap_or_else(|error| {
            // A program that is late or has closed its output is of no more use.
            *running = None;
            calls.iter().map(|_| Err(error.clone())).collect()
        })
    }

    /// Asks one question of any kind (JSON object without `id`) and waits for the answer object.
    ///
    /// # Errors
    /// [`CallError`] as for calls; [`CallError::Failed`] with its words if the program answers with an `error`.
    pub fn ask_one(&self, question: Value) -> Result<Value, CallError> {
        let Some(tape) = &self.tape else { return self.ask_program_one(question) };
        let asked = json!({ "program": self.program.program, "question": question });
        let live = || self.ask_program_one(question.clone()).unwrap_or_else(|error| written_error(&error));
        let answer = tape.answer(&asked, &live).map_err(CallError::Failed)?;
        read_error(&answer).map_or(Ok(answer), Err)
    }

    fn ask_program_one(&self, question: Value) -> Result<Value, CallError> {
        if let Some(function) = &self.function {
            let answered = function.answer(&question).map_err(CallError::Failed);
            return answered.map(|value| json!({ "value": value }));
        }
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        let outcome = self.ensure_started(&mut running).and_then(|r| self.exchange_one(r, question));
        let is_over = matches!(
            outcome,
            Err(CallError::TimedOut { .. } | CallError::Crashed(_) | CallError::WrongAnswer { .. })
        );
        if is_over {
            *running = None;
        }
        outcome
    }

    fn exchange_one(&self, running: &mut Running, mut question: Value) -> Result<Value, CallError> {
        let id = running.next_id;
        running.next_id += 1;
        question["id"] = id.into();
        let _ = running.questions.send(format!("{question}\n"));
        let deadline = Instant::now() + self.limit();
        let line = self.line(running, deadline)?;
        let answer: Value =
            serde_json::from_str(&line).map_err(|_| unreadable(&line, "{\"id\": 7, \"value\": ...}"))?;
        if answer["id"] != id {
            return Err(unreadable(&line, "the `id` that was asked"));
        }
        match (&answer["error"], answer.get("value")) {
            (Value::String(error), _) => Err(CallError::Failed(error.clone())),
            (Value::Null, Some(_)) => Ok(answer),
            _ => Err(unreadable(&line, "a `value`, or an `error` that is a text")),
        }
    }

    fn limit(&self) -> Duration {
        Duration::from_secs_f64(self.program.time_limit_s.clamp(0.001, 3600.0))
    }

    /// Next non-empty line.
    fn line(&self, running: &mut Running, deadline: Instant) -> Result<String, CallError> {
        loop {
            match running.answers.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(Ok(line)) if line.is_empty() => {}
                Ok(line) => return line,
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
        let seen = std::env::vars_os().filter(|(name, _)| is_seen(&name.to_string_lossy()));
        let mut command = Command::new(command);
        command.args(arguments).env_clear().envs(seen).process_group(0);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        if let Some(folder) = &self.folder {
            command.current_dir(folder);
        }
        let mut child =
            command.spawn().map_err(|e| CallError::Failed(format!("`{shown}` could not be started: {e}")))?;
        limit_memory(&child);
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (questions, to_write) = channel::<String>();
        let (read, answers) = sync_channel(LINES_AHEAD);
        let last_words = Arc::new(Mutex::new(VecDeque::new()));
        let words = Arc::clone(&last_words);
        let running = Running { child, questions, answers, last_words, next_id: 0 };
        let (Some(stdin), Some(stdout), Some(stderr)) = pipes else {
            return Err(CallError::Failed(format!("`{shown}` was started without pipes")));
        };
        thread::spawn(move || write_questions(stdin, &to_write));
        thread::spawn(move || hear(stdout, &read));
        thread::spawn(move || listen(stderr, &words));
        Ok(running)
    }

    fn exchange(
        &self,
        running: &mut Running,
        calls: &[Call],
        level: Level,
    ) -> Result<Vec<Result<Answer, CallError>>, CallError> {
        let first = running.next_id;
        running.next_id += calls.len() as u64;
        let level = named(level);
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
        let status = running.end().map_or_else(|e| e.to_string(), |s| s.to_string());
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

impl Running {
    /// Waits briefly for the program to exit, then kills its process group.
    fn end(&mut self) -> std::io::Result<ExitStatus> {
        let deadline = Instant::now() + END_WAIT;
        while self.child.try_wait()?.is_none() && Instant::now() < deadline {
            thread::sleep(Duration::from_millis(2));
        }
        self.kill();
        self.child.wait()
    }

    /// Kills the process group; a missing one is no error.
    fn kill(&self) {
        let _ = kill_process_group(Pid::from_child(&self.child), Signal::KILL);
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.kill();
        let _ = self.child.wait();
    }
}

#[doc(hidden)]
pub fn is_seen(variable: &str) -> bool {
    SEEN.contains(&variable) || variable.starts_with("LC_")
}

/// Limits the memory of a program; on platforms without such a limit, only time and line length are limited.
fn limit_memory(child: &Child) {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Resource, Rlimit, prlimit};
        let limit = Rlimit { current: Some(MOST_DATA_BYTES), maximum: Some(MOST_DATA_BYTES) };
        let _ = prlimit(Some(Pid::from_child(child)), Resource::Data, limit);
    }
}

fn write_questions(mut stdin: ChildStdin, questions: &Receiver<String>) {
    for lines in questions {
        if stdin.write_all(lines.as_bytes()).and_then(|()| stdin.flush()).is_err() {
            break;
        }
    }
}

fn hear(stdout: ChildStdout, answers: &SyncSender<Result<String, CallError>>) {
    let mut stdout = BufReader::new(stdout);
    loop {
        let mut line = Vec::new();
        let read = stdout.by_ref().take(MOST_LINE_BYTES + 1).read_until(b'\n', &mut line);
        if !matches!(read, Ok(1..)) {
            break;
        }
        let line = if line.len() as u64 > MOST_LINE_BYTES {
            let start = String::from_utf8_lossy(&line[..120]);
            Err(unreadable(&start, &format!("a line of at most {MOST_LINE_BYTES} bytes")))
        } else {
            Ok(String::from_utf8_lossy(&line).trim_end().to_owned())
        };
        if answers.send(line).is_err() {
            break;
        }
    }
}

/// Keeps the last lines of a program's standard error.
fn listen(stderr: ChildStderr, words: &Mutex<VecDeque<String>>) {
    let mut stderr = BufReader::new(stderr);
    loop {
        let mut line = Vec::new();
        let read = stderr.by_ref().take(MOST_WORD_BYTES).read_until(b'\n', &mut line);
        if !matches!(read, Ok(1..)) {
            break;
        }
        let mut words = words.lock().unwrap_or_else(PoisonError::into_inner);
        if words.len() == LAST_WORDS {
            words.pop_front();
        }
        words.push_back(String::from_utf8_lossy(&line).trim_end().to_owned());
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

fn ask_function(function: &dyn Function, call: &Call) -> Result<Answer, CallError> {
    let question = serde_json::to_value(call).map_err(|e| CallError::Failed(e.to_string()))?;
    let value = function.answer(&question).map_err(CallError::Failed)?;
    let said = value.to_string();
    read_said(Said { value: Some(value), error: None }, &said).and_then(|answer| answer)
}

fn read_reply(line: &str) -> Result<(u64, Result<Answer, CallError>), CallError> {
    let reply: Reply =
        serde_json::from_str(line).map_err(|_| unreadable(line, "{\"id\": 7, \"value\": 3.2}"))?;
    Ok((reply.id, read_said(reply.said, line)?))
}

fn read_said(said: Said, line: &str) -> Result<Result<Answer, CallError>, CallError> {
    match (said.value, said.error) {
        (_, Some(error)) => Ok(Err(CallError::Failed(error))),
        (Some(Value::String(s)), None) if matches!(s.as_str(), "inf" | "infinity" | "Infinity") => {
            Ok(Ok(Answer::Number(f64::INFINITY)))
        }
        (Some(value), None) => {
            let read = serde_json::from_value::<Answer>(value);
            Ok(Ok(read.map_err(|_| unreadable(line, "a number, \"inf\", true, false or a list as `value`"))?))
        }
        (None, None) => Err(unreadable(line, "a `value` or an `error`")),
    }
}

/// Answer in the JSON form that tapes record.
pub fn written(answer: &Result<Answer, CallError>) -> Value {
    match answer {
        Ok(Answer::Number(cost)) if cost.is_infinite() => json!({ "value": "inf" }),
        Ok(answer) => json!({ "value": answer }),
        Err(error) => written_error(error),
    }
}

fn written_error(error: &CallError) -> Value {
    match error {
        CallError::TimedOut { limit_s } => json!({ "timed_out_s": limit_s }),
        CallError::Crashed(words) => json!({ "crashed": words }),
        CallError::WrongAnswer { expected, got } => json!({ "expected": expected, "got": got }),
        other => json!({ "error": other.to_string() }),
    }
}

/// Error of an answer in the form of [`written`], if any.
fn read_error(answer: &Value) -> Option<CallError> {
    let text = |key: &str| answer[key].as_str().map(str::to_owned);
    let timed_out = || answer["timed_out_s"].as_f64().map(|limit_s| CallError::TimedOut { limit_s });
    let wrong = || Some(CallError::WrongAnswer { expected: text("expected")?, got: text("got")? });
    let other = || text("crashed").map(CallError::Crashed).or_else(|| text("error").map(CallError::Failed));
    timed_out().or_else(wrong).or_else(other)
}

/// Reads exactly `most` answers in the form of [`written`].
fn read_answers(answers: Value, most: usize) -> Result<Vec<Result<Answer, CallError>>, CallError> {
    let line = answers.to_string();
    let said: Vec<Value> =
        serde_json::from_value(answers).map_err(|_| unreadable(&line, "the answers of a program"))?;
    if said.len() != most {
        return Err(unreadable(&line, &format!("{most} answers")));
    }
    let read = |answer: Value| match read_error(&answer) {
        Some(error) => Ok(Err(error)),
        None => {
            let said = serde_json::from_value(answer).map_err(|_| unreadable(&line, "an answer"))?;
            read_said(said, &line)
        }
    };
    said.into_iter().map(read).collect()
}

fn named(level: Level) -> &'static str {
    if level == Level::Exact { "exact" } else { "relaxed" }
}

fn unreadable(line: &str, expected: &str) -> CallError {
    let shown: String = line.chars().take(120).collect();
    CallError::WrongAnswer { expected: expected.into(), got: format!("`{shown}`") }
}
