//! One MCAP file of everything, or of what a query finds, in the order of time: what viewers like best.

use crate::document::{Document, Order, Query};
use crate::error::Error;
use crate::stores::Store;
use crate::stores::local::segment::{Encoded, Segment};
use std::path::Path;

/// Records are read so many at a time, and written as one chunk once they have this many bytes.
const AT_ONCE: usize = 256;
const CHUNK_BYTES: usize = 4 << 20;

/// What was exported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// Records.
    pub records: u64,
    /// Length of the file, bytes.
    pub bytes: u64,
}

/// Writes what a query finds, oldest first whatever its order, into a new MCAP file.
///
/// # Errors
/// If the file exists or cannot be written, or a record cannot be read.
pub fn export(store: &dyn Store, query: &Query, path: &Path) -> Result<Exported, Error> {
    let mut file = Segment::create(path, 0)?;
    let mut query = Query { order: Order::Oldest, ..query.clone() };
    let mut left = query.limit.unwrap_or(usize::MAX);
    let mut exported = Exported::default();
    let mut batch = Batch::default();
    while left > 0 {
        query.limit = Some(left.min(AT_ONCE));
        let found = store.find(&query)?;
        let Some(last) = found.last() else { break };
        query.after = Some((last.stamp_ns, last.id));
        left -= found.len();
        exported.records += found.len() as u64;
        for document in found {
            let blobs = document.blobs.iter().map(|b| store.blob(document.id, &b.name));
            let blobs: Vec<Vec<u8>> = blobs.collect::<Result<_, _>>()?;
            batch.bytes += blobs.iter().map(Vec::len).sum::<usize>();
            batch.records.push((document, blobs));
            if batch.bytes >= CHUNK_BYTES {
                batch.write(&mut file)?;
            }
        }
        batch.write(&mut file)?;
    }
    exported.bytes = file.finish()?;
    Ok(exported)
}

/// Records that will make one chunk.
#[derive(Default)]
struct Batch {
    records: Vec<(Document, Vec<Vec<u8>>)>,
    bytes: usize,
}

impl Batch {
    fn write(&mut self, file: &mut Segment) -> Result<(), Error> {
        let records = std::mem::take(&mut self.records);
        self.bytes = 0;
        if records.is_empty() {
            return Ok(());
        }
        let (documents, blobs): (Vec<Document>, Vec<Vec<Vec<u8>>>) = records.into_iter().unzip();
        let slices = blobs.iter().map(|b| b.iter().map(Vec::as_slice).collect());
        let batch: Vec<_> =
            documents.into_iter().zip(slices).map(|(document, blobs)| Encoded { document, blobs }).collect();
        file.append(&batch).map(|_| ())
    }
}
