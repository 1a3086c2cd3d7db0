//! Store on the local disk: segments that any MCAP reader opens, with an index.
//!
//! A folder holds `segments/NNNNNNNN.mcap`, `index.sqlite`, `closed.json` while no process writes, and two
//! lock files. A batch of records is one chunk of a segment. The index follows from the segments and is
//! rebuilt from them after a crash, so that a crash loses unacknowledged data only. All data is verified
//! against its checksum when read.

mod closed;
mod index;
mod lock;
pub(crate) mod pins;
mod prune;
pub use prune::free_bytes;
mod recover;
mod scan;
pub(crate) mod segment;
mod verify;

use crate::document::{Document, Draft, Query, RecordId};
use crate::error::Error;
use crate::stores::{Fault, Pages, Report, Retention, Stats, Store, Take, no_blob};
use closed::Closed;
use index::{INDEX, Index, Place};
use lock::Writing;
use recover::Opened;
use segment::{Encoded, Segment, Spot};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Condition for acknowledging a write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Durability {
    /// The data is on the disk (`fdatasync`) before recording returns; it survives a power cut.
    #[default]
    Disk,
    /// The operating system has the data before recording returns; it survives any end of the process, and a
    /// power cut from the next [`Store::sync`] or change of segment on.
    Process,
}

/// Options of a local store.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalOptions {
    /// Condition for acknowledging a write.
    pub durability: Durability,
    /// Limits beyond which old data is pruned.
    pub retention: Retention,
    /// Length at which a segment is followed by another, bytes; with a size limit, at most a sixteenth of it.
    pub segment_bytes: u64,
}

impl Default for LocalOptions {
    fn default() -> Self {
        LocalOptions {
            durability: Durability::Disk,
            retention: Retention::default(),
            segment_bytes: 64 << 20,
        }
    }
}

/// Damage that was found when the store was opened, and repaired as far as possible.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recovery {
    /// Number of undamaged records in segments that were missing in the index.
    pub regained: u64,
    /// Number of bytes dropped behind the last complete record.
    pub dropped_bytes: u64,
    /// Records that the index has and the disk does not, for each segment: a power cut may lose them under
    /// [`Durability::Process`].
    pub lost: Vec<Fault>,
    /// True if the index was damaged and rebuilt from the segments.
    pub index_rebuilt: bool,
    /// Missing, truncated or damaged parts. A store with faults cannot be opened for writing.
    pub faults: Vec<Fault>,
}

/// State of the writing process.
struct WriteState {
    segment: Segment,
    /// Segment that receives the pinned records of pruned segments, once there is one.
    kept: Option<Segment>,
    next_id: RecordId,
    next_segment: u64,
    /// Total length of all finished segments, bytes.
    sealed_bytes: u64,
    newest_ns: i64,
    /// True if data was written since the last sync.
    unsynced: bool,
    _writing: Writing,
}

/// A store in a folder.
pub struct LocalStore {
    dir: PathBuf,
    robot: String,
    options: LocalOptions,
    recovery: Recovery,
    writer: Option<Mutex<WriteState>>,
    index: Mutex<Index>,
    files: Mutex<BTreeMap<u64, Arc<File>>>,
}

/// Maximum number of segments kept open for reading.
const OPEN_FILES: usize = 64;

impl LocalStore {
    /// Creates a store in a folder that holds no store.
    ///
    /// # Errors
    /// [`Error::Exists`], or what the system refuses.
    pub fn create(dir: &Path, robot: &str, options: LocalOptions) -> Result<Self, Error> {
        let exists = || dir.join(INDEX).exists() || segment_dir(dir).exists();
        if exists() {
            return Err(Error::Exists { place: dir.to_owned() });
        }
        fs::create_dir_all(dir).map_err(|e| Error::file("cannot create", dir, e))?;
        let writing = lock::lock(dir)?;
        // Another may have been quicker.
        if exists() {
            return Err(Error::Exists { place: dir.to_owned() });
        }
        fs::create_dir(segment_dir(dir)).map_err(|e| Error::file("cannot create", dir, e))?;
        Self::to_write(dir, robot, options, writing)
    }

