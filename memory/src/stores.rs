//! Stores of records: one interface, the store on this machine's disk, and one in MongoDB (feature
//! `mongodb`).

pub mod local;
#[cfg(feature = "mongodb")]
pub mod mongo;

use crate::document::{Document, Draft, Query, RecordId};
use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Kind of a document that adds pins, which protect records from pruning.
pub(crate) const PIN: &str = "pin";
/// Kind of a document that removes pins.
pub(crate) const UNPIN: &str = "unpin";
/// Name of the holder of pins on records that are never pruned.
pub(crate) const KEPT: &str = "record";

/// Limits of a store; data beyond them is pruned oldest first, pinned records excepted. The default
/// keeps everything.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Retention {
    /// Maximum age relative to the newest record, nanoseconds of the recording's clock.
    pub max_age_ns: Option<i64>,
    /// Maximum size of the whole record on the disk, bytes.
    pub max_bytes: Option<u64>,
    /// Minimum free room on the disk, bytes.
    pub min_free_bytes: Option<u64>,
}

/// Counts and sizes of a store.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stats {
    /// Number of records.
    pub records: u64,
    /// Size on the disk, bytes, the index included.
    pub bytes: u64,
    /// Number of records and the bytes of their messages, by kind.
    pub kinds: BTreeMap<String, Count>,
    /// Number of pinned records.
    pub pinned: u64,
    /// Oldest stamp, nanoseconds; `None` without records.
    pub oldest_ns: Option<i64>,
    /// Newest stamp, nanoseconds; `None` without records.
    pub newest_ns: Option<i64>,
    /// Number of segments on the disk; 0 for stores without segments.
    pub segments: u64,
}

/// Number of records, and the bytes of their messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// Number of records.
    pub records: u64,
    /// Bytes of documents and blobs.
    pub bytes: u64,
}

/// Result of verifying every record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Number of undamaged records.
    pub whole: u64,
    /// Bytes of documents and blobs read.
    pub bytes: u64,
    /// Damage that was found.
    pub faults: Vec<Fault>,
}

/// Damage to a record or to the store.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// The damaged record, if known.
    pub record: Option<RecordId>,
    /// File or collection that is damaged.
    pub place: String,
    /// Description of the damage.
    pub what: String,
}

impl Fault {
    /// Converts the error of a damaged record to a fault.
    ///
    /// # Errors
    /// Any other error, unchanged.
    pub(crate) fn of(record: RecordId, error: Error) -> Result<Self, Error> {
        match error {
            Error::Damaged { place, what, .. } => {
                Ok(Fault { record: Some(record), place: place.display().to_string(), what })
            }
            other => Err(other),
        }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.record {
            Some(id) => write!(f, "record {id} in {}: {}", self.place, self.what),
            None => write!(f, "{}: {}", self.place, self.what),
        }
    }
}

impl Report {
    /// True if nothing is damaged.
    pub fn is_whole(&self) -> bool {
        self.faults.is_empty()
    }
}

/// Function that receives the document of a record, and the bytes of its blobs.
pub type Take<'a> = dyn FnMut(Document, Vec<Vec<u8>>) -> Result<(), Error> + 'a;

/// Iteration over the results of a query in pages.
pub(crate) struct Pages {
    query: Query,
    left: usize,
}

impl Pages {
    const AT_ONCE: usize = 256;

    pub fn of(query: &Query) -> Self {
        Pages { query: query.clone(), left: query.limit.unwrap_or(usize::MAX) }
    }

    /// Query for the next page; `None` after the last.
    pub fn next(&self) -> Option<Query> {
        let limit = Some(self.left.min(Self::AT_ONCE));
        (self.left > 0).then(|| Query { limit, ..self.query.clone() })
    }

    /// Notes a page: its number of results, and the stamp and number of the last one, `None` for an empty
    /// page.
    pub fn was(&mut self, found: usize, last: Option<(i64, RecordId)>) {
        self.query.after = last;
        self.left = if last.is_some() { self.left - found } else { 0 };
    }
}

/// Storage for records, with queries.
///
/// Data for which [`Store::append`] has returned is on the disk as far as the store's durability promises.
pub trait Store: Send + Sync {
    /// Records all drafts or, on an error, none of them; returns the numbers of the records.
    ///
    /// # Errors
    /// [`Error::Full`] without room, [`Error::Input`] for what cannot be recorded.
    fn append(&self, drafts: &[Draft]) -> Result<Vec<RecordId>, Error>;

