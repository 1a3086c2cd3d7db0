//! Belief that persists between runs: read from a store at the beginning of a run, written back at
//! the end.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use descry_domains::past::Past;
use descry_memory::remember::Remembered;
use descry_memory::{Error, Options, Record};

use crate::exit::CommandError;
use crate::keeping::{Address, is_address};
use crate::run::files::is_run;

/// Maximum time to wait for another process that writes to the store.
const LONGEST_WAIT: Duration = Duration::from_secs(10);
/// Interval between checks for the other process.
const WAIT: Duration = Duration::from_millis(50);

/// Belief remembered in a store; empty for a new store.
///
/// # Errors
/// [`CommandError::BadInput`] if the place is not a store; [`CommandError::Broken`] if it cannot be
/// read.
pub fn recall(store: &str, now_unix_s: f64) -> Result<Past, CommandError> {
    let is_new = !is_address(Path::new(store)) && !Path::new(store).exists();
    let remembered = if is_new { Ok(Remembered::default()) } else { Remembered::recall(&open(store)?) };
    let remembered = remembered.map_err(CommandError::broken)?;
    Ok(Past { remembered: Arc::new(remembered), now_unix_s })
}

/// Checks before a run that the store can be written and is not the run's own folder.
///
/// # Errors
/// [`CommandError::BadInput`] if the place cannot be used as a store; otherwise those of
/// [`recall`].
pub fn check(store: &str, run: &Path) -> Result<(), CommandError> {
    let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    if !is_address(Path::new(store)) && whole(Path::new(store)) == whole(run) {
        return Err(no_store(store, "it is the folder of this run"));
    }
    open(store).map(|_| ())
}

/// Writes what a run leaves to a store, merged with what other runs have written since this one
/// began.
///
/// # Errors
/// As [`recall`].
pub fn keep(store: &str, began: &Past, left: Remembered, now_unix_s: f64) -> Result<(), CommandError> {
    let store = open(store)?;
    let there = Remembered::recall(&store).map_err(CommandError::broken)?;
    let joined = there.joined(&began.remembered, left, began.now_unix_s);
    joined.keep(&store, now_unix_s).map_err(CommandError::broken)
}

/// Opens or creates the store in a folder or at an address; waits if another process is writing
/// there.
fn open(store: &str) -> Result<Record, CommandError> {
    let folder = Path::new(store);
    if is_address(folder) {
        let address = Address::read(store)?;
        let address = if address.run.is_some() { address } else { address.of_run(Path::new("remembered")) };
        return address.write(Options::default());
    }
    if folder.is_file() {
        return Err(no_store(store, "it is a file"));
    }
    if is_run(folder) {
        return Err(no_store(store, "it is the folder of a run, whose record is that run's alone"));
    }
    let began = Instant::now();
    loop {
        let opened = match Record::open(folder, Options::default()) {
            Err(Error::NoRecord { .. }) => match Record::create(folder, Options::default()) {
                Err(Error::File { because, .. }) => return Err(no_store(store, &because.to_string())),
                made => made,
            },
            opened => opened,
        };
        match opened {
            Err(Error::InUse { .. }) if began.elapsed() < LONGEST_WAIT => std::thread::sleep(WAIT),
            // Another was quicker to make it.
            Err(Error::Exists { .. }) if began.elapsed() < LONGEST_WAIT => std::thread::sleep(WAIT),
            opened => return opened.map_err(CommandError::broken),
        }
    }
}

fn no_store(store: &str, why: &str) -> CommandError {
    CommandError::BadInput(format!(
        "--remember {store}: {why}\n  expected a folder for what is remembered from run to run: a new one, or that of earlier runs"
    ))
}