    /// Opens a store for writing and repairs the traces of a crash. `dir` is its folder, or that of a run
    /// that holds it as `record`.
    ///
    /// # Errors
    /// [`Error::NoRecord`], [`Error::InUse`], [`Error::Faulty`] if anything is lost, or what the system
    /// refuses.
    pub fn open(dir: &Path, robot: &str, options: LocalOptions) -> Result<Self, Error> {
        let dir = &folder(dir)?;
        Self::to_write(dir, robot, options, lock::lock(dir)?)
    }

    /// Opens a store for reading, whether or not a process is writing it. Nothing in the folder is changed or
    /// locked; [`LocalStore::recovery`] reports damage.
    ///
    /// # Errors
    /// [`Error::NoRecord`], or what the system refuses.
    pub fn open_shared(dir: &Path) -> Result<Self, Error> {
        let dir = folder(dir)?;
        let Opened { index, recovery, .. } = recover::for_reading(&dir)?;
        Ok(LocalStore {
            index: Mutex::new(index),
            dir,
            robot: String::new(),
            options: LocalOptions::default(),
            recovery,
            writer: None,
            files: Mutex::default(),
        })
    }

    fn to_write(dir: &Path, robot: &str, mut options: LocalOptions, writing: Writing) -> Result<Self, Error> {
        let mut log_bytes = u64::MAX;
        if let Some(bound) = options.retention.max_bytes {
            options.segment_bytes = options.segment_bytes.min(bound / 16).max(64 << 10);
            log_bytes = bound / 64;
        }
        let Opened { index, segments, next_segment, recovery } =
            recover::for_writing(dir, log_bytes, options.durability)?;
        let segment = new_segment(dir, next_segment)?;
        let writer = WriteState {
            segment,
            kept: None,
            next_id: index.next_id()?,
            next_segment: next_segment + 1,
            sealed_bytes: segments.values().sum(),
            newest_ns: index.stats()?.newest_ns.unwrap_or(i64::MIN),
            unsynced: false,
            _writing: writing,
        };
        Ok(LocalStore {
            dir: dir.to_owned(),
            robot: robot.into(),
            options,
            recovery,
            writer: Some(Mutex::new(writer)),
            index: Mutex::new(index),
            files: Mutex::default(),
        })
    }

    /// Damage that was found when the store was opened.
    pub fn recovery(&self) -> &Recovery {
        &self.recovery
    }

