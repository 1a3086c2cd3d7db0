//! `jobs.jsonl`: the finished jobs, one a line, which make a batch resumable.
//!
//! The first line identifies the experiment. A line counts once its newline is on the disk: a line truncated
//! by a power cut is ignored, and its job runs again.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::ExperimentError;
use crate::header::Header;
use crate::job::Finished;

/// Name of the file in an experiment's folder.
pub const FILE: &str = "jobs.jsonl";

/// A journal open for writing, locked against other processes.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
}

/// Finished jobs of a journal, by ID.
pub type Done = BTreeMap<String, Finished>;

impl Journal {
    /// Opens or creates the journal of a folder. Returns the finished jobs and the number of unreadable
    /// lines.
    ///
    /// # Errors
    /// [`ExperimentError`] if the journal belongs to another experiment, another process holds it, or
    /// the disk refuses.
    pub fn open(folder: &Path, header: &Header) -> Result<(Self, Done, usize), ExperimentError> {
        let path = folder.join(FILE);
        let io = |e: std::io::Error| ExperimentError::file(&path, &e);
        std::fs::create_dir_all(folder).map_err(|e| ExperimentError::file(folder, &e))?;
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path).map_err(io)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(ExperimentError::Busy { folder: folder.display().to_string() });
            }
            Err(TryLockError::Error(e)) => return Err(io(e)),
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(io)?;
        let contents = read(&path, &bytes, header)?;
        file.set_len(contents.length).and_then(|()| file.seek(SeekFrom::End(0))).map_err(io)?;
        let mut journal = Self { path, file };
        if contents.length == 0 {
            journal.write(header)?;
        }
        Ok((journal, contents.done, contents.unreadable))
    }

    /// Appends a finished job, durably.
    ///
    /// # Errors
    /// [`ExperimentError::File`] if the disk refuses.
    pub fn append(&mut self, finished: &Finished) -> Result<(), ExperimentError> {
        self.write(finished)
    }

    fn write(&mut self, line: &impl Serialize) -> Result<(), ExperimentError> {
        let text = serde_json::to_string(line).map_err(|e| ExperimentError::file(&self.path, &e))?;
        let written = self.file.write_all((text + "\n").as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(|e| ExperimentError::file(&self.path, &e))
    }
}

/// Reads the journal of a folder without locking it; empty if there is none.
///
/// # Errors
/// [`ExperimentError`] if the journal belongs to another experiment or cannot be read.
pub fn done(folder: &Path, header: &Header) -> Result<Done, ExperimentError> {
    let path = folder.join(FILE);
    if !path.exists() {
        return Ok(Done::new());
    }
    let bytes = std::fs::read(&path).map_err(|e| ExperimentError::file(&path, &e))?;
    Ok(read(&path, &bytes, header)?.done)
}

#[doc(hidden)]
pub struct Contents {
    /// Length up to the last complete line, bytes.
    length: u64,
    done: Done,
    unreadable: usize,
}

#[doc(hidden)]
pub fn read(path: &Path, bytes: &[u8], header: &Header) -> Result<Contents, ExperimentError> {
    let length = bytes.iter().rposition(|&b| b == b'\n').map_or(0, |end| end + 1);
    let mut contents = Contents { length: length as u64, done: Done::new(), unreadable: 0 };
    if length == 0 {
        return Ok(contents);
    }
    let mut lines = bytes[..length - 1].split(|&b| b == b'\n');
    let found: Option<Header> = lines.next().and_then(|line| serde_json::from_slice(line).ok());
    let found = found.ok_or_else(|| ExperimentError::NoJournal { path: path.display().to_string() })?;
    if found != *header {
        return Err(ExperimentError::Another {
            path: path.display().to_string(),
            found: Box::new(found),
            expected: Box::new(header.clone()),
        });
    }
    for line in lines {
        match serde_json::from_slice::<Finished>(line) {
            Ok(finished) => drop(contents.done.insert(finished.job.clone(), finished)),
            Err(_) => contents.unreadable += 1,
        }
    }
    Ok(contents)
}
