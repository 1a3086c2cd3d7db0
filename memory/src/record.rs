//! Record: the handle for writing and reading sensor data, actions and beliefs.

mod put;
mod recall;

use crate::document::{Document, Draft, Query, RecordId};
use crate::error::Error;
use crate::flusher::{Flusher, Group};
use crate::retrace::Retrace;
use crate::stores::local::{Durability, LocalOptions, LocalStore, Recovery};
use crate::stores::{Fault, Report, Retention, Stats, Store};
use crate::transforms::{Reach, Sample};
use recall::named;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Kinds of documents that have a special form; any other word is a kind as well.
pub mod kind {
    /// A point cloud.
    pub const CLOUD: &str = "cloud";
    /// A sweep of a laser.
    pub const SCAN: &str = "scan";
    /// An image.
    pub const IMAGE: &str = "image";
    /// Transforms from one child frame to its parent over a time span.
    pub const TRANSFORMS: &str = "transforms";
    /// A static transform.
    pub const STATIC_TRANSFORM: &str = "static_transform";
    /// A line of the log.
    pub const LOG: &str = "log";
}

/// Options for writing and reading a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Condition for acknowledging a write.
    pub durability: Durability,
    /// Limits beyond which old data is pruned.
    pub retention: Retention,
    /// Length, bytes, at which a segment (a file of the record) is followed by another.
    pub segment_bytes: u64,
    /// Name of the recording robot, if several write into one store; else "".
    pub robot: String,
    /// Time span of the transforms that are written together, nanoseconds (paper 004's recorder: 2 s).
    pub group_ns: i64,
    /// Limits of interpolating and extrapolating transforms.
    pub reach: Reach,
    /// Maximum difference between the stamp of a cloud and the requested time, nanoseconds.
    pub view_tolerance_ns: i64,
}

impl Default for Options {
    fn default() -> Self {
        let local = LocalOptions::default();
        Options {
            durability: local.durability,
            retention: local.retention,
            segment_bytes: local.segment_bytes,
            robot: String::new(),
            group_ns: 2_000_000_000,
            reach: Reach::default(),
            view_tolerance_ns: 500_000_000,
        }
    }
}

impl Options {
    fn local(&self) -> LocalOptions {
        LocalOptions {
            durability: self.durability,
            retention: self.retention,
            segment_bytes: self.segment_bytes,
        }
    }
}

/// An image to be recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Image<'a> {
    /// A PNG or JPEG.
    Compressed {
        /// `png` or `jpeg`.
        format: &'a str,
        /// The file's bytes.
        data: &'a [u8],
    },
    /// Plain pixels, row by row.
    Raw {
        /// Number of columns.
        width: u32,
        /// Number of rows.
        height: u32,
        /// Encoding, as viewers name it: `rgb8`, `mono8`, `16UC1` (depth in millimetres), `32FC1` (depth in
        /// metres).
        encoding: &'a str,
        /// The pixels.
        data: &'a [u8],
    },
}

/// A record: all sensor data, actions and beliefs, ordered by time.
///
/// The results of `put_cloud`, `put_image`, `put_document` and `put_log` are acknowledged: they are on the
/// disk as far as [`Options::durability`] promises. Transforms arrive thousands a second and are written in
/// groups; they are acknowledged by the next [`Record::sync`], or once their group is written in the
/// background.
pub struct Record {
    store: Arc<dyn Store>,
    recovery: Recovery,
    options: Options,
    groups: Mutex<Groups>,
    /// Drafts that are to be written together with the next record.
    soon: Mutex<Vec<Draft<'static>>>,
    flusher: Flusher,
    retrace: Option<Retrace>,
    /// True once data did not fit within the size limit.
    is_at_bound: AtomicBool,
}

/// Transforms that are not yet in a document, by child and parent frame.
#[derive(Default)]
struct Groups {
    open: BTreeMap<(String, String), Vec<Sample>>,
    /// Index of the time span of [`Options::group_ns`] to which the open groups belong.
    span: i64,
}

impl Record {
    /// Creates a record in a folder.
    ///
    /// # Errors
    /// [`Error::Exists`], or what the system refuses.
    pub fn create(dir: &Path, options: Options) -> Result<Self, Error> {
        Ok(Self::local(LocalStore::create(dir, &options.robot, options.local())?, options))
    }

    /// Opens a record for writing, and repairs the traces of a crash.
    ///
    /// # Errors
    /// [`Error::NoRecord`], [`Error::InUse`], or what the system refuses.
    pub fn open(dir: &Path, options: Options) -> Result<Self, Error> {
        Ok(Self::local(LocalStore::open(dir, &options.robot, options.local())?, options))
    }