    /// Folder of the store.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    fn writer(&self) -> Result<MutexGuard<'_, WriteState>, Error> {
        let writer = self.writer.as_ref().ok_or_else(|| Error::Input {
            what: format!("{} was opened for reading", self.dir.display()),
            mend: "open it with `Record::open` to write".into(),
        })?;
        Ok(unpoisoned(writer))
    }

    fn index(&self) -> MutexGuard<'_, Index> {
        unpoisoned(&self.index)
    }

    /// Writes a batch of numbered records, regardless of limits.
    fn write(&self, writer: &mut WriteState, batch: &[Encoded]) -> Result<(), Error> {
        if writer.segment.is_long(self.options.segment_bytes) {
            self.roll(writer)?;
        }
        let before = writer.segment.end;
        let located = writer.segment.append(batch)?;
        let rows: Vec<_> = batch.iter().map(|r| &r.document).zip(&located).collect();
        let kept = if self.options.durability == Durability::Disk { writer.segment.sync() } else { Ok(()) }
            .and_then(|()| self.index().insert(writer.segment.number, writer.segment.end, &rows));
        if kept.is_err() {
            writer.segment.take_back(before)?;
        }
        writer.unsynced |= self.options.durability == Durability::Process;
        kept
    }

    /// Finishes the segment and starts the next.
    fn roll(&self, writer: &mut WriteState) -> Result<(), Error> {
        // The new one first: without room for it the old one stays open and nothing has changed.
        let next = new_segment(&self.dir, writer.next_segment)?;
        let bytes = match writer.segment.finish() {
            Ok(bytes) => bytes,
            Err(e) => {
                fs::remove_file(&next.path).map_err(|e| Error::file("cannot delete", &next.path, e))?;
                return Err(e);
            }
        };
        let number = writer.segment.number;
        writer.segment = next;
        writer.next_segment += 1;
        writer.sealed_bytes += bytes;
        writer.unsynced = false;
        self.index().seal(number, bytes)
    }

    /// Reads `length` bytes of a record at an offset, and verifies their checksum.
    fn read(&self, place: &Place, spot: Spot, length: u64) -> Result<Vec<u8>, Error> {
        let path = segment_path(&self.dir, place.segment);
        read_at(&*self.file(place, &path)?, &path, place, spot, length)
    }

    fn file(&self, place: &Place, path: &Path) -> Result<Arc<File>, Error> {
        let mut files = unpoisoned(&self.files);
        if let Some(file) = files.get(&place.segment) {
            return Ok(file.clone());
        }
        let file = File::open(path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => Error::Missing { id: place.id.0 },
            _ => Error::file("cannot open", path, e),
        })?;
        if files.len() >= OPEN_FILES {
            files.pop_first();
        }
        let file = Arc::new(file);
        files.insert(place.segment, file.clone());
        Ok(file)
    }

    fn document(&self, place: &Place) -> Result<Document, Error> {
        let path = segment_path(&self.dir, place.segment);
        document_at(&*self.file(place, &path)?, &path, place)
    }

    /// Pins records on behalf of `by`, in place of the former pins of `by` if `instead`.
    fn pin_records(&self, ids: &[RecordId], by: &str, instead: bool) -> Result<(), Error> {
        let mut writer = self.writer()?;
        for id in ids {
            self.place(*id)?;
        }
        let draft = pins::pinned(writer.newest_ns.max(0), ids, by, instead);
        self.record(&mut writer, &[draft])?;
        writer.segment.sync()
    }

    fn place(&self, id: RecordId) -> Result<Place, Error> {
        self.index().place(id)?.ok_or(Error::Missing { id: id.0 })
    }

    /// Reads a record at a place, or at the new place if it was moved since; `None` if it was pruned since.
    fn at<T>(&self, place: &Place, read: impl Fn(&Place) -> Result<T, Error>) -> Result<Option<T>, Error> {
        match read(place) {
            Err(Error::Missing { id }) => match self.index().place(RecordId(id))? {
                Some(moved) if moved.segment != place.segment => read(&moved).map(Some),
                Some(_) => Err(Error::Damaged {
                    place: segment_path(&self.dir, place.segment),
                    at: 0,
                    what: format!("record {id} is lost: the file is missing"),
                }),
                None => Ok(None),
            },
            read => read.map(Some),
        }
    }

    fn documents(&self, places: &[Place]) -> Result<Vec<Document>, Error> {
        let documents = places.iter().map(|place| self.at(place, |place| self.document(place)));
        documents.filter_map(Result::transpose).collect()
    }

    /// Reads a document and the bytes of its blobs.
    fn whole(&self, place: &Place) -> Result<(Document, Vec<Vec<u8>>), Error> {
        let document = self.document(place)?;
        let blobs = document.blobs.iter().zip(&place.located.blobs);
        let blobs =
            blobs.map(|(info, spot)| self.read(place, *spot, info.bytes)).collect::<Result<_, _>>()?;
        Ok((document, blobs))
    }

    /// Records a batch of drafts, in a segment and in the index.
    fn record(&self, writer: &mut WriteState, drafts: &[Draft]) -> Result<Vec<RecordId>, Error> {
        let mut batch = Vec::with_capacity(drafts.len());
        for (id, draft) in (writer.next_id.0..).zip(drafts) {
            let blobs = draft.blobs.iter().map(|b| b.data.as_ref()).collect();
            batch.push(Encoded { document: draft.document(RecordId(id), &self.robot)?, blobs });
        }
        let now_ns = drafts.iter().map(Draft::until_ns).max().unwrap_or(i64::MAX);
        self.make_room(writer, drafts, now_ns)?;
        loop {
            match self.write(writer, &batch) {
                Ok(()) => break,
                // What may be pruned makes room for what is new.
                Err(e) if e.is_full() && self.options.retention != Retention::default() => {
                    if self.drop_oldest(writer, now_ns)?.is_none() {
                        return Err(e);
                    }
                }
                Err(e) => return Err(e),
            }
        }
        writer.next_id.0 += batch.len() as u64;
        writer.newest_ns = writer.newest_ns.max(now_ns);
        let retention = self.options.retention;
        self.keep_within(writer, &retention, now_ns)?;
        Ok(batch.iter().map(|r| r.document.id).collect())
    }
}

