//! Stores of records: one interface, the store on this machine's disk, and one in MongoDB (feature
//! `mongodb`).

pub mod local;
#[cfg(feature = "mongodb")]
pub mod mongo;

use crate::document::{Document, Draft, Query, RecordId};
use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The kinds under which pins are recorded.
pub(crate) const PIN: &str = "pin";
pub(crate) const UNPIN: &str = "unpin";
/// In whose name a record is pinned that is never pruned.
pub(crate) const KEPT: &str = "record";

/// Limits of a store; data beyond them is pruned oldest first, pinned records excepted. The default
/// keeps everything.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Retention {
    /// Greatest age against the newest record, nanoseconds of the recording's clock.
    pub max_age_ns: Option<i64>,
    /// Greatest size of the whole record on the disk, bytes.
    pub max_bytes: Option<u64>,
    /// Least room to be left free on the disk, bytes.
    pub min_free_bytes: Option<u64>,
}

/// Counts and sizes of a store.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stats {
    /// Records.
    pub records: u64,
    /// Size on the disk, bytes, the index included.
    pub bytes: u64,
    /// Records and the bytes of their messages, by kind.
    pub kinds: BTreeMap<String, Count>,
    /// Records that are pinned.
    pub pinned: u64,
    /// Oldest stamp, nanoseconds.
    pub oldest_ns: Option<i64>,
    /// Newest stamp, nanoseconds.
    pub newest_ns: Option<i64>,
    /// Segments on the disk (0 for stores without).
    pub segments: u64,
}

/// Records and the bytes of their messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// Records.
    pub records: u64,
    /// Bytes of documents and blobs.
    pub bytes: u64,
}

/// The outcome of reading every record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Records that are whole.
    pub whole: u64,
    /// Bytes of documents and blobs read.
    pub bytes: u64,
    /// Faults, one line each.
    pub faults: Vec<Fault>,
}

/// Something that is not whole.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// The record, where it is known.
    pub record: Option<RecordId>,
    /// The file or collection.
    pub place: String,
    /// Description.
    pub what: String,
}

impl Fault {
    /// Turns the error of a damaged record into a fault.
    ///
    /// # Errors
    /// Any other error as it is.
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
    /// True if everything is whole.
    pub fn is_whole(&self) -> bool {
        self.faults.is_empty()
    }
}

/// Takes a record with the bytes of its blobs.
pub type Take<'a> = dyn FnMut(Document, Vec<Vec<u8>>) -> Result<(), Error> + 'a;

/// Goes through what meets a query, a part at a time.
pub(crate) struct Pages {
    query: Query,
    left: usize,
}

impl Pages {
    const AT_ONCE: usize = 256;

    pub fn of(query: &Query) -> Self {
        Pages { query: query.clone(), left: query.limit.unwrap_or(usize::MAX) }
    }

    /// The query for the next part, if there is one.
    pub fn next(&self) -> Option<Query> {
        let limit = Some(self.left.min(Self::AT_ONCE));
        (self.left > 0).then(|| Query { limit, ..self.query.clone() })
    }

    /// Counts the records that were found, and keeps the stamp and number of the last.
    pub fn was(&mut self, found: usize, last: Option<(i64, RecordId)>) {
        self.query.after = last;
        self.left = if last.is_some() { self.left - found } else { 0 };
    }
}

/// Keeps records and finds them again.
///
/// What [`Store::append`] has returned is on the disk as far as the store's durability promises.
pub trait Store: Send + Sync {
    /// Records all of them or, on an error, none.
    ///
    /// # Errors
    /// [`Error::Full`] without room, [`Error::Input`] for what cannot be recorded.
    fn append(&self, drafts: &[Draft]) -> Result<Vec<RecordId>, Error>;

    /// The document of a record.
    ///
    /// # Errors
    /// [`Error::Missing`], [`Error::Damaged`].
    fn get(&self, id: RecordId) -> Result<Document, Error>;

    /// The bytes of a blob.
    ///
    /// # Errors
    /// [`Error::Missing`], [`Error::NoBlob`], [`Error::Damaged`].
    fn blob(&self, id: RecordId, name: &str) -> Result<Vec<u8>, Error>;

    /// Documents that meet a query, in its order.
    ///
    /// # Errors
    /// [`Error::Damaged`] if any of it is not what was written; if the store cannot be read.
    fn find(&self, query: &Query) -> Result<Vec<Document>, Error>;

    /// Hands over, in the order of the query, what meets it and is whole to the last byte, with the bytes of its blobs; returns what
    /// of it is not.
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

    /// Document nearest in stamp among those that meet a query (order and limit aside); the earlier
    /// of two as near, of one stamp the newest.
    ///
    /// # Errors
    /// If the store cannot be read.
    fn nearest(&self, query: &Query, stamp_ns: i64) -> Result<Option<Document>, Error>;

    /// The frames in which there are records of a kind, sorted.
    ///
    /// # Errors
    /// If the store cannot be read.
    fn frames(&self, kind: &str) -> Result<Vec<String>, Error>;

    /// Keeps records from being pruned, in the name of `by`. Durable when it returns.
    ///
    /// # Errors
    /// [`Error::Missing`] if one of them is not there; then none is pinned.
    fn pin(&self, ids: &[RecordId], by: &str) -> Result<(), Error>;

    /// Pins these records, and no others, in the name of `by`: at no moment is less held than before or after. Durable when it
    /// returns.
    ///
    /// # Errors
    /// [`Error::Missing`] if one of them is not there; then nothing changes.
    fn hold(&self, ids: &[RecordId], by: &str) -> Result<(), Error>;

    /// Takes back every pin in the name of `by`.
    ///
    /// # Errors
    /// If the store cannot be written.
    fn unpin(&self, by: &str) -> Result<(), Error>;

    /// Pinned records, and who pins them.
    ///
    /// # Errors
    /// If the store cannot be read.
    fn pins(&self) -> Result<BTreeMap<RecordId, BTreeSet<String>>, Error>;

    /// Returns when everything recorded is on the disk.
    ///
    /// # Errors
    /// If it cannot be brought there.
    fn sync(&self) -> Result<(), Error>;

    /// Drops what is over the limits now; recording does so by itself. Returns how many records went.
    ///
    /// # Errors
    /// If the store cannot be written.
    fn prune(&self, retention: &Retention) -> Result<u64, Error>;

    /// Counts and sizes.
    ///
    /// # Errors
    /// If the store cannot be read.
    fn stats(&self) -> Result<Stats, Error>;

    /// Reads every record.
    ///
    /// # Errors
    /// If the store itself cannot be read; what is not whole is no error but a fault in the report.
    fn verify(&self) -> Result<Report, Error>;
}

/// A record has no blob of that name.
pub(crate) fn no_blob(document: &Document, name: &str) -> Error {
    let has: Vec<_> = document.blobs.iter().map(|b| format!("`{}`", b.name)).collect();
    Error::NoBlob {
        id: document.id.0,
        kind: document.kind.clone(),
        name: name.into(),
        has: if has.is_empty() { "none".into() } else { has.join(", ") },
    }
}
