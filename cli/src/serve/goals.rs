//! Goals of the service: a queue, and a journal that survives the process.
//!
//! The journal has a line for each state of a goal. A damaged last line may be the unfinished write of a
//! killed server: it is named and passed over, and its bytes stay. Any other damaged line is an error, since
//! it was acknowledged.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::Path;

use descry_agent::exit::CommandError;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// State of a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum State {
    /// Waiting for its turn.
    Queued,
    /// Being pursued.
    Running,
    /// Interrupted by a more urgent goal or the end of the server; will be resumed.
    Interrupted,
    /// Finished with a verdict.
    Ended,
    /// Cancelled by a caller.
    Cancelled,
}

/// Goal given to the service, with its state.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Goal {
    /// Number of the goal, from 1.
    pub(super) id: u64,
    /// Goal in words.
    pub(super) goal: String,
    /// True if the goal takes precedence over goals that are not urgent.
    pub(super) urgent: bool,
    pub(super) state: State,
    /// Folder of the goal's run; `None` before the first start.
    pub(super) run: Option<String>,
    /// ID of the process that pursues the goal, while it runs.
    pub(super) process: Option<u32>,
    /// Report, as from `descry do --json`; `None` before the end.
    pub(super) report: Option<Value>,
}

impl Goal {
    /// True if the goal is finished.
    pub(super) fn is_over(&self) -> bool {
        matches!(self.state, State::Ended | State::Cancelled)
    }
}

/// All goals; each state is on the disk before anyone is notified of it.
pub(crate) struct Goals {
    all: BTreeMap<u64, Goal>,
    /// Number of the next goal.
    next_id: u64,
    journal: File,
    /// Lock of the folder, held as long as the goals are in use.
    _lock: File,
}

/// File name of the journal.
const JOURNAL: &str = "goals.jsonl";
/// File name of the lock; the file names its holder.
const LOCK: &str = "serve.lock";

/// Line of the journal.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Line {
    Goal(Goal),
    /// Damaged lines before this one, which are passed over.
    Passed {
        /// Numbers of the lines, from 1.
        passed_over: Vec<usize>,
    },
}

/// Content of a journal.
#[derive(Default)]
struct Read {
    all: BTreeMap<u64, Goal>,
    next_id: u64,
    /// Damaged lines at the end, by number from 1.
    damaged: Vec<usize>,
}

impl Read {
    /// Reads the lines of a journal: the last line of a goal is its state.
    ///
    /// # Errors
    /// The number, from 1, of a damaged line that a goal follows.
    fn of(bytes: &[u8]) -> Result<Self, usize> {
        let mut read = Read { next_id: 1, ..Read::default() };
        for (n, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
            match serde_json::from_slice::<Line>(line) {
                _ if line.is_empty() => (),
                Ok(Line::Passed { .. }) => read.damaged.clear(),
                Ok(Line::Goal(goal)) => match read.damaged.first() {
                    Some(damaged) => return Err(*damaged),
                    None => {
                        read.next_id = read.next_id.max(goal.id + 1);
                        read.all.insert(goal.id, goal);
                    }
                },
                Err(_) => {
                    read.damaged.push(n + 1);
                    // It may hold a goal whose number somebody knows.
                    read.next_id += 1;
                }
            }
        }
        Ok(read)
    }
}

/// Acquires the lock of a folder for this process.
fn locked(folder: &Path) -> Result<File, CommandError> {
    let path = folder.join(LOCK);
    let refused = |e: io::Error| CommandError::bad_input(format!("{}: {e}", path.display()));
    let lock = OpenOptions::new().create(true).truncate(false).write(true).open(&path).map_err(refused)?;
    match lock.try_lock() {
        Ok(()) => (),
        Err(TryLockError::WouldBlock) => {
            let holder = std::fs::read_to_string(&path).unwrap_or_default();
            return Err(CommandError::bad_input(format!(
                "{}: another server pursues the goals there ({})\n  stop it, or name another folder with --folder",
                folder.display(),
                holder.trim(),
            )));
        }
        Err(TryLockError::Error(e)) => return Err(refused(e)),
    }
    let named = lock.set_len(0).and_then(|()| writeln!(&lock, "process {}", std::process::id()));
    named.map_err(refused)?;
    Ok(lock)
}

impl Goals {
    /// Claims a folder for this process, and reads its journal.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] if another server has the folder or the folder cannot be written;
    /// [`CommandError::Broken`] if the journal is damaged or cannot be read.
    pub(crate) fn of(folder: &Path) -> Result<Self, CommandError> {
        let lock = locked(folder)?;
        let path = folder.join(JOURNAL);
        let broken = |e: io::Error| CommandError::broken(format!("{}: {e}", path.display()));
        let bytes = match std::fs::read(&path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => Vec::new(),
            read => read.map_err(broken)?,
        };
        let Read { all, next_id, damaged } = Read::of(&bytes).map_err(|line| {
            let path = path.display();
            CommandError::broken(format!(
                "{path}, line {line}: is damaged, and other goals were given after it\n  \
                 put the line back from a copy, or remove it: sed -i {line}d {path}"
            ))
        })?;
        let mut journal = OpenOptions::new().append(true).create(true).open(&path).map_err(broken)?;
        let mut end = String::new();
        if bytes.last().is_some_and(|last| *last != b'\n') {
            end.push('\n');
        }
        if !damaged.is_empty() {
            for line in &damaged {
                tracing::warn!(
                    "{}, line {line}: is damaged and passed over; if a goal is missing now, give it again",
                    path.display()
                );
            }
            end += &format!("{}\n", json!(Line::Passed { passed_over: damaged }));
        }
        journal.write_all(end.as_bytes()).and_then(|()| journal.sync_data()).map_err(broken)?;
        Ok(Self { all, next_id, journal, _lock: lock })
    }

    /// Adds a goal.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub(super) fn add(&mut self, goal: String, urgent: bool) -> io::Result<Goal> {
        let id = self.next_id;
        let (run, process, report) = Default::default();
        self.keep(Goal { id, goal, urgent, state: State::Queued, run, process, report })
    }

    /// Stores the state of a goal.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub(super) fn keep(&mut self, goal: Goal) -> io::Result<Goal> {
        let line = format!("{}\n", serde_json::to_string(&goal)?);
        self.journal.write_all(line.as_bytes())?;
        self.journal.sync_data()?;
        self.next_id = self.next_id.max(goal.id + 1);
        self.all.insert(goal.id, goal.clone());
        Ok(goal)
    }

    pub(super) fn get(&self, id: u64) -> Option<&Goal> {
        self.all.get(&id)
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &Goal> {
        self.all.values()
    }

    /// Next goal to pursue: urgent ones first, then interrupted ones, then the oldest.
    pub(super) fn next(&self) -> Option<Goal> {
        let waits = |goal: &&Goal| matches!(goal.state, State::Queued | State::Interrupted);
        let turn = |goal: &&Goal| (!goal.urgent, goal.state != State::Interrupted, goal.id);
        self.all().filter(waits).min_by_key(turn).cloned()
    }
}