impl Store for LocalStore {
    fn append(&self, drafts: &[Draft]) -> Result<Vec<RecordId>, Error> {
        if drafts.is_empty() {
            return Ok(Vec::new());
        }
        self.record(&mut *self.writer()?, drafts)
    }

    fn get(&self, id: RecordId) -> Result<Document, Error> {
        let place = self.place(id)?;
        self.documents(&[place])?.pop().ok_or(Error::Missing { id: id.0 })
    }

    fn blob(&self, id: RecordId, name: &str) -> Result<Vec<u8>, Error> {
        let blob = self.at(&self.place(id)?, |place| {
            let document = self.document(place)?;
            let found = document.blobs.iter().zip(&place.located.blobs).find(|(info, _)| info.name == name);
            let (info, spot) = found.ok_or_else(|| no_blob(&document, name))?;
            self.read(place, *spot, info.bytes)
        })?;
        blob.ok_or(Error::Missing { id: id.0 })
    }

    fn find(&self, query: &Query) -> Result<Vec<Document>, Error> {
        let places = self.index().find(query)?;
        self.documents(&places)
    }

    fn each_whole(&self, query: &Query, take: &mut Take) -> Result<Vec<Fault>, Error> {
        let mut faults = Vec::new();
        let mut pages = Pages::of(query);
        while let Some(query) = pages.next() {
            let places = self.index().find(&query)?;
            pages.was(places.len(), places.last().map(|p| (p.stamp_ns, p.id)));
            for place in places {
                match self.at(&place, |place| self.whole(place)) {
                    Ok(Some((document, blobs))) => take(document, blobs)?,
                    Ok(None) => (),
                    Err(e) => faults.push(Fault::of(place.id, e)?),
                }
            }
        }
        Ok(faults)
    }

    fn nearest(&self, query: &Query, stamp_ns: i64) -> Result<Option<Document>, Error> {
        let place = self.index().nearest(query, stamp_ns)?;
        place.map_or(Ok(None), |place| self.at(&place, |place| self.document(place)))
    }

    fn frames(&self, kind: &str) -> Result<Vec<String>, Error> {
        self.index().frames(kind)
    }

    fn pin(&self, ids: &[RecordId], by: &str) -> Result<(), Error> {
        self.pin_records(ids, by, false)
    }

    fn hold(&self, ids: &[RecordId], by: &str) -> Result<(), Error> {
        self.pin_records(ids, by, true)
    }

    fn unpin(&self, by: &str) -> Result<(), Error> {
        let mut writer = self.writer()?;
        let draft = pins::unpinned(writer.newest_ns.max(0), by);
        self.record(&mut writer, &[draft])?;
        writer.segment.sync()
    }

    fn pins(&self) -> Result<BTreeMap<RecordId, BTreeSet<String>>, Error> {
        self.index().pins()
    }

    fn sync(&self) -> Result<(), Error> {
        let mut writer = self.writer()?;
        if writer.unsynced {
            writer.segment.sync()?;
            writer.unsynced = false;
        }
        Ok(())
    }

    fn prune(&self, retention: &Retention) -> Result<u64, Error> {
        let mut writer = self.writer()?;
        if !writer.segment.chunks.is_empty() && !retention.eq(&Retention::default()) {
            self.roll(&mut writer)?;
        }
        self.keep_within(&mut writer, retention, i64::MAX)
    }

    fn stats(&self) -> Result<Stats, Error> {
        let mut stats = self.index().stats()?;
        stats.bytes = self.bytes_on_disk()?;
        Ok(stats)
    }

    fn verify(&self) -> Result<Report, Error> {
        verify::verify(self)
    }
}

