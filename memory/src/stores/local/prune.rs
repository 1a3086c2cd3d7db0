//! Retention: whole segments are deleted, oldest first; their pinned records move to another segment.

use super::segment::Encoded;
use super::{INDEX, LocalStore, WriteState, new_segment, segment_path, unpoisoned};
use crate::document::Draft;
use crate::error::Error;
use crate::stores::Retention;
use std::fs;
use std::path::Path;

/// Free room on the disk that holds a folder, bytes.
///
/// # Errors
/// [`Error::File`] if the system cannot report it.
pub fn free_bytes(folder: &Path) -> Result<u64, Error> {
    let free = rustix::fs::statvfs(folder)
        .map_err(|e| Error::file("cannot ask for the room on", folder, e.into()))?;
    Ok(free.f_bavail.saturating_mul(free.f_frsize))
}

impl LocalStore {
    /// Makes room for drafts, under a size limit.
    ///
    /// # Errors
    /// [`Error::Bounded`] if pinned records, and records with data up to `now_ns`, leave too little.
    pub(super) fn make_room(
        &self,
        writer: &mut WriteState,
        drafts: &[Draft],
        now_ns: i64,
    ) -> Result<(), Error> {
        let Some(bound) = self.options.retention.max_bytes else { return Ok(()) };
        if writer.segment.is_long(self.options.segment_bytes) {
            self.roll(writer)?;
        }
        let coming: u64 = drafts.iter().flat_map(|d| &d.blobs).map(|b| b.data.len() as u64).sum();
        if self.bytes(writer) + coming <= bound {
            return Ok(());
        }
        self.index().empty_log()?;
        let refused = |staying: u64| {
            let place = self.dir.display().to_string();
            Err(Error::Bounded { place, bound, coming, staying, held: self.index().holders()? })
        };
        let must_fit = !drafts.iter().all(Draft::is_of_pins);
        let pinned = self.index().pinned_bytes()? + self.index_bytes();
        if must_fit && pinned + coming > bound {
            return refused(pinned);
        }
        while self.bytes(writer) + coming > bound {
            if self.drop_oldest(writer, now_ns)?.is_none() {
                return if must_fit { refused(self.bytes(writer)) } else { Ok(()) };
            }
        }
        Ok(())
    }

    /// Deletes the oldest segments until the limits hold or none can be deleted; segments with data up to
    /// `now_ns` or later stay. Returns the number of removed records.
    pub(super) fn keep_within(
        &self,
        writer: &mut WriteState,
        retention: &Retention,
        now_ns: i64,
    ) -> Result<u64, Error> {
        let mut gone = 0;
        if self.is_over(writer, retention)? && retention.max_bytes.is_some() {
            // What the index has yet to take in is no record: it goes first.
            self.index().empty_log()?;
        }
        while self.is_over(writer, retention)? {
            match self.drop_oldest(writer, now_ns)? {
                Some(records) => gone += records,
                None => break,
            }
        }
        Ok(gone)
    }

    fn is_over(&self, writer: &WriteState, retention: &Retention) -> Result<bool, Error> {
        if retention.max_bytes.is_some_and(|most| self.bytes(writer) > most) {
            return Ok(true);
        }
        if let Some(least) = retention.min_free_bytes
            && free_bytes(&self.dir)? < least
        {
            return Ok(true);
        }
        if let Some(age) = retention.max_age_ns
            && let Some((_, newest)) = self.index().oldest_segment()?
        {
            return Ok(newest < writer.newest_ns.saturating_sub(age));
        }
        Ok(false)
    }

    /// Total size of the store on the disk, the index included, bytes.
    fn bytes(&self, writer: &WriteState) -> u64 {
        let kept = writer.kept.as_ref().map_or(0, |k| k.end);
        writer.sealed_bytes + writer.segment.end + kept + self.index_bytes()
    }

    /// Deletes the oldest segment that has an unpinned record and returns the number of removed records;
    /// `None` if there is none, or if its data reaches `now_ns`: a cloud must not push out the transforms of
    /// its own time before both can be pinned.
    pub(super) fn drop_oldest(&self, writer: &mut WriteState, now_ns: i64) -> Result<Option<u64>, Error> {
        let Some((number, _)) = self.index().oldest_segment()? else { return Ok(None) };
        if self.index().lasts_until(number)?.is_some_and(|until| until >= now_ns) {
            return Ok(None);
        }
        self.carry_pinned(writer, number)?;
        self.index().mark_going(number)?;
        let path = segment_path(&self.dir, number);
        let bytes = fs::metadata(&path).map(|m| m.len()).unwrap_or(0);
        unpoisoned(&self.files).remove(&number);
        match fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::file("cannot delete", &path, e));
            }
            _ => writer.sealed_bytes = writer.sealed_bytes.saturating_sub(bytes),
        }
        self.index().forget(number).map(Some)
    }

    /// Copies the pinned records of a segment to the segment for pinned records, one record at a time.
    fn carry_pinned(&self, writer: &mut WriteState, number: u64) -> Result<(), Error> {
        let places = self.index().places(number, true)?;
        if places.is_empty() {
            return Ok(());
        }
        for place in &places {
            let document = self.document(place)?;
            let mut blobs = Vec::with_capacity(document.blobs.len());
            for (info, spot) in document.blobs.iter().zip(&place.located.blobs) {
                blobs.push(self.read(place, *spot, info.bytes)?);
            }
            let mut kept = match writer.kept.take() {
                Some(kept) if !kept.is_long(self.options.segment_bytes) => kept,
                full => {
                    if let Some(mut full) = full {
                        let bytes = full.finish()?;
                        writer.sealed_bytes += bytes;
                        self.index().seal(full.number, bytes)?;
                    }
                    let kept = new_segment(&self.dir, writer.next_segment)?;
                    writer.next_segment += 1;
                    kept
                }
            };
            let before = kept.end;
            let record = Encoded { document, blobs: blobs.iter().map(Vec::as_slice).collect() };
            let moved = kept.append(&[record]).and_then(|located| {
                kept.sync()?;
                let rows: Vec<_> = located.iter().map(|l| (place.id, l)).collect();
                self.index().relocate(kept.number, kept.end, &rows)
            });
            if moved.is_err() {
                kept.take_back(before)?;
            }
            writer.kept = Some(kept);
            moved?;
        }
        Ok(())
    }

    fn index_bytes(&self) -> u64 {
        let size =
            |suffix: &str| fs::metadata(self.dir.join(format!("{INDEX}{suffix}"))).map_or(0, |m| m.len());
        size("") + size("-wal") + size("-shm")
    }

    /// Total size of the segments and the index on the disk, bytes.
    pub(super) fn bytes_on_disk(&self) -> Result<u64, Error> {
        let segments = self.index().segments()?;
        let size = |number| fs::metadata(segment_path(&self.dir, number)).map_or(0, |m| m.len());
        Ok(segments.iter().map(|row| size(row.number)).sum::<u64>() + self.index_bytes())
    }
}
