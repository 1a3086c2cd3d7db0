//! Goals of the service: a queue, and a journal that survives the process.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

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

/// A goal that was given.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Goal {
    /// Number, from 1.
    pub(super) id: u64,
    /// The goal in words.
    pub(super) goal: String,
    /// True if it takes precedence over goals that are not urgent.
    pub(super) urgent: bool,
    pub(super) state: State,
    /// The folder of its run, once it has one.
    pub(super) run: Option<String>,
    /// The process that pursues it.
    pub(super) process: Option<u32>,
    /// Its report, as from `descry do --json`.
    pub(super) report: Option<Value>,
}

impl Goal {
    /// True if the goal is finished.
    pub(super) fn is_over(&self) -> bool {
        matches!(self.state, State::Ended | State::Cancelled)
    }
}

/// All goals; each state is on the disk before anyone is notified of it.
pub(super) struct Goals {
    all: BTreeMap<u64, Goal>,
    journal: File,
}

impl Goals {
    /// Reads the journal in a folder: the last line of a goal is its state; a truncated line is ignored.
    ///
    /// # Errors
    /// The journal cannot be read or written.
    pub(super) fn of(folder: &Path) -> io::Result<Self> {
        let path = folder.join("goals.jsonl");
        let text = match std::fs::read(&path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(e) if e.kind() == io::ErrorKind::NotFound => String::new(),
            Err(e) => return Err(e),
        };
        let lines = text.lines().filter_map(|line| serde_json::from_str::<Goal>(line).ok());
        let all = lines.map(|goal| (goal.id, goal)).collect();
        let mut journal = OpenOptions::new().append(true).create(true).open(path)?;
        if !text.is_empty() && !text.ends_with('\n') {
            journal.write_all(b"\n")?;
        }
        Ok(Self { all, journal })
    }

    /// Adds a goal.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub(super) fn add(&mut self, goal: String, urgent: bool) -> io::Result<Goal> {
        let id = self.all.keys().next_back().map_or(1, |last| last + 1);
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
        self.all.insert(goal.id, goal.clone());
        Ok(goal)
    }

    pub(super) fn get(&self, id: u64) -> Option<&Goal> {
        self.all.get(&id)
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &Goal> {
        self.all.values()
    }

    /// The next goal to pursue: urgent ones first, then interrupted ones, then the oldest.
    pub(super) fn next(&self) -> Option<Goal> {
        let waits = |goal: &&Goal| matches!(goal.state, State::Queued | State::Interrupted);
        let turn = |goal: &&Goal| (!goal.urgent, goal.state != State::Interrupted, goal.id);
        self.all().filter(waits).min_by_key(turn).cloned()
    }
}
