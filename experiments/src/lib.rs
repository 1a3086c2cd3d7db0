#![doc = include_str!("../README.md")]

pub mod cluster;
pub mod error;
pub mod hash;
pub mod header;
pub mod job;
pub mod journal;
pub mod kinds;
mod live;
mod overrides;
pub mod page;
pub mod plot;
mod runner;
pub mod source;
pub mod statistics;
pub mod table;
#[doc(hidden)]
pub mod write;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use descry_agent::stop::Stop;
pub use error::ExperimentError;
use header::Header;
pub use job::{Finished, Job, Numbered, Outcome, Row};
use journal::{Done, Journal};
pub use kinds::kind::Kind;
pub use live::Batch;
pub use source::Source;
pub use write::Results;

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
    /// Shard to run; `None`: all jobs.
    pub shard: Option<Shard>,
    /// Folders to merge, without running any job.
    pub merge: Vec<PathBuf>,
    /// Number of parallel jobs.
    pub threads: usize,
    /// Free disk space below which a failed job does not count, and no further job starts, bytes.
    pub least_free_bytes: u64,
    /// Request to end the batch early.
    pub stop: Stop,
    /// Function that receives progress messages, occasionally, where there is no terminal for a bar.
    pub tell: fn(&str),
}

/// Progress of the experiment at the end of a call.
#[derive(Debug)]
pub enum Ended {
    /// All jobs are finished; the results are written.
    Whole(Box<Results>),
    /// The jobs of this shard are finished, those of other shards are not.
    Part {
        /// Number of finished jobs, in all shards whose folders are here.
        done: usize,
        /// Number of all jobs.
        all: usize,
        /// Folder of the shard.
        folder: PathBuf,
    },
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
    let (finished, todo): (Vec<usize>, Vec<usize>) =
        (0..jobs.len()).filter(mine).partition(|&n| done.contains_key(&jobs[n].id));
    let scratch = folder.join("scratch");
    let finished = runner::run(
        kind,
        jobs,
        (&todo, finished.len()),
        options.threads,
        (&scratch, options.least_free_bytes),
        (&options.stop, options.tell),
        &mut journal,
    )?;
    done.extend(finished.into_iter().map(|job| (job.job.clone(), job)));
    Ok(())
}
