#![doc = include_str!("../README.md")]

pub mod cluster;
pub mod hash;
pub mod journal;
pub mod kinds;
mod live;
mod overrides;
pub mod page;
pub mod plot;
mod runner;
pub mod statistics;
pub mod table;
#[doc(hidden)]
pub mod write;

use descry_agent::stop::Stop;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use journal::{Done, Header, Journal};
pub use kinds::Kind;
pub use live::Batch;
pub use write::Results;

/// Named values, in display order.
pub type Row = Map<String, Value>;

/// One combination of the variables.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Unique in the experiment, the same on every machine, such as `scene=0012 poses=8 policy=plan`.
    pub id: String,
    /// Factors of the experiment, with their values in this job.
    pub factors: Row,
}

impl Job {
    /// A job from its factors, which make up its ID.
    pub fn new<const N: usize>(factors: [(&str, Value); N]) -> Self {
        let shown = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_string);
        let id: Vec<String> =
            factors.iter().map(|(name, value)| format!("{name}={}", shown(value))).collect();
        Self {
            id: id.join(" "),
            factors: factors.into_iter().map(|(name, value)| (name.to_string(), value)).collect(),
        }
    }
}

/// Result of a job: rows of measurements, the same on every machine, and wall-clock times.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// Measurements; usually one row.
    pub rows: Vec<Row>,
    /// Wall-clock times, which differ between runs and are reported separately.
    pub clock: Row,
}

/// A line of the journal: a finished job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finished {
    /// The job's id.
    pub job: String,
    /// Its factors with its measurements.
    pub rows: Vec<Row>,
    /// Wall-clock times.
    #[serde(default)]
    pub clock: Row,
    /// Error, if there are no measurements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl Finished {
    fn new(job: &Job, outcome: Result<Outcome, String>) -> Self {
        let with_factors = |row: Row| job.factors.clone().into_iter().chain(row).collect();
        let (outcome, error) = match outcome {
            Ok(outcome) => (outcome, None),
            Err(error) => (Outcome { rows: vec![Row::new()], clock: Row::new() }, Some(error)),
        };
        let rows = outcome.rows.into_iter().map(with_factors).collect();
        Self { job: job.id.clone(), rows, clock: outcome.clock, error }
    }
}

/// A finished job, with its number among all jobs.
pub type Numbered<'a> = (usize, &'a Finished);

/// An experiment file as it was read.
#[derive(Debug, Clone)]
pub struct Source {
    /// Its path, as given.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

impl Source {
    /// Reads an experiment file.
    ///
    /// # Errors
    /// [`ExperimentError::File`] if it is missing or not a text.
    pub fn read(path: &Path) -> Result<Self, ExperimentError> {
        let text = descry_robots::input::read_text(path).map_err(|e| {
            ExperimentError::file(
                path,
                &format!("{e}\n  expected an experiment: a TOML file, as those in domains/*/experiments"),
            )
        })?;
        Ok(Self { path: path.to_path_buf(), text })
    }

    /// Replaces one value of the file by an assignment `KEY=VALUE`: a path of keys and numbers, and a TOML
    /// value.
    ///
    /// # Errors
    /// [`ExperimentError::Input`] if the file has no such key, or the text is not an assignment.
    pub fn set(&mut self, assignment: &str) -> Result<(), ExperimentError> {
        let refused = |problem: &str, mend: String| {
            ExperimentError::Input(format!("--set {assignment}: {problem}\n  {mend}"))
        };
        let expected = || "expected KEY=VALUE, such as first_seed=7 or set.1.arrangements=10".to_owned();
        let (key, value) = assignment.split_once('=').ok_or_else(|| refused("no value", expected()))?;
        if toml::from_str::<toml::Table>(&format!("value = {value}")).map_or(true, |one| one.len() != 1) {
            return Err(refused("this is no TOML value", expected()));
        }
        match overrides::value_at(&self.text, key.trim()) {
            Ok(span) => self.text.replace_range(span, value.trim()),
            Err(known) => {
                let mend = format!("{} has: {}", self.path.display(), known.join(", "));
                return Err(refused("the file has no such key", mend));
            }
        }
        Ok(())
    }
}

/// A shard: every `of`-th job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Index of the shard, below `of`.
    pub index: usize,
    /// Number of shards.
    pub of: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    /// Parses `I/N`. Counting may start at 0 or at 1, as schedulers do: `0/N` and `N/N` are the same shard.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<usize>().ok();
        match text.split_once('/').and_then(|(i, n)| Some((number(i)?, number(n)?))) {
            Some((i, n)) if n > 0 && i <= n => Ok(Self { index: i % n, of: n }),
            _ => Err("I/N was expected with I from 0 to N-1 (or from 1 to N), such as 3/8".into()),
        }
    }
}

