//! Opening of a store: reconciles the segments and the index.
//!
//! The index is used as it is if it equals its state at closing, or if a process is writing it. Otherwise it
//! is rebuilt from the segments: on the disk by a writer, in memory by a reader.

use super::closed::Closed;
use super::index::{INDEX, Index, Place, SegmentRow};
use super::scan::{self, Scan, scan};
use super::segment::Segment;
use super::{Durability, Recovery, lock, pins, segment_dir, segment_path};
use crate::document::{Document, RecordId};
use crate::error::Error;
use crate::stores::Fault;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// An opened store, with the damage that was found.
pub(super) struct Opened {
    pub index: Index,
    /// Length of each segment in bytes, by the segment's number.
    pub segments: BTreeMap<u64, u64>,
    /// Number of the next segment.
    pub next_segment: u64,
    pub recovery: Recovery,
}

/// Maximum number of attempts to read a store that seems neither written nor closed, since it may be opening
/// or closing right now.
const LOOKS: usize = 3;

/// Opens a store for this process alone to write, and repairs the traces of a crash. `written` is the
/// durability under which it was recorded.
///
/// # Errors
/// [`Error::Faulty`] if anything is damaged; then nothing is changed. [`Error::Damaged`] for an index of a
/// newer version, or what the system refuses.
pub(super) fn for_writing(dir: &Path, log_bytes: u64, written: Durability) -> Result<Opened, Error> {
    let closed = Closed::read(dir);
    let whole = closed.as_ref().is_some_and(|closed| is_as_closed(dir, closed));
    let mut old = Old::read(dir, closed)?;
    // It is about to be moved away.
    old.index = None;
    let opened = if whole && old.is_current {
        Index::open(dir, log_bytes).and_then(|index| look_over(dir, index)).and_then(without_faults)?
    } else {
        move_index(dir, "", OLD)?;
        let made =
            Index::open(dir, log_bytes).and_then(|index| Rebuild::new(dir, index, old, Some(written)).run());
        made.and_then(without_faults).or_else(|e| move_index(dir, OLD, "").and(Err(as_read(dir, e))))?
    };
    Closed::remove(dir)?;
    for path in index_files(dir, OLD) {
        drop(fs::remove_file(path));
    }
    Ok(opened)
}

/// Replaces the faults of a refusal to write by those that a reader finds, since the old index may prove some
/// records undamaged.
fn as_read(dir: &Path, refused: Error) -> Error {
    let Error::Faulty { place, faults } = refused else { return refused };
    let read = Old::read(dir, Closed::read(dir))
        .and_then(|old| Rebuild::new(dir, Index::in_memory(dir)?, old, None).run());
    let found = read.map(|opened| opened.recovery.faults).unwrap_or_default();
    Error::Faulty { place, faults: if found.is_empty() { faults } else { found } }
}

/// Suffix of the old index's files during a rebuild.
const OLD: &str = ".old";

fn index_files(dir: &Path, ending: &str) -> [PathBuf; 3] {
    ["", "-wal", "-shm"].map(|suffix| dir.join(format!("{INDEX}{suffix}{ending}")))
}

/// Renames the files of the index from one suffix to another, replacing existing files.
fn move_index(dir: &Path, from: &str, to: &str) -> Result<(), Error> {
    for (from, to) in index_files(dir, from).iter().zip(index_files(dir, to)) {
        let gone = if from.exists() { fs::rename(from, &to) } else { fs::remove_file(&to) };
        match gone {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::file("cannot move", &to, e));
            }
            _ => (),
        }
    }
    Ok(())
}

fn without_faults(opened: Opened) -> Result<Opened, Error> {
    if opened.recovery.faults.is_empty() {
        return Ok(opened);
    }
    Err(Error::Faulty { place: opened.index.dir.clone(), faults: opened.recovery.faults })
}