    /// Reads the document of a record.
    ///
    /// # Errors
    /// [`Error::Missing`], [`Error::Damaged`].
    fn get(&self, id: RecordId) -> Result<Document, Error>;

    /// Reads the bytes of a blob.
    ///
    /// # Errors
    /// [`Error::Missing`], [`Error::NoBlob`], [`Error::Damaged`].
    fn blob(&self, id: RecordId, name: &str) -> Result<Vec<u8>, Error>;

    /// Documents that match a query, in the query's order.
    ///
    /// # Errors
    /// [`Error::Damaged`] if one of the documents is damaged; other errors if the store cannot be read.
    fn find(&self, query: &Query) -> Result<Vec<Document>, Error>;

    /// Passes the undamaged results of a query to `take` in the query's order, with the bytes of their blobs;
    /// returns the faults of the damaged results.
    ///
    /// # Errors
    /// If the store cannot be read, or what `take` returns.
    fn each_whole(&self, query: &Query, take: &mut Take) -> Result<Vec<Fault>, Error> {
        let mut faults = Vec::new();
        let mut pages = Pages::of(query);
        while let Some(query) = pages.next() {
            let page = self.find(&query)?;
            pages.was(page.len(), page.last().map(|d| (d.stamp_ns, d.id)));
            for document in page {
                let blobs = document.blobs.iter().map(|b| self.blob(document.id, &b.name)).collect();
                let id = document.id;
                match blobs {
                    Ok(blobs) => take(document, blobs)?,
                    Err(e) => faults.push(Fault::of(id, e)?),
                }
            }
        }
        Ok(faults)
    }

    /// Finds the document nearest in time among those that match a query (its order and limit aside): of two
    /// at the same distance the earlier, of several with one stamp the newest. `None` if none matches.
    ///
    /// # Errors
    /// If the store cannot be read.
    fn nearest(&self, query: &Query, stamp_ns: i64) -> Result<Option<Document>, Error>;

    /// Names of the coordinate frames of all records of a kind, sorted.
    ///
    /// # Errors
    /// If the store cannot be read.
    fn frames(&self, kind: &str) -> Result<Vec<String>, Error>;

    /// Pins records on behalf of `by`, so that they are never pruned. Durable on return.
    ///
    /// # Errors
    /// [`Error::Missing`] if a record does not exist; then none is pinned.
    fn pin(&self, ids: &[RecordId], by: &str) -> Result<(), Error>;

    /// Replaces the pins of `by` by pins on these records. At no moment is a record unpinned that is pinned
    /// both before and after. Durable on return.
    ///
    /// # Errors
    /// [`Error::Missing`] if a record does not exist; then nothing changes.
    fn hold(&self, ids: &[RecordId], by: &str) -> Result<(), Error>;

    /// Removes all pins of `by`.
    ///
    /// # Errors
    /// If the store cannot be written.
    fn unpin(&self, by: &str) -> Result<(), Error>;

    /// Numbers of the pinned records, with the names of the holders of the pins.
    ///
    /// # Errors
    /// If the store cannot be read.
    fn pins(&self) -> Result<BTreeMap<RecordId, BTreeSet<String>>, Error>;

    /// Returns once everything recorded is on the disk.
    ///
    /// # Errors
    /// If a write fails.
    fn sync(&self) -> Result<(), Error>;

    /// Prunes down to the limits now; recording does so by itself. Returns the number of removed records.
    ///
    /// # Errors
    /// If the store cannot be written.
    fn prune(&self, retention: &Retention) -> Result<u64, Error>;

    /// Counts and sizes of the store.
    ///
    /// # Errors
    /// If the store cannot be read.
    fn stats(&self) -> Result<Stats, Error>;

    /// Verifies every record.
    ///
    /// # Errors
    /// If the store itself cannot be read; damaged records are faults in the report instead.
    fn verify(&self) -> Result<Report, Error>;
}

/// Error for a blob that a record does not have.
pub(crate) fn no_blob(document: &Document, name: &str) -> Error {
    let has: Vec<_> = document.blobs.iter().map(|b| format!("`{}`", b.name)).collect();
    Error::NoBlob {
        id: document.id.0,
        kind: document.kind.clone(),
        name: name.into(),
        has: if has.is_empty() { "none".into() } else { has.join(", ") },
    }
}
