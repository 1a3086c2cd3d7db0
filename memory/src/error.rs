//! Errors of records, each with the place and a remedy.

use crate::stores::Fault;
use std::path::{Path, PathBuf};

/// A record that cannot be read or written as asked.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The disk is full. Acknowledged data is safe; the record stays readable, and recording continues once
    /// there is room.
    #[error(
        "no room left on the disk of {place}: free some, or bound the record by age, bytes or free space; nothing that was acknowledged is lost"
    )]
    Full {
        /// File that was being written.
        place: PathBuf,
    },
    /// The data exceeds the size limit of the record, and too little can be pruned. None of the data was
    /// recorded.
    #[error(
        "{place} is bounded to {}, and {} more do not fit: {} are pinned{} or of this very moment; allow {} or more (`--max-bytes`), or pin less",
        megabytes(*bound), megabytes(*coming), megabytes(*staying), held_text(held), megabytes(staying + coming)
    )]
    Bounded {
        /// Folder or address of the record.
        place: String,
        /// The bound, bytes.
        bound: u64,
        /// Size of the refused data, bytes.
        coming: u64,
        /// Size of data that cannot be pruned, bytes.
        staying: u64,
        /// Holders of the pins: name, records, bytes.
        held: Vec<(String, u64, u64)>,
    },
    /// The system refused a file.
    #[error("{what} {place}: {because}")]
    File {
        /// Failed operation, as "cannot read".
        what: &'static str,
        /// File or folder.
        place: PathBuf,
        /// The system's reason.
        because: std::io::Error,
    },
    /// The folder holds no record.
    #[error("{place} holds no record (no `{expected}` in it): name the folder of a run or of its record")]
    NoRecord {
        /// The folder.
        place: PathBuf,
        /// Expected contents of a record's folder.
        expected: &'static str,
    },
    /// A record exists in the folder for a new one.
    #[error("{place} holds a record already: open it, or name another folder")]
    Exists {
        /// The folder.
        place: PathBuf,
    },
    /// Another process writes this record.
    #[error(
        "{place} is being written by another process: read it with `open_shared`, or stop the other first"
    )]
    InUse {
        /// The folder.
        place: PathBuf,
    },
    /// Bytes on the disk differ from the bytes that were written.
    #[error("{place}, byte {at}: {what}; `descry memory verify` lists what is whole")]
    Damaged {
        /// The file.
        place: PathBuf,
        /// Offset in the file.
        at: u64,
        /// Description of the damage.
        what: String,
    },
    /// A damaged record cannot be continued, since it would then be mistaken for a whole one.
    #[error(
        "{place} is damaged, so that it can be read as far as it is whole and not be gone on with{}\n  \
         put back what is missing from a copy, or begin anew elsewhere; `descry export` writes what is whole to a file",
        listed(faults)
    )]
    Faulty {
        /// The folder.
        place: PathBuf,
        /// Damage that was found.
        faults: Vec<Fault>,
    },
    /// The index of the record failed.
    #[error("the index of {place}: {because}")]
    Index {
        /// Folder of the record.
        place: PathBuf,
        /// SQLite's reason.
        because: rusqlite::Error,
    },
    /// A remote store failed.
    #[error("the store at {place}: {because}")]
    Remote {
        /// Address.
        place: String,
        /// Reason.
        because: String,
    },
    /// The data cannot be recorded as given.
    #[error("{what}: {mend}")]
    Input {
        /// Fault of the data.
        what: String,
        /// Remedy.
        mend: String,
    },
    /// The record does not exist, or was pruned.
    #[error("there is no record {id}: it was pruned or never written; pin what must stay")]
    Missing {
        /// Number of the requested record.
        id: u64,
    },
    /// The record has no such blob.
    #[error("record {id} ({kind}) has no blob `{name}`; it has: {has}")]
    NoBlob {
        /// Number of the record.
        id: u64,
        /// Kind of the record.
        kind: String,
        /// Name of the requested blob.
        name: String,
        /// Names of the blobs that the record has.
        has: String,
    },
    /// No record is within the time tolerance.
    #[error("no {what} within {:.3} s of {stamp_ns} ns{}", *tolerance_ns as f64 * 1e-9, nearest_text(*nearest_ns, *stamp_ns))]
    NotNear {
        /// Requested kind of record, and its frame if one was requested.
        what: String,
        /// Requested time, nanoseconds.
        stamp_ns: i64,
        /// Tolerance, nanoseconds.
        tolerance_ns: i64,
        /// Stamp of the nearest record, nanoseconds; `None` if there is none at all.
        nearest_ns: Option<i64>,
    },
    /// The transform tree has no answer for the requested time.
    #[error(transparent)]
    Transform(#[from] crate::transforms::TransformError),
    /// An earlier write in the background failed; its data was not acknowledged.
    #[error("an earlier write of transforms failed: {because}")]
    Earlier {
        /// Message of that failure.
        because: String,
    },
}

fn listed(faults: &[Fault]) -> String {
    faults.iter().map(|fault| format!("\n  {fault}")).collect()
}

/// Size in megabytes, rounded up to a tenth.
fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", (bytes as f64 / 1e5).ceil() / 10.0)
}

fn held_text(held: &[(String, u64, u64)]) -> String {
    let one = |(by, records, bytes): &(String, u64, u64)| {
        format!("{} in {records} records by `{by}`", megabytes(*bytes))
    };
    match held {
        [] => String::new(),
        held => format!(" ({})", held.iter().map(one).collect::<Vec<_>>().join(", ")),
    }
}

fn nearest_text(nearest_ns: Option<i64>, stamp_ns: i64) -> String {
    match nearest_ns {
        Some(n) => format!(
            "; the nearest is {:.3} s {}",
            (n as f64 - stamp_ns as f64).abs() * 1e-9,
            if n < stamp_ns { "earlier" } else { "later" }
        ),
        None => "; there is none at any time".into(),
    }
}

impl Error {
    /// A file error, or [`Error::Full`] where that is the reason.
    pub(crate) fn file(what: &'static str, place: &Path, because: std::io::Error) -> Self {
        use std::io::ErrorKind;
        match because.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Error::Full { place: place.to_owned() },
            _ => Error::File { what, place: place.to_owned(), because },
        }
    }

    /// An index error, or [`Error::Full`] where that is the reason.
    pub(crate) fn index(place: &Path, because: rusqlite::Error) -> Self {
        // Without room for its shared memory SQLite reports a failure of input and output.
        let shared_memory =
            because.sqlite_error().is_some_and(|e| e.extended_code == rusqlite::ffi::SQLITE_IOERR_SHMSIZE);
        if shared_memory || because.sqlite_error_code() == Some(rusqlite::ErrorCode::DiskFull) {
            return Error::Full { place: place.to_owned() };
        }
        Error::Index { place: place.to_owned(), because }
    }

    /// True for a lack of room on the disk.
    pub fn is_full(&self) -> bool {
        matches!(self, Error::Full { .. })
    }
}