impl Drop for LocalStore {
    /// Finishes the segment, so that viewers can seek in it, and writes `closed.json`. Without room on the
    /// disk, the next opening does this.
    fn drop(&mut self) {
        let Ok(mut writer) = self.writer() else { return };
        if let Err(e) = self.close(&mut writer) {
            tracing::warn!("{} is mended when it is next opened: {e}", self.dir.display());
        }
    }
}

impl LocalStore {
    fn close(&self, writer: &mut WriteState) -> Result<(), Error> {
        let mut index = self.index();
        if writer.segment.chunks.is_empty() {
            let path = &writer.segment.path;
            fs::remove_file(path).map_err(|e| Error::file("cannot delete", path, e))?;
        } else {
            index.seal(writer.segment.number, writer.segment.finish()?)?;
        }
        if let Some(mut kept) = writer.kept.take() {
            index.seal(kept.number, kept.finish()?)?;
        }
        let rows = index.segments()?.into_iter().filter(|row| !row.going);
        let segments = rows.map(|row| (row.number, row.bytes)).collect();
        let (records, next) = (index.stats()?.records, index.next_id()?.0);
        index.close()?;
        Closed::write(&self.dir, segments, records, next)
    }
}

/// Reads `length` bytes of a segment at an offset, and verifies their checksum.
fn read_at(file: &File, path: &Path, place: &Place, spot: Spot, length: u64) -> Result<Vec<u8>, Error> {
    let damaged = |what: String| Error::Damaged {
        place: path.to_owned(),
        at: spot.at,
        what: format!("record {} {what}", place.id),
    };
    let there = file.metadata().map_err(|e| Error::file("cannot read", path, e))?.len();
    if spot.at.checked_add(length).is_none_or(|end| end > there) {
        return Err(damaged(format!("is lost: it has {length} bytes there, and the file ends at {there}")));
    }
    let mut bytes = vec![0; usize::try_from(length).unwrap_or(0)];
    file.read_exact_at(&mut bytes, spot.at).map_err(|e| damaged(format!("cannot be read: {e}")))?;
    let found = crc32fast::hash(&bytes);
    if found != spot.crc32 {
        let written = spot.crc32;
        return Err(damaged(format!("is damaged: its checksum is {found:08x}, written was {written:08x}")));
    }
    Ok(bytes)
}

/// Reads the document at a place in a segment.
fn document_at(file: &File, path: &Path, place: &Place) -> Result<Document, Error> {
    let spot = place.located.document;
    let bytes = read_at(file, path, place, spot, place.located.document_bytes)?;
    let damaged = |what: String| Error::Damaged { place: path.to_owned(), at: spot.at, what };
    let document: Document = serde_json::from_slice(&bytes)
        .map_err(|e| damaged(format!("the document of record {} is no longer one: {e}", place.id)))?;
    if document.id != place.id {
        return Err(damaged(format!("record {} stands where {} should", document.id, place.id)));
    }
    Ok(document)
}

/// Acquires a lock even if a holder panicked, since the guarded data is verified on the disk anyway.
fn unpoisoned<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn segment_dir(dir: &Path) -> PathBuf {
    dir.join("segments")
}

fn segment_path(dir: &Path, number: u64) -> PathBuf {
    segment_dir(dir).join(format!("{number:08}.mcap"))
}

/// Folder of a store: the given one, or `record` in the folder of a run.
fn folder(named: &Path) -> Result<PathBuf, Error> {
    let found = [named.to_owned(), named.join("record")].into_iter().find(|dir| segment_dir(dir).is_dir());
    found.ok_or_else(|| Error::NoRecord { place: named.to_owned(), expected: "segments" })
}

/// Creates a segment and syncs its folder, so that the file is found after a power cut.
fn new_segment(dir: &Path, number: u64) -> Result<Segment, Error> {
    let path = segment_path(dir, number);
    let made = Segment::create(&path, number).and_then(|segment| {
        let folder = segment_dir(dir);
        File::open(&folder).and_then(|f| f.sync_all()).map_err(|e| Error::file("cannot sync", &folder, e))?;
        Ok(segment)
    });
    if made.as_ref().is_err_and(
        |e| !matches!(e, Error::File { because, .. } if because.kind() == std::io::ErrorKind::AlreadyExists),
    ) {
        drop(fs::remove_file(&path));
    }
    made
}
