//! Record: the handle by which the rest of descry writes and reads what was sensed, done and
//! believed.

mod recall;

use crate::clouds::{self, Sensing};
use crate::document::{Blob, Document, Draft, Form, Meta, Query, RecordId};
use crate::error::Error;
use crate::flusher::{Flusher, Group};
use crate::foxglove::LogLevel;
use crate::retrace::Retrace;
use crate::scans;
use crate::stores::local::{Durability, LocalOptions, LocalStore, Recovery};
use crate::stores::{Fault, Report, Retention, Stats, Store};
use crate::transforms::{self, Reach, Sample};
use crate::viewer;
use descry_perception::Cloud;
use descry_perception::laser::Scan;
use nalgebra::Isometry3;
use recall::named;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The kinds that have a form of their own; any other word is a kind, too.
pub mod kind {
    /// A point cloud.
    pub const CLOUD: &str = "cloud";
    /// A sweep of a laser.
    pub const SCAN: &str = "scan";
    /// An image.
    pub const IMAGE: &str = "image";
    /// Transforms of one child frame over some time.
    pub const TRANSFORMS: &str = "transforms";
    /// A transform that holds always.
    pub const STATIC_TRANSFORM: &str = "static_transform";
    /// A line of the log.
    pub const LOG: &str = "log";
}

/// Options for writing and reading a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// When a record counts as acknowledged.
    pub durability: Durability,
    /// Limits beyond which old data is pruned.
    pub retention: Retention,
    /// Length of a segment, bytes.
    pub segment_bytes: u64,
    /// Who records, where several write into one store.
    pub robot: String,
    /// Transforms of a child frame are grouped over so long, nanoseconds (paper 004's recorder: 2 s).
    pub group_ns: i64,
    /// Greatest distance in time over which transforms are extrapolated.
    pub reach: Reach,
    /// Greatest time between a cloud and the time asked for, nanoseconds.
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
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// As viewers name it: `rgb8`, `mono8`, `16UC1` (depth in millimetres), `32FC1` (depth in metres).
        encoding: &'a str,
        /// The pixels.
        data: &'a [u8],
    },
}

/// A record: everything that was sensed, done and believed, in order of time.
///
/// What `put_cloud`, `put_image`, `put_document` and `put_log` return is acknowledged: it is on the disk as far as
/// [`Options::durability`] promises. Transforms come thousands a second and are grouped; they are acknowledged by the
/// next [`Record::sync`], or when their group is written in the background.
pub struct Record {
    store: Arc<dyn Store>,
    recovery: Recovery,
    options: Options,
    groups: Mutex<Groups>,
    /// Drafts that are written together with the next one.
    soon: Mutex<Vec<Draft<'static>>>,
    flusher: Flusher,
    retrace: Option<Retrace>,
    /// Whether something did not fit into the record's bound.
    is_at_bound: AtomicBool,
}

/// Transforms on their way into a document, by child and parent.
#[derive(Default)]
struct Groups {
    open: BTreeMap<(String, String), Vec<Sample>>,
    /// Span of [`Options::group_ns`] to which the open groups belong.
    span: i64,
}

impl Record {
    /// Makes a record in a folder.
    ///
    /// # Errors
    /// [`Error::Exists`], or what the system refuses.
    pub fn create(dir: &Path, options: Options) -> Result<Self, Error> {
        Ok(Self::local(LocalStore::create(dir, &options.robot, options.local())?, options))
    }

    /// Opens a record to go on with it; what a crash has left is mended.
    ///
    /// # Errors
    /// [`Error::NoRecord`], [`Error::InUse`], or what the system refuses.
    pub fn open(dir: &Path, options: Options) -> Result<Self, Error> {
        Ok(Self::local(LocalStore::open(dir, &options.robot, options.local())?, options))
    }

    /// Opens a record so that its maker lives through it again and goes on where it was cut off: a single document, cloud, image or
    /// transform that is put as it stands in the record, in the order of its kind, is taken for the one there and not written twice.
    ///
    /// # Errors
    /// As [`Record::open`].
    pub fn resume(dir: &Path, options: Options) -> Result<Self, Error> {
        Self::open(dir, options)?.retracing()
    }

    /// The same on any store; see [`Record::resume`].
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn retracing(mut self) -> Result<Self, Error> {
        self.retrace = Some(Retrace::of(&*self.store, &self.options.robot)?);
        Ok(self)
    }