/// Opens a store for reading, without any change to it.
///
/// # Errors
/// As [`for_writing`].
pub(super) fn for_reading(dir: &Path) -> Result<Opened, Error> {
    for _ in 0..LOOKS {
        let is_written = lock::is_written(dir);
        let closed = Closed::read(dir);
        if !is_written && !closed.is_some_and(|closed| is_as_closed(dir, &closed)) {
            continue;
        }
        if let Ok(index) = Index::open_shared(dir)
            && index.is_current()?
            && (!is_written || index.check().is_ok_and(|faults| faults.is_empty()))
        {
            let opened = look_over(dir, index)?;
            // In a segment of another length records may lie elsewhere than the index says.
            if is_written || opened.recovery.faults.is_empty() {
                return Ok(opened);
            }
        }
    }
    let old = Old::read(dir, Closed::read(dir))?;
    Rebuild::new(dir, Index::in_memory(dir)?, old, None).run()
}

/// True if the index equals its state at closing, and no segment was added since.
fn is_as_closed(dir: &Path, closed: &Closed) -> bool {
    let known = |number: &u64| closed.segments.contains_key(number);
    closed.has_index(dir) && on_disk(dir).is_ok_and(|found| found.numbers.iter().all(known))
}

/// Content of the folder of segments.
#[derive(Default)]
struct OnDisk {
    /// Numbers of the segments.
    numbers: BTreeSet<u64>,
    /// Faults of MCAP files without the name of a segment.
    strays: Vec<Fault>,
}

/// Lists the folder of segments.
fn on_disk(dir: &Path) -> Result<OnDisk, Error> {
    let folder = segment_dir(dir);
    let fail = |e| Error::file("cannot read", &folder, e);
    let mut found = OnDisk::default();
    for entry in fs::read_dir(&folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let number = name.strip_suffix(".mcap").and_then(|n| n.parse().ok());
        match number.filter(|number| segment_path(dir, *number) == path) {
            Some(number) => drop(found.numbers.insert(number)),
            None if name.ends_with(".mcap") || scan::is_mcap(&path) => {
                found.strays.push(stray(&path));
            }
            None => (),
        }
    }
    found.strays.sort_by(|a, b| a.place.cmp(&b.place));
    Ok(found)
}

/// Fault of an MCAP file without the name of a segment.
fn stray(path: &Path) -> Fault {
    let what = "is no segment by its name, and its records are not read: segments are named as in \
                00000001.mcap; give it its number back, or move it elsewhere";
    Fault { record: None, place: path.display().to_string(), what: what.into() }
}

/// Length of a segment, bytes; `None` if it is missing or is no regular file.
fn length(dir: &Path, number: u64) -> Option<u64> {
    fs::metadata(segment_path(dir, number)).ok().filter(fs::Metadata::is_file).map(|m| m.len())
}

/// Opens a store by its trusted index, and checks that the segments are as the index says.
fn look_over(dir: &Path, index: Index) -> Result<Opened, Error> {
    let mut recovery = Recovery { faults: on_disk(dir)?.strays, ..Recovery::default() };
    let rows = index.segments()?;
    let next_segment = rows.last().map_or(0, |row| row.number) + 1;
    let mut segments = BTreeMap::new();
    for row in rows {
        let found = length(dir, row.number);
        if row.going {
            continue;
        }
        segments.insert(row.number, row.bytes);
        // One that still grows is at least as long as the index says.
        let what = match found {
            None => "is missing".to_owned(),
            Some(n) if n < row.bytes => format!("is cut at byte {n} of {}", row.bytes),
            Some(n) if n > row.bytes && row.sealed => format!("has {} bytes too many", n - row.bytes),
            Some(_) => continue,
        };
        let end = found.unwrap_or(0);
        let places = index.places(row.number, false)?;
        let lost = places.iter().filter(|p| p.located.document.at + p.located.document_bytes > end);
        let what = format!("{what}{}", lost_text(&lost.map(|p| p.id).collect()));
        recovery.faults.push(fault(dir, row.number, what));
    }
    Ok(Opened { index, segments, next_segment, recovery })
}

