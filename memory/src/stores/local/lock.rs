//! One process writes. Readers never touch the lock by which writers keep each other out.

use crate::error::Error;
use std::fs::{File, TryLockError};
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

/// What a writer holds as long as it writes.
pub(super) struct Writing {
    _lock: File,
    /// By which readers see that somebody writes.
    _alive: Option<File>,
}

/// Keeps other writers out.
const LOCK: &str = "lock";
/// Held by the writer as well; a reader tries it for a moment.
const ALIVE: &str = "alive";
/// A reader's moment is over after so many tries of a millisecond.
const TRIES: usize = 1000;

/// Becomes the one that writes.
///
/// # Errors
/// [`Error::InUse`] if another does.
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

/// Whether somebody writes.
pub(super) fn is_written(dir: &Path) -> bool {
    let Ok(alive) = File::open(dir.join(ALIVE)) else { return false };
    matches!(alive.try_lock_shared(), Err(TryLockError::WouldBlock))
}

fn open(path: &Path) -> std::io::Result<File> {
    File::options().create(true).truncate(false).write(true).open(path)
}