    /// Opens a record to read it, beside a process that may be writing.
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

    /// A record on any store.
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

    /// Damage that opening found and mended.
    pub fn recovery(&self) -> &Recovery {
        &self.recovery
    }

    /// The store beneath.
    pub fn store(&self) -> &dyn Store {
        &*self.store
    }

    /// Records a cloud, in `frame` (a camera's optical frame, for [`Record::view_at`]).
    ///
    /// # Errors
    /// [`Error::Input`] if its parts do not fit together; [`Error::Full`].
    pub fn put_cloud(
        &self,
        stamp_ns: i64,
        frame: &str,
        cloud: &Cloud,
        sensing: &Sensing,
        meta: Meta,
    ) -> Result<RecordId, Error> {
        cloud.check().map_err(|e| Error::Input { what: e.to_string(), mend: "mend the cloud".into() })?;
        let camera = sensing.intrinsics.as_ref().map(|camera| viewer::calibration(stamp_ns, frame, camera));
        let blobs = std::iter::once(clouds::encode(cloud, sensing)).chain(camera).collect();
        self.put(Draft { frame: frame.into(), meta, blobs, ..Draft::new(kind::CLOUD, stamp_ns) })
    }

    /// Records a sweep of a laser, in `frame`; where it was taken from, the transforms of its time say.
    ///
    /// # Errors
    /// [`Error::Input`] if it is unsound, or its angles are not at even steps; [`Error::Full`].
    pub fn put_scan(&self, stamp_ns: i64, frame: &str, scan: &Scan, meta: Meta) -> Result<RecordId, Error> {
        let blobs = vec![scans::encode(scan)?];
        self.put(Draft { frame: frame.into(), meta, blobs, ..Draft::new(kind::SCAN, stamp_ns) })
    }

    /// Records an image, in `frame`.
    ///
    /// # Errors
    /// [`Error::Input`] if its pixels do not fit its size; [`Error::Full`].
    pub fn put_image(&self, stamp_ns: i64, frame: &str, image: Image, meta: Meta) -> Result<RecordId, Error> {
        self.put(image_draft(stamp_ns, frame, image, meta)?)
    }

    /// The same together with what is put next: see [`Record::put_soon`].
    ///
    /// # Errors
    /// As [`Record::put_image`].
    pub fn put_image_soon(&self, stamp_ns: i64, frame: &str, image: Image, meta: Meta) -> Result<(), Error> {
        let Draft { kind, end_ns, frame, kept, meta, blobs, .. } = image_draft(stamp_ns, frame, image, meta)?;
        let blobs =
            blobs.into_iter().map(|blob| Blob { data: blob.data.into_owned().into(), ..blob }).collect();
        self.put_soon(Draft { kind, stamp_ns, end_ns, frame, kept, meta, blobs })
    }