fn fault(dir: &Path, segment: u64, what: String) -> Fault {
    Fault { record: None, place: segment_path(dir, segment).display().to_string(), what }
}

/// Numbers of lost records as text, with ranges.
fn lost_text(lost: &BTreeSet<RecordId>) -> String {
    let mut ranges: Vec<(u64, u64)> = Vec::new();
    for id in lost {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == id.0 => *last = id.0,
            _ => ranges.push((id.0, id.0)),
        }
    }
    let text = |(first, last): &(u64, u64)| match first == last {
        true => first.to_string(),
        false => format!("{first} to {last}"),
    };
    let all: Vec<String> = ranges.iter().map(text).collect();
    match lost.len() {
        0 => "; no record is lost".into(),
        1 => format!("; record {} is lost", all.concat()),
        n => format!("; {n} records are lost: {}", all.join(", ")),
    }
}

/// Readable remains of an index that is to be rebuilt.
#[derive(Default)]
struct Old {
    closed: Option<Closed>,
    is_current: bool,
    /// The old index itself, kept open for readers only.
    index: Option<Index>,
    rows: BTreeMap<u64, SegmentRow>,
    /// Numbers of the records of each segment, by segment.
    records: BTreeMap<u64, BTreeSet<RecordId>>,
    next: u64,
}

impl Old {
    /// Reads what remains of the index of a store.
    ///
    /// # Errors
    /// [`Error::Damaged`] for an index of a newer version.
    fn read(dir: &Path, closed: Option<Closed>) -> Result<Self, Error> {
        let mut old = Old { closed, ..Old::default() };
        let Ok(index) = Index::open_shared(dir) else { return Ok(old) };
        old.is_current = match index.is_current() {
            Err(newer @ Error::Damaged { .. }) => return Err(newer),
            is_current => is_current.unwrap_or(false),
        };
        old.rows = index.segments().unwrap_or_default().into_iter().map(|row| (row.number, row)).collect();
        for (id, segment) in index.numbers().unwrap_or_default() {
            old.records.entry(segment).or_default().insert(id);
        }
        old.next = index.next_id().map_or(0, |id| id.0);
        old.index = Some(index);
        Ok(old)
    }

    /// Locations of some records of a segment, as far as the old index has them.
    fn places(&self, segment: u64, ids: &BTreeSet<RecordId>) -> Vec<Place> {
        let places = self.index.as_ref().and_then(|index| index.places(segment, false).ok());
        places.unwrap_or_default().into_iter().filter(|place| ids.contains(&place.id)).collect()
    }

    /// Length of a segment that was complete, bytes; `None` for any other.
    fn sealed(&self, number: u64) -> Option<u64> {
        let row = self.rows.get(&number).filter(|row| row.sealed).map(|row| row.bytes);
        row.or_else(|| self.closed.as_ref()?.segments.get(&number).copied())
    }

    /// Numbers of the segments that must exist. A segment marked for deletion may be missing.
    fn expected(&self) -> BTreeSet<u64> {
        let closed = self.closed.iter().flat_map(|closed| closed.segments.keys());
        let all = closed.chain(self.rows.keys()).copied();
        all.filter(|number| self.rows.get(number).is_none_or(|row| !row.going)).collect()
    }
}

/// Rebuild of an index from the segments.
struct Rebuild<'a> {
    dir: &'a Path,
    index: Index,
    old: Old,
    /// Durability of repairs, which truncate torn ends and complete segments unless a record is damaged;
    /// `None` repairs nothing.
    mends: Option<Durability>,
    /// Segments with a torn end or without a summary.
    unfinished: Vec<(u64, Scan)>,
    segments: BTreeMap<u64, u64>,
    recovery: Recovery,
    /// Documents that change pins, by record number.
    of_pins: BTreeMap<RecordId, Document>,
    found: BTreeSet<RecordId>,
}