/// Options for carrying out an experiment.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the results.
    pub out: PathBuf,
    /// The shard to run; none: all jobs.
    pub shard: Option<Shard>,
    /// Folders to merge, without running any job.
    pub merge: Vec<PathBuf>,
    /// Number of parallel jobs.
    pub threads: usize,
    /// Free disk space below which a failed job does not count, and no further job starts, bytes.
    pub least_free_bytes: u64,
    /// Ends the batch early.
    pub stop: Stop,
    /// Receives progress messages, occasionally, where there is no terminal for a bar.
    pub tell: fn(&str),
}

/// Progress of the experiment at the end of a call.
#[derive(Debug)]
pub enum Ended {
    /// All jobs are finished; the results are written.
    Whole(Box<Results>),
    /// This shard is finished, others are not.
    Part {
        /// Number of finished jobs, in all shards whose folders are here.
        done: usize,
        /// Number of all jobs.
        all: usize,
        /// The shard's folder.
        folder: PathBuf,
    },
}

/// Error that keeps an experiment from being carried out.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The experiment file cannot be understood or carried out; the text gives the place and a remedy.
    #[error("{0}")]
    Input(String),
    /// A file or folder cannot be read or written.
    #[error("{path}: {because}")]
    File {
        /// Path of the file.
        path: String,
        /// Message of the system.
        because: String,
    },
    /// The folder holds another experiment.
    #[error(
        "{path} belongs to another experiment\n  found: {} with hash {}, {} jobs, version {}\n  expected: {} with hash {}, {} jobs, version {}\n  name another folder with --out, or remove this one",
        found.experiment, found.hash, found.jobs, found.version, expected.experiment, expected.hash, expected.jobs, expected.version
    )]
    Another {
        /// The journal.
        path: String,
        /// First line of the journal.
        found: Box<Header>,
        /// Expected first line.
        expected: Box<Header>,
    },
    /// A file with the name of a journal but another content.
    #[error("{path}: this is no journal of an experiment\n  name another folder with --out")]
    NoJournal {
        /// The file.
        path: String,
    },
    /// Another process is working in the folder.
    #[error(
        "{folder}: another process is at work on this experiment\n  wait for it, or give each its own --shard"
    )]
    Busy {
        /// The folder.
        folder: String,
    },
    /// Two jobs have the same ID.
    #[error("the job \"{id}\" is there twice\n  remove what the file lists twice")]
    Twice {
        /// Their ID.
        id: String,
    },
    /// Shards are missing.
    #[error(
        "{missing} of {all} jobs are in none of the folders, the first of them \"{first}\"\n  do the missing shards, or leave --merge out to do them here"
    )]
    Missing {
        /// Number of missing jobs.
        missing: usize,
        /// Number of all jobs.
        all: usize,
        /// The first of them.
        first: String,
    },
    /// The disk is full; journalled jobs are kept.
    #[error(
        "{folder}: the disk is full, and {job} failed: {because}\n  free some room and run it again: what is done is not done again"
    )]
    NoRoom {
        /// The folder of the results.
        folder: String,
        /// The job that failed and does not count.
        job: String,
        /// Error of the job.
        because: String,
    },
    /// More shards than jobs, or no shards.
    #[error("{jobs} jobs cannot be divided into {shards} shards\n  name from 1 to {jobs} with --shards")]
    Shards {
        /// Requested number of shards.
        shards: usize,
        /// Number of jobs.
        jobs: usize,
    },
    /// The system cannot start a thread.
    #[error("no thread could be started: {because}\n  try a smaller --jobs")]
    Threads {
        /// Message of the system.
        because: String,
    },
}

impl ExperimentError {
    fn file(path: &Path, because: &dyn std::fmt::Display) -> Self {
        Self::File { path: path.display().to_string(), because: because.to_string() }
    }
}

/// Runs the unfinished jobs of an experiment, and writes the results once every job is finished.
///
/// # Errors
/// [`ExperimentError`]. A failed job is a row with its error instead.
pub fn run(source: &Source, options: &Options) -> Result<Ended, ExperimentError> {
    carry_out(&*kinds::read(source)?, source, options)
}

