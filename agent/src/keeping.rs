//! Storage of a run's record.

#[doc(hidden)]
pub mod remote;

use std::path::Path;

use descry_memory::{Durability, Options, Record, Retention, free_bytes};
pub use remote::{Address, is_address};
use serde::{Deserialize, Serialize};

use crate::exit::CommandError;

/// Storage options of a record: part of the settings of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Keeping {
    /// Address of the record, `mongodb://HOST[:PORT]/DATABASE[#RUN]`; `None`: the run's folder.
    pub memory: Option<String>,
    /// Durability of the record; `None`: data counts as recorded once on the disk.
    pub durability: Option<Kept>,
    /// Maximum size of the record, bytes; the oldest excess is pruned, unless a belief or a plan
    /// rests on it.
    pub max_bytes: Option<u64>,
    /// Maximum age of recorded data, seconds on the body's clock.
    pub max_age: Option<f64>,
    /// Minimum room to be left on the disk, bytes.
    pub min_free: Option<u64>,
}

/// Durability: the point at which data counts as recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kept {
    /// Data is on the disk.
    Disk,
    /// The operating system has the data.
    Process,
}

impl Keeping {
    fn options(&self) -> Options {
        Options {
            durability: match self.durability {
                Some(Kept::Process) => Durability::Process,
                Some(Kept::Disk) | None => Durability::Disk,
            },
            retention: Retention {
                max_age_ns: self.max_age.map(|s| (s * 1e9) as i64),
                max_bytes: self.max_bytes,
                min_free_bytes: self.min_free,
            },
            ..Options::default()
        }
    }

    /// True if recorded data may have been pruned.
    pub fn prunes(&self) -> bool {
        self.options().retention != Retention::default()
    }

    fn address(&self) -> Result<Option<Address>, CommandError> {
        self.memory.as_deref().map(Address::read).transpose()
    }

    /// Options with the name of a new run in its store, where that name must be free.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] for an address that cannot be used, or where less room is left already than is to be left;
    /// [`CommandError::Broken`] if no server answers there.
    pub fn of_new_run(&self, run: &Path) -> Result<Self, CommandError> {
        let Some(address) = self.address()? else {
            self.check_room(run)?;
            return Ok(self.clone());
        };
        let address = address.of_run(run);
        address.check_free(self.options())?;
        Ok(Keeping { memory: Some(address.to_string()), ..self.clone() })
    }

    fn check_room(&self, run: &Path) -> Result<(), CommandError> {
        match (self.min_free, free_bytes(run)) {
            (Some(least), Ok(free)) if free < least => Err(CommandError::bad_input(format!(
                "--min-free: {:.1} GB are to be left on the disk of {}, and {:.1} GB are left before anything is recorded\n  \
                 make room there, or let less be left",
                least as f64 / 1e9,
                run.display(),
                free as f64 / 1e9,
            ))),
            _ => Ok(()),
        }
    }

    /// A new record for a run.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if it cannot be made.
    pub fn create(&self, run: &Path) -> Result<Record, CommandError> {
        match self.address()? {
            Some(address) => address.write(self.options()),
            None => Record::create(&run.join(RECORD), self.options()).map_err(CommandError::broken),
        }
    }

    /// Opens the record of a run to be resumed; creates one if the run was cut off before it had
    /// one.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if it cannot be opened, or is being written.
    pub fn resume(&self, run: &Path) -> Result<Record, CommandError> {
        if let Some(address) = self.address()? {
            return address.write(self.options())?.retracing().map_err(CommandError::broken);
        }
        let record = match Record::resume(&run.join(RECORD), self.options()) {
            Err(descry_memory::Error::NoRecord { .. }) => return self.create(run),
            opened => opened.map_err(CommandError::broken)?,
        };
        for lost in &record.recovery().lost {
            tracing::warn!("{lost}: they had not reached the disk; the run goes on without them");
        }
        Ok(record)
    }
}

/// Opens a record for reading: that of a run, a bare record folder, or one at an address.
///
/// # Errors
/// [`CommandError::BadInput`] if there is none; [`CommandError::Broken`] if it cannot be opened.
pub fn open(place: &Path) -> Result<Record, CommandError> {
    let record = found(place)?;
    if record.recovery().index_rebuilt {
        tracing::warn!("{}: the index is damaged, and the segments are read without it", place.display());
    }
    Ok(record)
}

/// Opens the record of a running run for reading; later writes become visible, as the index exists
/// from the first record on.
///
/// # Errors
/// As [`open`], also if the run has not written anything yet.
pub fn open_written(run: &Path) -> Result<Record, CommandError> {
    let record = found(run)?;
    match record.stats().map_err(CommandError::broken)?.records {
        0 => Err(CommandError::broken(format!("{}: nothing is recorded yet", run.display()))),
        _ => Ok(record),
    }
}

fn found(place: &Path) -> Result<Record, CommandError> {
    if let Some(text) = place.to_str().filter(|_| is_address(place)) {
        return Address::read(text)?.read_only();
    }
    if let Ok(header) = crate::run::files::header(place)
        && let Some(address) = header.settings.keeping.address()?
    {
        return address.read_only();
    }
    Record::open_shared(place).map_err(|e| match e {
        descry_memory::Error::NoRecord { .. } => CommandError::bad_input(e),
        other => CommandError::broken(other),
    })
}

/// Opens a record for reading; fails if a loss is visible without reading all data.
///
/// # Errors
/// As [`open`], or [`CommandError::Broken`] that says what is lost.
pub fn open_whole(place: &Path) -> Result<Record, CommandError> {
    let record = open(place)?;
    match record.recovery().faults.clone() {
        faults if faults.is_empty() => Ok(record),
        faults => Err(CommandError::broken(descry_memory::Error::Faulty { place: place.to_owned(), faults })),
    }
}

/// Name of the record's folder inside its run's folder.
pub const RECORD: &str = "record";
