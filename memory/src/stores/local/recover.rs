//! Opening after whatever happened: segments and index are brought together again.

use super::index::{INDEX, Index};
use super::segment::{Located, Segment};
use super::{Recovery, scan, segment_dir, segment_path};
use crate::document::Document;
use crate::error::Error;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Moves an index that cannot be read out of the way.
pub(super) fn set_aside(dir: &Path) -> Result<(), Error> {
    for suffix in ["", "-wal", "-shm"] {
        let path = dir.join(format!("{INDEX}{suffix}"));
        if path.exists() {
            let aside = dir.join(format!("{INDEX}{suffix}.broken"));
            fs::rename(&path, &aside).map_err(|e| Error::file("cannot move", &path, e))?;
        }
    }
    Ok(())
}

/// Brings segments and index together again. Returns the bytes of all segments and the next free number.
pub(super) fn recover(dir: &Path, index: &mut Index, recovery: &mut Recovery) -> Result<(u64, u64), Error> {
    let mut on_disk = BTreeSet::new();
    let folder = segment_dir(dir);
    let fail = |e| Error::file("cannot read", &folder, e);
    for entry in fs::read_dir(&folder).map_err(fail)? {
        let name = entry.map_err(fail)?.file_name();
        let number = name.to_str().and_then(|n| n.strip_suffix(".mcap")).and_then(|n| n.parse::<u64>().ok());
        on_disk.extend(number);
    }
    let known: BTreeMap<u64, _> = index.segments()?.into_iter().map(|row| (row.number, row)).collect();
    for row in known.values().filter(|row| row.going) {
        let path = segment_path(dir, row.number);
        if on_disk.remove(&row.number) {
            fs::remove_file(&path).map_err(|e| Error::file("cannot delete", &path, e))?;
        }
        index.forget(row.number)?;
    }
    let mut bytes = 0;
    for number in &on_disk {
        let row = known.get(number);
        bytes += match row {
            Some(row) if row.sealed => row.bytes,
            _ => recover_segment(dir, *number, row.map_or(0, |r| r.bytes), index, recovery)?,
        };
    }
    let last = on_disk.last().max(known.keys().next_back()).copied().unwrap_or(0);
    Ok((bytes, last + 1))
}

/// Takes in what a segment holds beyond what the index knows, drops its torn end and finishes it.
fn recover_segment(
    dir: &Path,
    number: u64,
    known: u64,
    index: &mut Index,
    recovery: &mut Recovery,
) -> Result<u64, Error> {
    let path = segment_path(dir, number);
    let length = fs::metadata(&path).map_err(|e| Error::file("cannot read", &path, e))?.len();
    let mut chunks: Vec<u64> = index.places(number, false)?.iter().map(|p| p.located.chunk).collect();
    chunks.sort_unstable();
    let mut take = |records: Vec<(Document, Located)>, end: u64| {
        if end <= known {
            return Ok(());
        }
        let rows: Vec<_> = records.iter().map(|(d, l)| (d, l)).collect();
        index.insert(number, end, &rows)?;
        recovery.regained += records.len() as u64;
        Ok(())
    };
    let scan = scan::scan(&path, &chunks, &mut take)?;
    if scan.end < known {
        recovery.lost += index.forget_from(number, scan.end)?;
    }
    if scan.chunks.is_empty() && scan.damaged.is_empty() {
        recovery.dropped_bytes += length;
        fs::remove_file(&path).map_err(|e| Error::file("cannot delete", &path, e))?;
        index.forget(number)?;
        return Ok(0);
    }
    let bytes = if scan.complete {
        length
    } else {
        recovery.dropped_bytes += length - scan.end;
        Segment::reopen(&path, number, scan.end, scan.channels, scan.chunks)?.finish()?
    };
    index.seal(number, bytes)?;
    Ok(bytes)
}
