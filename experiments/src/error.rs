//! Errors that keep an experiment from being carried out.

use std::path::Path;

use crate::header::Header;

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
        "{path} belongs to another experiment\n  found: {} with hash {}, {} jobs, version {}\n  expected: {} with hash {}, {} jobs, version {}\n  give the same --set as before, name another folder with --out, or remove this one",
        found.experiment, found.hash, found.jobs, found.version, expected.experiment, expected.hash, expected.jobs, expected.version
    )]
    Another {
        /// Path of the journal.
        path: String,
        /// First line of the journal.
        found: Box<Header>,
        /// Expected first line.
        expected: Box<Header>,
    },
    /// A file with the name of a journal but another content.
    #[error("{path}: this is no journal of an experiment\n  name another folder with --out")]
    NoJournal {
        /// Path of the file.
        path: String,
    },
    /// Another process is working in the folder.
    #[error(
        "{folder}: another process is at work on this experiment\n  wait for it, or give each its own --shard"
    )]
    Busy {
        /// Path of the folder.
        folder: String,
    },
    /// Two jobs have the same ID.
    #[error("the job \"{id}\" is there twice\n  remove what the file lists twice")]
    Twice {
        /// ID of both jobs.
        id: String,
    },
    /// Jobs are missing from the merged folders.
    #[error(
        "{missing} of {all} jobs are in none of the folders, the first of them \"{first}\"\n  do the missing shards, or leave --merge out to do them here"
    )]
    Missing {
        /// Number of missing jobs.
        missing: usize,
        /// Number of all jobs.
        all: usize,
        /// ID of the first missing job.
        first: String,
    },
    /// The disk is full; journalled jobs are kept.
    #[error(
        "{folder}: the disk is full, and {job} failed: {because}\n  free some room and run it again: what is done is not done again"
    )]
    NoRoom {
        /// Folder of the results.
        folder: String,
        /// ID of the failed job, which does not count.
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
    pub(crate) fn file(path: &Path, because: &dyn std::fmt::Display) -> Self {
        Self::File { path: path.display().to_string(), because: because.to_string() }
    }
}
