//! What outlasts a run: read from its store when the run begins, kept there when it ends.

use std::path::Path;
use std::sync::Arc;

use descry_domains::situation::Past;
use descry_memory::remember::Remembered;
use descry_memory::{Error, Options, Record};

use crate::exit::CommandError;
use crate::keeping::{Address, is_address};

/// What a store remembers of earlier runs; nothing if it is new.
///
/// # Errors
/// [`CommandError::Broken`] if there is a store and it cannot be read.
pub fn recall(store: &str, now_unix_s: f64) -> Result<Past, CommandError> {
    let is_new = !is_address(Path::new(store)) && !Path::new(store).exists();
    let remembered = if is_new { Ok(Remembered::default()) } else { Remembered::recall(&open(store)?) };
    let remembered = remembered.map_err(CommandError::broken)?;
    Ok(Past { remembered: Arc::new(remembered), now_unix_s })
}

/// Keeps in a store what is to be remembered.
///
/// # Errors
/// [`CommandError::Broken`] if it cannot be kept.
pub fn keep(store: &str, remembered: &Remembered, now_unix_s: f64) -> Result<(), CommandError> {
    remembered.keep(&open(store)?, now_unix_s).map_err(CommandError::broken)
}

/// The store in a folder or at an address, made if it is not there.
fn open(store: &str) -> Result<Record, CommandError> {
    let folder = Path::new(store);
    if is_address(folder) {
        let address = Address::read(store)?;
        let address = if address.run.is_some() { address } else { address.of_run(Path::new("remembered")) };
        return address.write(Options::default());
    }
    match Record::open(folder, Options::default()) {
        Err(Error::NoRecord { .. }) => {
            Record::create(folder, Options::default()).map_err(CommandError::broken)
        }
        opened => opened.map_err(CommandError::broken),
    }
}