impl<'a> Rebuild<'a> {
    fn new(dir: &'a Path, index: Index, old: Old, mends: Option<Durability>) -> Self {
        Rebuild {
            dir,
            index,
            old,
            mends,
            unfinished: Vec::new(),
            segments: BTreeMap::new(),
            recovery: Recovery::default(),
            of_pins: BTreeMap::new(),
            found: BTreeSet::new(),
        }
    }

    fn run(mut self) -> Result<Opened, Error> {
        let OnDisk { numbers: there, strays } = on_disk(self.dir)?;
        self.recovery.faults.extend(strays);
        let expected = self.old.expected();
        let is_new = there.is_empty() && self.old.rows.is_empty();
        there.iter().try_for_each(|number| self.read(*number))?;
        for number in expected.difference(&there) {
            let known = self.old.records.get(number).cloned().unwrap_or_default();
            // A segment without a record is removed, and may still stand in an index that was not closed.
            if self.old.sealed(*number).is_some() || !known.is_empty() {
                let lost: BTreeSet<RecordId> = known.difference(&self.found).copied().collect();
                let lost = self.lost_text(*number, &lost);
                self.recovery.faults.push(fault(self.dir, *number, format!("is missing{lost}")));
            }
        }
        let said: Vec<Document> = self.of_pins.values().cloned().collect();
        self.index.pin_again(&said)?;
        let closed_next = self.old.closed.as_ref().map_or(0, |closed| closed.next);
        self.index.keep_numbers(RecordId(self.old.next.max(closed_next)))?;
        self.count(is_new);
        if self.mends.is_some() && self.recovery.faults.is_empty() {
            let unfinished = std::mem::take(&mut self.unfinished);
            unfinished.into_iter().try_for_each(|(number, scan)| self.finish(number, scan))?;
        }
        let last = there.last().max(expected.last()).copied().unwrap_or(0);
        let Rebuild { index, segments, recovery, .. } = self;
        Ok(Opened { index, segments, next_segment: last + 1, recovery })
    }

    /// Counts the regained records, and adds a fault if fewer records were found than the store had at
    /// closing.
    fn count(&mut self, is_new: bool) {
        let known: BTreeSet<RecordId> = self.old.records.values().flatten().copied().collect();
        self.recovery.regained = self.found.difference(&known).count() as u64;
        self.recovery.index_rebuilt = !is_new && (self.old.closed.is_some() || !self.old.is_current);
        let Some(closed) = &self.old.closed else { return };
        let missing = closed.records.saturating_sub(self.found.len() as u64);
        if missing > 0 {
            let what = format!("{missing} of {} records are lost", closed.records);
            let place = segment_dir(self.dir).display().to_string();
            self.recovery.faults.push(Fault { record: None, place, what });
        }
    }

    /// Reads the records of a segment into the index.
    fn read(&mut self, number: u64) -> Result<(), Error> {
        let path = segment_path(self.dir, number);
        let Some(bytes) = length(self.dir, number) else {
            self.recovery.faults.push(fault(self.dir, number, "is no file".into()));
            return Ok(());
        };
        // What the index knew of a segment that still grew was acknowledged, and nothing behind it.
        let acknowledged = self.old.rows.get(&number).filter(|row| !row.sealed).map(|row| row.bytes);
        let (index, of_pins) = (&mut self.index, &mut self.of_pins);
        let mut found = BTreeSet::new();
        let scan = scan(&path, acknowledged, |records, end| {
            let rows: Vec<_> = records.iter().map(|(d, l)| (d, l)).collect();
            index.insert(number, end, &rows)?;
            for (document, _) in records {
                found.insert(document.id);
                if pins::speaks(&document) {
                    of_pins.insert(document.id, document);
                }
            }
            Ok(())
        })?;
        let known = self.old.records.get(&number).into_iter().flatten();
        let mut lost: BTreeSet<RecordId> = known.filter(|id| !found.contains(id)).copied().collect();
        if !lost.is_empty() {
            let proven = self.proven(number, scan.end, &lost)?;
            lost.retain(|id| !proven.contains(id));
            found.extend(proven);
        }
        self.found.append(&mut found);
        self.judge(number, bytes, &scan, &lost);
        if self.old.sealed(number).is_none() && !scan.complete {
            // Beside somebody who writes, what stands behind the last record is no part of it.
            self.unfinished.push((number, scan));
            return Ok(());
        }
        self.segments.insert(number, bytes);
        self.index.seal(number, bytes)
    }

