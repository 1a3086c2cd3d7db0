//! Folder of a run, locked while a process writes there.

use std::fs::{File, TryLockError, create_dir, create_dir_all};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use descry_domains::objective::Goal;
use descry_domains::symbol::symbol;

use super::files::is_run;
use crate::exit::CommandError;

/// Folder of a run, locked by this process until dropped.
pub struct Folder {
    path: PathBuf,
    _lock: File,
}

/// Name of the lock file.
const LOCK: &str = "run.lock";

impl Folder {
    /// Creates the folder of a new run: the requested one, or a new numbered one under `runs/`.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] if the folder holds a run already, if another process is creating
    /// one there, or if it cannot be created.
    pub fn of_new_run(asked: Option<&Path>, goal: &Goal) -> Result<Self, CommandError> {
        match asked {
            Some(folder) => Self::made(folder),
            None => Self::numbered(&Path::new("runs").join(symbol(&goal.said))),
        }
    }

    /// Creates the folder of a new run at this path.
    ///
    /// # Errors
    /// As [`Folder::of_new_run`].
    pub fn made(folder: &Path) -> Result<Self, CommandError> {
        let refuse_a_run = || match is_run(folder) {
            true => Err(refused(folder, "it holds a run already\n  name another folder")),
            false => Ok(()),
        };
        refuse_a_run()?;
        create_dir_all(folder).map_err(|e| {
            refused(
                folder,
                format!("{e}\n  expected a folder that is new or empty, where files can be written"),
            )
        })?;
        let claimed = Self::locked(folder)?;
        // Another process may have been quicker, and be done.
        refuse_a_run()?;
        Ok(claimed)
    }

    /// Locks the folder of a run that is to be resumed.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] if another process writes there, or if the folder cannot be
    /// written.
    pub fn locked(folder: &Path) -> Result<Self, CommandError> {
        let lock = File::options().create(true).truncate(false).write(true).open(folder.join(LOCK));
        let lock = lock.map_err(|e| refused(folder, e))?;
        match lock.try_lock() {
            Ok(()) => Ok(Folder { path: folder.to_owned(), _lock: lock }),
            Err(TryLockError::WouldBlock) => Err(refused(
                folder,
                "another process is writing a run there\n  name another folder, or wait until it has ended",
            )),
            Err(TryLockError::Error(e)) => Err(refused(folder, e)),
        }
    }

    /// Creates the first numbered folder that does not exist yet; safe if several processes do so
    /// at the same time.
    fn numbered(stem: &Path) -> Result<Self, CommandError> {
        let parent = stem.parent().unwrap_or(Path::new("."));
        create_dir_all(parent).map_err(|e| {
            let parent = parent.display();
            CommandError::BadInput(format!(
                "{parent}: {e}\n  a new run has its folder there: name another with --run"
            ))
        })?;
        for n in 1_u32.. {
            let folder = PathBuf::from(format!("{}-{n:03}", stem.display()));
            match create_dir(&folder) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => (),
                made => return made.map_err(|e| refused(&folder, e)).and_then(|()| Self::locked(&folder)),
            }
        }
        Err(refused(stem, "no number is left for a new run: remove some, or name a folder with --run"))
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

fn refused(folder: &Path, why: impl std::fmt::Display) -> CommandError {
    CommandError::BadInput(format!("--run {}: {why}", folder.display()))
}