#[doc(hidden)]
pub fn carry_out(kind: &dyn Kind, source: &Source, options: &Options) -> Result<Ended, ExperimentError> {
    let jobs = kind.jobs();
    check_unique(&jobs)?;
    let header = header(source, kind, jobs.len());
    let mut done = gather(&options.out, &options.merge, &header)?;
    if options.merge.is_empty() {
        perform(kind, &jobs, &header, options, &mut done)?;
        if options.shard.is_some() {
            // Whichever shard ends last finds what the others have done meanwhile.
            done.append(&mut gather(&options.out, &[], &header)?);
        }
    }
    let missing: Vec<&Job> = jobs.iter().filter(|job| !done.contains_key(&job.id)).collect();
    match missing.first() {
        Some(_) if options.merge.is_empty() => {
            Ok(Ended::Part { done: jobs.len() - missing.len(), all: jobs.len(), folder: own_folder(options) })
        }
        Some(first) => {
            Err(ExperimentError::Missing { missing: missing.len(), all: jobs.len(), first: first.id.clone() })
        }
        None => {
            let finished: Vec<Finished> = jobs.iter().filter_map(|job| done.remove(&job.id)).collect();
            write::results(kind, source, &header, &finished, &options.out).map(Box::new).map(Ended::Whole)
        }
    }
}

fn check_unique(jobs: &[Job]) -> Result<(), ExperimentError> {
    let mut seen = BTreeSet::new();
    match jobs.iter().find(|job| !seen.insert(&job.id)) {
        Some(job) => Err(ExperimentError::Twice { id: job.id.clone() }),
        None => Ok(()),
    }
}

fn header(source: &Source, kind: &dyn Kind, jobs: usize) -> Header {
    let inputs = kind.inputs();
    let texts = std::iter::once(source.text.as_bytes()).chain(inputs.iter().map(|(_, text)| text.as_bytes()));
    let version = env!("CARGO_PKG_VERSION").to_string();
    Header { experiment: kind.head().name.clone(), hash: hash::fnv1a(texts), version, jobs }
}

/// Folder that this process writes to.
fn own_folder(options: &Options) -> PathBuf {
    match options.shard {
        Some(Shard { index, of }) => options.out.join(format!("shard-{index}-of-{of}")),
        None => options.out.clone(),
    }
}

/// All finished jobs: in the folder, in the folders of its shards, and in the folders to merge.
fn gather(out: &Path, merge: &[PathBuf], header: &Header) -> Result<Done, ExperimentError> {
    let mut folders = vec![out.to_owned()];
    folders.extend(merge.iter().cloned());
    if let Some(absent) = merge.iter().find(|folder| !folder.is_dir()) {
        return Err(ExperimentError::file(absent, &"--merge names folders of shards, and this is none"));
    }
    let mut done = Done::new();
    for folder in folders {
        done.append(&mut journal::done(&folder, header)?);
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let mut inner: Vec<PathBuf> =
            entries.flatten().map(|entry| entry.path()).filter(|p| p.is_dir()).collect();
        inner.sort();
        for shard in inner {
            done.append(&mut journal::done(&shard, header)?);
        }
    }
    Ok(done)
}

/// Runs the unfinished jobs of this process.
fn perform(
    kind: &dyn Kind,
    jobs: &[Job],
    header: &Header,
    options: &Options,
    done: &mut BTreeMap<String, Finished>,
) -> Result<(), ExperimentError> {
    let folder = own_folder(options);
    let (mut journal, mut own, unreadable) = Journal::open(&folder, header)?;
    if unreadable > 0 {
        tracing::warn!(
            "{unreadable} lines of {} cannot be read; their jobs are done again",
            folder.join(journal::FILE).display()
        );
    }
    done.append(&mut own);
    let mine = |number: &usize| options.shard.is_none_or(|shard| number % shard.of == shard.index);
    let todo: Vec<usize> =
        (0..jobs.len()).filter(mine).filter(|&n| !done.contains_key(&jobs[n].id)).collect();
    let scratch = folder.join("scratch");
    let finished = runner::run(
        kind,
        jobs,
        &todo,
        options.threads,
        (&scratch, options.least_free_bytes),
        (&options.stop, options.tell),
        &mut journal,
    )?;
    done.extend(finished.into_iter().map(|job| (job.job.clone(), job)));
    Ok(())
}