    /// Opens an interrupted record for a writer that repeats its run from the start: each document, cloud,
    /// image or transform that equals the next recorded one of its kind is taken for that one, and not
    /// written again.
    ///
    /// # Errors
    /// As [`Record::open`].
    pub fn resume(dir: &Path, options: Options) -> Result<Self, Error> {
        Self::open(dir, options)?.retracing()
    }

    /// Expects on a record of any store that its writer repeats the run from the start, as in
    /// [`Record::resume`].
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn retracing(mut self) -> Result<Self, Error> {
        self.retrace = Some(Retrace::of(&*self.store, &self.options.robot)?);
        Ok(self)
    }

    /// Opens a record for reading, while another process may be writing it.
    ///
    /// # Errors
    /// [`Error::NoRecord`], or what the system refuses.
    pub fn open_shared(dir: &Path) -> Result<Self, Error> {
        Ok(Self::local(LocalStore::open_shared(dir)?, Options::default()))
    }

    fn local(store: LocalStore, options: Options) -> Self {
        let recovery = store.recovery().clone();
        let mut record = Self::on(Arc::new(store), options);
        record.recovery = recovery;
        record
    }

    /// Creates a record on a given store.
    pub fn on(store: Arc<dyn Store>, options: Options) -> Self {
        Record {
            flusher: Flusher::start(store.clone()),
            store,
            recovery: Recovery::default(),
            options,
            groups: Mutex::default(),
            soon: Mutex::default(),
            retrace: None,
            is_at_bound: AtomicBool::new(false),
        }
    }

    /// Damage that opening found and repaired.
    pub fn recovery(&self) -> &Recovery {
        &self.recovery
    }

    /// The underlying store.
    pub fn store(&self) -> &dyn Store {
        &*self.store
    }

    /// Records a draft unchanged.
    ///
    /// # Errors
    /// As [`Store::append`].
    pub fn put(&self, draft: Draft) -> Result<RecordId, Error> {
        if let Some(retrace) = &self.retrace
            && let Some(id) = retrace.next(&*self.store, &draft)?
        {
            return Ok(id);
        }
        let mut soon = self.soon.lock().unwrap_or_else(PoisonError::into_inner);
        // All or none: what was held back is not dropped with a draft that cannot be recorded.
        let drafts: Vec<Draft> = soon.iter().cloned().chain([draft]).collect();
        let ids = self.append(&drafts)?;
        soon.clear();
        ids.last().copied().ok_or(Error::Missing { id: 0 })
    }

    /// Enqueues a draft to be written with the next record, so that many small drafts share one wait for the
    /// disk. The draft is acknowledged with that record, or by [`Record::sync`].
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn put_soon(&self, draft: Draft<'static>) -> Result<(), Error> {
        if let Some(retrace) = &self.retrace
            && retrace.next(&*self.store, &draft)?.is_some()
        {
            return Ok(());
        }
        self.hold_back(draft);
        Ok(())
    }

    fn hold_back(&self, draft: Draft<'static>) {
        self.soon.lock().unwrap_or_else(PoisonError::into_inner).push(draft);
    }

    fn flush_soon(&self) -> Result<(), Error> {
        let mut soon = self.soon.lock().unwrap_or_else(PoisonError::into_inner);
        self.append(&soon)?;
        soon.clear();
        Ok(())
    }

    fn append(&self, drafts: &[Draft]) -> Result<Vec<RecordId>, Error> {
        let appended = self.store.append(drafts);
        if matches!(appended, Err(Error::Bounded { .. })) {
            self.is_at_bound.store(true, Ordering::Relaxed);
        }
        appended
    }

    /// True once data did not fit within the size limit, so that nothing more can be recorded.
    pub fn is_at_bound(&self) -> bool {
        self.is_at_bound.load(Ordering::Relaxed)
    }

    /// Records several drafts; if one fails, none is recorded.
    ///
    /// # Errors
    /// As [`Store::append`].
    pub fn put_all(&self, drafts: &[Draft]) -> Result<Vec<RecordId>, Error> {
        self.append(drafts)
    }

    /// Flushes everything to the disk, open groups of transforms included.
    ///
    /// # Errors
    /// If a write fails; the data is kept for another attempt.
    pub fn sync(&self) -> Result<(), Error> {
        self.flush_open()?;
        self.flush_soon()?;
        self.store.sync()
    }