    /// Records where a frame stood. It is there for lookups at once, on the disk when its group is full or at [`Record::sync`].
    ///
    /// # Errors
    /// [`transforms::TransformError::Invalid`], or the failure of an earlier group to reach the disk; then this one was not taken.
    pub fn put_transform(
        &self,
        stamp_ns: i64,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<(), Error> {
        if self.flusher.has_failed() {
            self.flusher.drain()?;
        }
        let sample = Sample { stamp_ns, parent_from_child: *parent_from_child };
        if !self.is_news(parent, child, &sample)? {
            return Ok(());
        }
        let span = stamp_ns / self.options.group_ns.max(1);
        let mut groups = self.groups.lock().unwrap_or_else(PoisonError::into_inner);
        // Stamps of several sources interleave; only a later span closes the open one.
        if span > groups.span {
            self.flusher.send(groups.take());
            groups.span = span;
        }
        groups.open.entry((child.into(), parent.into())).or_default().push(sample);
        Ok(())
    }

    /// Records where a frame stood together with what is put next: see [`Record::put_soon`].
    ///
    /// # Errors
    /// As [`Record::put_transform`].
    pub fn put_transform_soon(
        &self,
        stamp_ns: i64,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<(), Error> {
        let sample = Sample { stamp_ns, parent_from_child: *parent_from_child };
        if !self.is_news(parent, child, &sample)? {
            return Ok(());
        }
        let group = Group { parent: parent.into(), child: child.into(), samples: vec![sample] };
        // What is there already was told by its stamp, not by its turn.
        self.hold_back(group.draft(kind::TRANSFORMS));
        Ok(())
    }

    /// True if a measured transform is not in the record yet.
    ///
    /// # Errors
    /// If it is unsound, or contradicts what is there.
    fn is_news(&self, parent: &str, child: &str, sample: &Sample) -> Result<bool, Error> {
        let stamp_ns = sample.stamp_ns;
        transforms::check(stamp_ns, parent, child, &sample.parent_from_child)?;
        if stamp_ns < 0 {
            return Err(Error::Input {
                what: format!("the stamp {stamp_ns} ns is negative"),
                mend: "count from the start of the recording".into(),
            });
        }
        Ok(!self.is_measured(parent, child, sample)?)
    }

    /// Records a transform that holds at all times for which nothing was measured.
    ///
    /// # Errors
    /// [`transforms::TransformError::Invalid`], [`Error::Full`].
    pub fn put_static_transform(
        &self,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<RecordId, Error> {
        transforms::check(0, parent, child, parent_from_child)?;
        let sample = Sample { stamp_ns: 0, parent_from_child: *parent_from_child };
        let group = Group { parent: parent.into(), child: child.into(), samples: vec![sample] };
        self.put(group.draft(kind::STATIC_TRANSFORM))
    }

    /// Records a document of any kind, with blobs beside it.
    ///
    /// # Errors
    /// [`Error::Input`] for what could not be found again; [`Error::Full`].
    pub fn put_document(
        &self,
        kind: &str,
        stamp_ns: i64,
        body: Value,
        blobs: Vec<Blob>,
    ) -> Result<RecordId, Error> {
        self.put(Draft { meta: Meta { body, ..Meta::default() }, blobs, ..Draft::new(kind, stamp_ns) })
    }

    /// Records a line of the log; `name` says whose.
    ///
    /// # Errors
    /// [`Error::Full`].
    pub fn put_log(
        &self,
        stamp_ns: i64,
        level: LogLevel,
        name: &str,
        message: &str,
    ) -> Result<RecordId, Error> {
        let meta = Meta {
            body: json!({ "level": format!("{level:?}").to_lowercase(), "name": name, "message": message }),
            ..Meta::default()
        };
        let blobs = vec![viewer::log(stamp_ns, level, name, message)];
        self.put(Draft { meta, blobs, ..Draft::new(kind::LOG, stamp_ns) })
    }

    /// Records a draft as it is.
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

    /// Records a draft together with what is put next, so that many small ones cost one wait for the disk. It is acknowledged with
    /// that one, or by [`Record::sync`].
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

    /// Whether something did not fit into the bound of the record, so that nothing more can be recorded.
    pub fn is_at_bound(&self) -> bool {
        self.is_at_bound.load(Ordering::Relaxed)
    }

    /// Records several drafts, all or none.
    ///
    /// # Errors
    /// As [`Store::append`].
    pub fn put_all(&self, drafts: &[Draft]) -> Result<Vec<RecordId>, Error> {
        self.append(drafts)
    }

    /// Brings everything to the disk, open groups of transforms included.
    ///
    /// # Errors
    /// If it cannot be brought there; it is kept and tried again.
    pub fn sync(&self) -> Result<(), Error> {
        self.flush_open()?;
        self.flush_soon()?;
        self.store.sync()
    }

    /// Documents that meet a query.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn find(&self, query: &Query) -> Result<Vec<Document>, Error> {
        self.store.find(query)
    }

    /// Documents that meet a query and are whole to the last byte of their blobs, and the faults of
    /// the others.
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

    /// The newest of a kind.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn newest(&self, kind: &str) -> Result<Option<Document>, Error> {
        let query = Query { order: crate::document::Order::Newest, limit: Some(1), ..self.own(kind) };
        Ok(self.store.find(&query)?.pop())
    }

    /// The record of a kind nearest in time, within a tolerance.
    ///
    /// # Errors
    /// [`Error::NotNear`] with the nearest there is.
    pub fn nearest(&self, kind: &str, stamp_ns: i64, tolerance_ns: i64) -> Result<Document, Error> {
        self.nearest_of(&self.own(kind), stamp_ns, tolerance_ns)
    }

    /// Document nearest in time among those that meet a query, within a tolerance.
    ///
    /// # Errors
    /// [`Error::NotNear`] with the nearest there is.
    pub fn nearest_of(&self, query: &Query, stamp_ns: i64, tolerance_ns: i64) -> Result<Document, Error> {
        let nearest = self.store.nearest(query, stamp_ns)?;
        let nearest_ns = nearest.as_ref().map(|d| d.stamp_ns);
        nearest.filter(|d| d.stamp_ns.abs_diff(stamp_ns) <= tolerance_ns.max(0) as u64).ok_or_else(|| {
            let kind = query.kind.as_deref().unwrap_or("record");
            let what = query.frame.as_ref().map_or(kind.to_owned(), |f| format!("{kind} in `{f}`"));
            Error::NotNear { what, stamp_ns, tolerance_ns, nearest_ns }
        })
    }

    /// Keeps records from being pruned, in the name of `by` (a belief, a model, a plan); clouds with the transforms of their time.
    ///
    /// # Errors
    /// [`Error::Missing`] if one is not there; then none is pinned.
    pub fn pin(&self, ids: &[RecordId], by: &str) -> Result<(), Error> {
        self.store.pin(&self.with_their_place(ids)?, by)
    }

    /// Pins these records as [`Record::pin`] does, and no others, in the name of `by`: what it cites now, in place of what it cited
    /// before.
    ///
    /// # Errors
    /// [`Error::Missing`] if one is not there; then what it held before stays pinned.
    pub fn hold(&self, ids: &[RecordId], by: &str) -> Result<(), Error> {
        let ids = self.with_their_place(ids)?;
        match &self.retrace {
            Some(retrace) if retrace.next_pins(&*self.store, &ids, by)? => Ok(()),
            _ => self.store.hold(&ids, by),
        }
    }

    /// Takes back every pin in the name of `by`.
    ///
    /// # Errors
    /// If the store cannot be written.
    pub fn unpin(&self, by: &str) -> Result<(), Error> {
        self.store.unpin(by)
    }

    /// Writes what a query finds, in the order of time, into one MCAP file.
    ///
    /// # Errors
    /// As [`crate::export`].
    pub fn export(&self, query: &Query, path: &Path) -> Result<crate::Exported, Error> {
        crate::export::export(&*self.store, query, path)
    }

    /// Reads every record and says what is whole.
    ///
    /// # Errors
    /// If the store itself cannot be read.
    pub fn verify(&self) -> Result<Report, Error> {
        self.store.verify()
    }

    /// Counts and sizes.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn stats(&self) -> Result<Stats, Error> {
        self.store.stats()
    }
}

