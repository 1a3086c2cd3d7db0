//! What a store was when it was last closed: by it damage to the index, and to whole files, is known.

use super::index::INDEX;
use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;

/// The file name. It is there while nobody writes, and absent after a crash.
const CLOSED: &str = "closed.json";

/// What was there at the end.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Closed {
    /// The index and its log.
    index: [Sum; 2],
    /// The length of each segment, bytes, by its number.
    pub segments: BTreeMap<u64, u64>,
    /// How many records there are.
    pub records: u64,
    /// The number of the next.
    pub next: u64,
}

/// What a file is known by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Sum {
    bytes: u64,
    crc32: u32,
}

impl Closed {
    /// Writes down what is there; the index must be closed.
    pub fn write(dir: &Path, segments: BTreeMap<u64, u64>, records: u64, next: u64) -> Result<(), Error> {
        let path = dir.join(CLOSED);
        let fail = |e| Error::file("cannot write", &path, e);
        let closed = Closed { index: sums(dir).map_err(fail)?, segments, records, next };
        let text = serde_json::to_string(&closed).map_err(|e| fail(e.into()))?;
        let fresh = dir.join(format!("{CLOSED}.new"));
        fs::write(&fresh, format!("{text}\n{:08x}\n", crc32fast::hash(text.as_bytes()))).map_err(fail)?;
        fs::rename(&fresh, &path).map_err(fail)
    }

    /// What was written at the last closing; none if somebody writes, or wrote until a crash, or if it is damaged.
    pub fn read(dir: &Path) -> Option<Self> {
        let said = fs::read_to_string(dir.join(CLOSED)).ok()?;
        let (text, sum) = said.strip_suffix('\n')?.split_once('\n')?;
        (sum == format!("{:08x}", crc32fast::hash(text.as_bytes()))).then_some(())?;
        serde_json::from_str(text).ok()
    }

    /// Whether the index is still what it was.
    pub fn has_index(&self, dir: &Path) -> bool {
        sums(dir).is_ok_and(|found| found == self.index)
    }

    /// From now on somebody writes.
    pub fn remove(dir: &Path) -> Result<(), Error> {
        let path = dir.join(CLOSED);
        match fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::file("cannot delete", &path, e)),
            _ => Ok(()),
        }
    }
}

/// The index and its log; a log that is not there is an empty one.
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
