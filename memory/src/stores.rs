//! Where records are kept: one interface, the store on this machine's disk, and one in MongoDB (feature `mongodb`).

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

/// How much is kept; what is over goes oldest first, pinned records excepted. The default keeps everything.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Retention {
    /// Greatest age against the newest record, nanoseconds of the recording's clock.
    pub max_age_ns: Option<i64>,
    /// Greatest size of the whole record on the disk, bytes.
    pub max_bytes: Option<u64>,
    /// Least room to be left free on the disk, bytes.
    pub min_free_bytes: Option<u64>,
}

/// What is there.
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
    /// What is not whole, one line each.
    pub faults: Vec<Fault>,
}

/// Something that is not whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// The record, where it is known.
    pub record: Option<RecordId>,
    /// The file or collection.
    pub place: String,
    /// What is wrong.
    pub what: String,
}

impl Report {
    /// Whether everything is whole.
    pub fn is_whole(&self) -> bool {
        self.faults.is_empty()
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

    /// What meets a query, in its order.
    ///
    /// # Errors
    /// If the store cannot be read.
    fn find(&self, query: &Query) -> Result<Vec<Document>, Error>;

    /// Of what meets a query (its order and limit aside) the record whose stamp is nearest; the earlier of two as near, of one stamp the newest.
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

    /// What is pinned, and by whom.
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