/// An image as it is recorded.
fn image_draft<'a>(stamp_ns: i64, frame: &str, image: Image<'a>, meta: Meta) -> Result<Draft<'a>, Error> {
    let (form, layout, data) = match image {
        Image::Compressed { format, data } => (Form::CompressedImage, json!({ "format": format }), data),
        Image::Raw { width, height, encoding, data } => {
            let step = data.len() / height.max(1) as usize;
            if width == 0
                || step == 0
                || step * height as usize != data.len()
                || !step.is_multiple_of(width as usize)
            {
                return Err(Error::Input {
                    what: format!("{} bytes are no image of {width} x {height} pixels", data.len()),
                    mend: "give every row the same number of bytes, and each pixel as well".into(),
                });
            }
            (
                Form::RawImage,
                json!({ "width": width, "height": height, "encoding": encoding, "step": step }),
                data,
            )
        }
    };
    let blobs = vec![Blob { name: "image".into(), form, layout, data: data.into() }];
    Ok(Draft { frame: frame.into(), meta, blobs, ..Draft::new(kind::IMAGE, stamp_ns) })
}

impl Groups {
    fn take(&mut self) -> Vec<Group> {
        let open = std::mem::take(&mut self.open);
        open.into_iter().map(|((child, parent), samples)| Group { parent, child, samples }).collect()
    }
}

impl Drop for Record {
    /// Writes what is open. Who must know whether that succeeded calls [`Record::sync`] first.
    fn drop(&mut self) {
        if let Err(e) = self.flush_open().and_then(|()| self.flush_soon()) {
            tracing::warn!("something was lost at the end of the record: {e}");
        }
    }
}

impl Record {
    /// Query for all documents of a kind by this robot; by any robot, if robots have no names.
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