    /// Documents that match a query.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn find(&self, query: &Query) -> Result<Vec<Document>, Error> {
        self.store.find(query)
    }

    /// Undamaged documents that match a query, with undamaged blobs, and the faults of the damaged ones.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn find_whole(&self, query: &Query) -> Result<(Vec<Document>, Vec<Fault>), Error> {
        let mut whole = Vec::new();
        let faults = self.store.each_whole(query, &mut |document, _| {
            whole.push(document);
            Ok(())
        })?;
        Ok((whole, faults))
    }

    /// Newest document of a kind by this robot, if there is one.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn newest(&self, kind: &str) -> Result<Option<Document>, Error> {
        let query = Query { order: crate::document::Order::Newest, limit: Some(1), ..self.own(kind) };
        Ok(self.store.find(&query)?.pop())
    }

    /// Document of a kind by this robot that is nearest in time, within a tolerance in nanoseconds.
    ///
    /// # Errors
    /// [`Error::NotNear`] with the stamp of the nearest document.
    pub fn nearest(&self, kind: &str, stamp_ns: i64, tolerance_ns: i64) -> Result<Document, Error> {
        self.nearest_of(&self.own(kind), stamp_ns, tolerance_ns)
    }

    /// Document nearest in time among those that match a query, within a tolerance in nanoseconds.
    ///
    /// # Errors
    /// [`Error::NotNear`] with the stamp of the nearest document.
    pub fn nearest_of(&self, query: &Query, stamp_ns: i64, tolerance_ns: i64) -> Result<Document, Error> {
        let nearest = self.store.nearest(query, stamp_ns)?;
        let nearest_ns = nearest.as_ref().map(|d| d.stamp_ns);
        nearest.filter(|d| d.stamp_ns.abs_diff(stamp_ns) <= tolerance_ns.max(0) as u64).ok_or_else(|| {
            let kind = query.kind.as_deref().unwrap_or("record");
            let what = query.frame.as_ref().map_or(kind.to_owned(), |f| format!("{kind} in `{f}`"));
            Error::NotNear { what, stamp_ns, tolerance_ns, nearest_ns }
        })
    }

    /// Pins records on behalf of `by` (a belief, a model, a plan), so that they are never pruned; with a
    /// cloud or sweep also the transforms and images of its time.
    ///
    /// # Errors
    /// [`Error::Missing`] if a record does not exist; then none is pinned.
    pub fn pin(&self, ids: &[RecordId], by: &str) -> Result<(), Error> {
        self.store.pin(&self.with_their_place(ids)?, by)
    }

    /// Replaces the pins of `by` by pins on these records, as by [`Record::pin`].
    ///
    /// # Errors
    /// [`Error::Missing`] if a record does not exist; then the former pins stay.
    pub fn hold(&self, ids: &[RecordId], by: &str) -> Result<(), Error> {
        let ids = self.with_their_place(ids)?;
        match &self.retrace {
            Some(retrace) if retrace.next_pins(&*self.store, &ids, by)? => Ok(()),
            _ => self.store.hold(&ids, by),
        }
    }

    /// Removes all pins of `by`.
    ///
    /// # Errors
    /// If the store cannot be written.
    pub fn unpin(&self, by: &str) -> Result<(), Error> {
        self.store.unpin(by)
    }

    /// Exports the results of a query, ordered by time, as one MCAP file.
    ///
    /// # Errors
    /// As [`crate::export`].
    pub fn export(&self, query: &Query, path: &Path) -> Result<crate::Exported, Error> {
        crate::export::export(&*self.store, query, path)
    }

    /// Reads every record and reports the damage.
    ///
    /// # Errors
    /// If the store itself cannot be read.
    pub fn verify(&self) -> Result<Report, Error> {
        self.store.verify()
    }

    /// Counts and sizes of the store.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn stats(&self) -> Result<Stats, Error> {
        self.store.stats()
    }
}

impl Groups {
    fn take(&mut self) -> Vec<Group> {
        let open = std::mem::take(&mut self.open);
        open.into_iter().map(|((child, parent), samples)| Group { parent, child, samples }).collect()
    }
}

impl Drop for Record {
    /// Writes pending data. Callers that need to know of failures call [`Record::sync`] first.
    fn drop(&mut self) {
        if let Err(e) = self.flush_open().and_then(|()| self.flush_soon()) {
            tracing::warn!("something was lost at the end of the record: {e}");
        }
    }
}

impl Record {
    /// Query for all documents of a kind by this robot, or by any robot if this one has no name.
    pub fn own(&self, kind: &str) -> Query {
        Query { robot: named(&self.options.robot), ..Query::of_kind(kind) }
    }

    fn flush_open(&self) -> Result<(), Error> {
        let open = self.groups.lock().unwrap_or_else(PoisonError::into_inner).take();
        if !open.is_empty() {
            self.flusher.send(open);
        }
        self.flusher.drain()
    }
}
