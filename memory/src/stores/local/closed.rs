//! State of a store at its last closing, which reveals damage to the index and the loss of files.

use super::index::INDEX;
use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;

/// Name of the file, which exists while no process writes, and not after a crash.
const CLOSED: &str = "closed.json";

/// State of the store when it was closed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Closed {
    /// Sizes and checksums of the index and its write-ahead log.
    index: [Sum; 2],
    /// Length of each segment in bytes, by the segment's number.
    pub segments: BTreeMap<u64, u64>,
    /// Number of records.
    pub records: u64,
    /// Number of the next record.
    pub next: u64,
}

/// Size and checksum of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Sum {
    bytes: u64,
    crc32: u32,
}

impl Closed {
    /// Writes the state to the folder; the index must be closed.
    pub fn write(dir: &Path, segments: BTreeMap<u64, u64>, records: u64, next: u64) -> Result<(), Error> {
        let path = dir.join(CLOSED);
        let fail = |e| Error::file("cannot write", &path, e);
        let closed = Closed { index: sums(dir).map_err(fail)?, segments, records, next };
        let text = serde_json::to_string(&closed).map_err(|e| fail(e.into()))?;
        let fresh = dir.join(format!("{CLOSED}.new"));
        fs::write(&fresh, format!("{text}\n{:08x}\n", crc32fast::hash(text.as_bytes()))).map_err(fail)?;
        fs::rename(&fresh, &path).map_err(fail)
    }

    /// Reads the state; `None` while a process writes, after a crash, or if the file is damaged.
    pub fn read(dir: &Path) -> Option<Self> {
        let said = fs::read_to_string(dir.join(CLOSED)).ok()?;
        let (text, sum) = said.strip_suffix('\n')?.split_once('\n')?;
        (sum == format!("{:08x}", crc32fast::hash(text.as_bytes()))).then_some(())?;
        serde_json::from_str(text).ok()
    }

    /// True if the index is unchanged since the store was closed.
    pub fn has_index(&self, dir: &Path) -> bool {
        sums(dir).is_ok_and(|found| found == self.index)
    }

    /// Removes the file of the state, when a process begins to write.
    pub fn remove(dir: &Path) -> Result<(), Error> {
        let path = dir.join(CLOSED);
        match fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::file("cannot delete", &path, e)),
            _ => Ok(()),
        }
    }
}

/// Sizes and checksums of the index and its write-ahead log; a missing log counts as empty.
fn sums(dir: &Path) -> std::io::Result<[Sum; 2]> {
    let log = match sum(&dir.join(format!("{INDEX}-wal"))) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Sum::default(),
        log => log?,
    };
    Ok([sum(&dir.join(INDEX))?, log])
}

fn sum(path: &Path) -> std::io::Result<Sum> {
    let mut file = fs::File::open(path)?;
    let (mut bytes, mut crc) = (0, crc32fast::Hasher::new());
    let mut part = vec![0; 1 << 16];
    loop {
        match file.read(&mut part)? {
            0 => return Ok(Sum { bytes, crc32: crc.finalize() }),
            n => {
                bytes += n as u64;
                crc.update(&part[..n]);
            }
        }
    }
}
