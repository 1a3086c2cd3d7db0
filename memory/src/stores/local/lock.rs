//! Locks of a store: one process writes. Readers never touch the lock by which writers exclude each other.

use crate::error::Error;
use std::fs::{File, TryLockError};
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

/// Locks that a writer holds while it exists.
pub(super) struct Writing {
    _lock: File,
    /// Lock by which readers test for a writer.
    _alive: Option<File>,
}

/// Name of the lock file that excludes other writers.
const LOCK: &str = "lock";
/// Name of the lock file that a writer holds as well, and readers try briefly.
const ALIVE: &str = "alive";
/// Maximum number of tries of the second lock, a millisecond apart: a reader holds it only for a moment.
const TRIES: usize = 1000;

/// Acquires the locks of the writer.
///
/// # Errors
/// [`Error::InUse`] if another process holds them.
pub(super) fn lock(dir: &Path) -> Result<Writing, Error> {
    let path = dir.join(LOCK);
    let file = open(&path).map_err(|e| Error::file("cannot open", &path, e))?;
    match file.try_lock() {
        Ok(()) => (),
        Err(TryLockError::WouldBlock) => return Err(Error::InUse { place: dir.to_owned() }),
        Err(TryLockError::Error(e)) => return Err(Error::file("cannot lock", &path, e)),
    }
    let alive = open(&dir.join(ALIVE)).ok();
    if let Some(alive) = &alive {
        for _ in 0..TRIES {
            match alive.try_lock() {
                Err(TryLockError::WouldBlock) => sleep(Duration::from_millis(1)),
                // Without it readers take what is written for the rest of a crash, and read the segments themselves.
                _ => break,
            }
        }
    }
    Ok(Writing { _lock: file, _alive: alive })
}

/// True if a process is writing the store.
pub(super) fn is_written(dir: &Path) -> bool {
    let Ok(alive) = File::open(dir.join(ALIVE)) else { return false };
    matches!(alive.try_lock_shared(), Err(TryLockError::WouldBlock))
}

fn open(path: &Path) -> std::io::Result<File> {
    File::options().create(true).truncate(false).write(true).open(path)
}
