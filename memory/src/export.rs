//! Export of a query, or of a whole store, as one MCAP file ordered by time, the preferred input of viewers.

use crate::document::{Document, Order, Query};
use crate::error::Error;
use crate::stores::local::segment::{Encoded, Segment};
use crate::stores::{Fault, Store};
use std::path::Path;

/// Maximum number of records in a chunk.
const CHUNK_RECORDS: usize = 256;
/// Size of a chunk, bytes, from which the next one begins.
const CHUNK_BYTES: usize = 4 << 20;

/// Counts of an export.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// Number of exported records.
    pub records: u64,
    /// Length of the file, bytes.
    pub bytes: u64,
    /// Damaged records, which were not exported.
    pub faults: Vec<Fault>,
}

/// Writes the undamaged results of a query into a new MCAP file, oldest first whatever the query's order.
///
/// # Errors
/// If the file exists or cannot be written, or the store cannot be read.
pub fn export(store: &dyn Store, query: &Query, path: &Path) -> Result<Exported, Error> {
    let mut file = Segment::create(path, 0)?;
    let query = Query { order: Order::Oldest, ..query.clone() };
    let mut exported = Exported::default();
    let mut batch = Batch::default();
    exported.faults = store.each_whole(&query, &mut |document, blobs| {
        exported.records += 1;
        batch.bytes += blobs.iter().map(Vec::len).sum::<usize>();
        batch.records.push((document, blobs));
        if batch.bytes >= CHUNK_BYTES || batch.records.len() >= CHUNK_RECORDS {
            batch.write(&mut file)?;
        }
        Ok(())
    })?;
    batch.write(&mut file)?;
    exported.bytes = file.finish()?;
    Ok(exported)
}

/// Records that are collected for the next chunk.
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