    /// Reports the faults of a segment that was read.
    fn judge(&mut self, number: u64, bytes: u64, scan: &Scan, lost: &BTreeSet<RecordId>) {
        let was_complete = self.old.sealed(number);
        let torn = scan.torn.iter().filter(|_| was_complete.is_some());
        for (at, what) in scan.damaged.iter().chain(torn) {
            self.recovery.faults.push(fault(self.dir, number, format!("byte {at}: {what}")));
        }
        match was_complete {
            Some(was) if bytes != was || !scan.damaged.is_empty() || !lost.is_empty() => {
                let what = format!("has {bytes} of {was} bytes{}", self.lost_text(number, lost));
                self.recovery.faults.push(fault(self.dir, number, what));
            }
            Some(_) => (),
            None => {
                let fault = (!lost.is_empty())
                    .then(|| fault(self.dir, number, format!("ends at byte {bytes}{}", lost_text(lost))));
                // The index knows what was acknowledged. Only after a power cut may less be on the disk, and
                // only if the disk was not waited for.
                if self.mends == Some(Durability::Process) && scan.damaged.is_empty() {
                    self.recovery.lost.extend(fault);
                } else {
                    self.recovery.faults.extend(fault);
                }
                self.recovery.dropped_bytes += if scan.complete { 0 } else { bytes - scan.end };
            }
        }
    }

    /// Numbers of the lost records of a segment as text; empty if the index that knew them is gone.
    fn lost_text(&self, segment: u64, lost: &BTreeSet<RecordId>) -> String {
        let is_known = self.old.records.get(&segment).is_some_and(|known| !known.is_empty());
        if is_known { lost_text(lost) } else { String::new() }
    }

    /// Adds to the index the records of damaged chunks that the checksums of the old index prove undamaged.
    fn proven(
        &mut self,
        number: u64,
        end: u64,
        lost: &BTreeSet<RecordId>,
    ) -> Result<BTreeSet<RecordId>, Error> {
        let path = segment_path(self.dir, number);
        let file = fs::File::open(&path).map_err(|e| Error::file("cannot read", &path, e))?;
        let mut proven = BTreeSet::new();
        for place in self.old.places(number, lost) {
            let Ok(document) = super::document_at(&file, &path, &place) else { continue };
            let mut blobs = document.blobs.iter().zip(&place.located.blobs);
            if blobs.all(|(info, spot)| super::read_at(&file, &path, &place, *spot, info.bytes).is_ok()) {
                self.index.insert(number, end, &[(&document, &place.located)])?;
                proven.insert(place.id);
                if pins::speaks(&document) {
                    self.of_pins.insert(document.id, document);
                }
            }
        }
        Ok(proven)
    }

    /// Cuts off the unfinished end of a segment and writes its summary; deletes a segment without any chunk.
    fn finish(&mut self, number: u64, scan: Scan) -> Result<(), Error> {
        let path = segment_path(self.dir, number);
        if scan.chunks.is_empty() {
            return fs::remove_file(&path).map_err(|e| Error::file("cannot delete", &path, e));
        }
        let mut segment = Segment::reopen(&path, number, scan.end, scan.channels, scan.chunks)?;
        segment.write(&[&scan.unwritten])?;
        let end = segment.finish()?;
        self.segments.insert(number, end);
        self.index.seal(number, end)
    }
}
