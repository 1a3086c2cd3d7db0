//! Options for storing the record of a run, and opening of records.

#[doc(hidden)]
pub mod remote;

use std::path::Path;

use descry_memory::{Durability, Options, Record, Retention, free_bytes};
pub use remote::{Address, is_address};
use serde::{Deserialize, Serialize};

use crate::exit::CommandError;

/// Options for storing the record of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Keeping {
    /// Address of the store, `mongodb://HOST[:PORT]/DATABASE[#RUN]`; `None`: the run's folder.
    pub memory: Option<String>,
    /// Durability of the record; `None`: [`Kept::Disk`].
    pub durability: Option<Kept>,
    /// Maximum size of the record, bytes; beyond, the oldest data are pruned, except what a belief
    /// or plan is based on. `None`: unlimited.
    pub max_bytes: Option<u64>,
    /// Maximum age of recorded data, seconds on the body's clock; `None`: unlimited.
    pub max_age: Option<f64>,
    /// Minimum free space to leave on the disk, bytes; `None`: no minimum.
    pub min_free: Option<u64>,
}

/// Point at which data count as recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kept {
    /// Data have reached the disk.
    Disk,
    /// Data have reached the operating system, and survive a crash of the process but not of the
    /// machine.
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

    /// True if a limit is set, so that recorded data may have been pruned.
    pub fn prunes(&self) -> bool {
        self.options().retention != Retention::default()
    }

    fn address(&self) -> Result<Option<Address>, CommandError> {
        self.memory.as_deref().map(Address::read).transpose()
    }

    /// Options for a new run: completed with the run's name in the store, which must not exist
    /// there yet.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] for an unusable address, a name that exists, or a disk with less
    /// free space than [`Keeping::min_free`]; [`CommandError::Broken`] if no server answers.
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

    /// Creates the record of a new run.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if the record cannot be created.
    pub fn create(&self, run: &Path) -> Result<Record, CommandError> {
        match self.address()? {
            Some(address) => address.write(self.options()),
            None => Record::create(&run.join(RECORD), self.options()).map_err(CommandError::broken),
        }
    }

    /// Opens the record of an interrupted run for writing; creates one if the run was interrupted
    /// before it had a record.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if the record cannot be opened, or if another process is writing
    /// it.
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

/// Opens a record for reading: the record of a run, a bare record folder, or a record at an
/// address.
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

/// Opens the record of a run in progress for reading; data written later become visible.
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

/// Opens a record for reading; fails if data are missing as far as that shows without reading
/// everything.
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

/// Name of the record's folder in the folder of its run.
pub const RECORD: &str = "record";
