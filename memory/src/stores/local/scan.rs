//! Reading a segment from end to end, as far as it is whole.

use super::segment::{CHUNK_HEAD, Channels, ChunkEntry, Located, MAGIC, MESSAGE_HEAD, RECORD_HEAD, op};
use crate::document::Document;
use crate::error::Error;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// What a segment holds.
#[derive(Default)]
pub(super) struct Scan {
    /// Where the last whole chunk and its index end: what stands behind belongs to no record.
    pub end: u64,
    /// Whether the summary follows.
    pub complete: bool,
    pub channels: Channels,
    pub chunks: Vec<ChunkEntry>,
    /// Why reading stopped before the end of the file: where and what.
    pub fault: Option<(u64, String)>,
}

/// The bytes of a segment with a name for every way in which they can be wrong.
struct Bytes {
    file: File,
    length: u64,
}

type Fault = (u64, String);

impl Bytes {
    fn read(&self, at: u64, length: u64) -> Result<Vec<u8>, Fault> {
        if at.checked_add(length).is_none_or(|end| end > self.length) {
            return Err((
                at,
                format!("{length} bytes should follow, the file has {}", self.length.saturating_sub(at)),
            ));
        }
        let mut bytes = vec![0; length as usize];
        self.file.read_exact_at(&mut bytes, at).map_err(|e| (at, format!("cannot be read: {e}")))?;
        Ok(bytes)
    }

    /// Code and length of the record at an offset.
    fn head(&self, at: u64) -> Result<(u8, u64), Fault> {
        let head = self.read(at, RECORD_HEAD)?;
        let length = number(&head, 1, 8);
        if at.checked_add(RECORD_HEAD + length.min(self.length)).is_none_or(|end| end > self.length) {
            return Err((at, format!("a record of {length} bytes should follow, the file is cut")));
        }
        Ok((head[0], length))
    }
}

/// A little-endian number of `width` bytes; 0 where there are none.
fn number(bytes: &[u8], at: usize, width: usize) -> u64 {
    let slice = bytes.get(at..at + width).unwrap_or(&[]);
    slice.iter().rev().fold(0, |v, b| v << 8 | u64::from(*b))
}

/// Reads a segment chunk by chunk and hands over each record that is whole.
///
/// # Errors
/// If the file cannot be opened, or `take` fails. Damage is no error: the scan says where it stopped.
pub(super) fn scan(
    path: &Path,
    mut take: impl FnMut(Vec<(Document, Located)>, u64) -> Result<(), Error>,
) -> Result<Scan, Error> {
    let fail = |e| Error::file("cannot read", path, e);
    let file = File::open(path).map_err(fail)?;
    let bytes = Bytes { length: file.metadata().map_err(fail)?.len(), file };
    let mut scan = Scan::default();
    let mut at = match start(&bytes) {
        Ok(at) => at,
        Err(fault) => {
            scan.fault = Some(fault);
            return Ok(scan);
        }
    };
    scan.end = at;
    while at < bytes.length {
        match step(&bytes, at, &mut scan) {
            Ok(Step::Chunk(records, end)) => {
                (at, scan.end) = (end, end);
                take(records, end)?;
            }
            Ok(Step::End) => {
                scan.complete = bytes.read(bytes.length - 8, 8).is_ok_and(|m| m == MAGIC);
                if !scan.complete {
                    scan.fault = Some((at, "the summary is cut".into()));
                }
                break;
            }
            Err(fault) => {
                scan.fault = Some(fault);
                break;
            }
        }
    }
    Ok(scan)
}

enum Step {
    Chunk(Vec<(Document, Located)>, u64),
    End,
}

fn start(bytes: &Bytes) -> Result<u64, Fault> {
    if bytes.read(0, 8)? != MAGIC {
        return Err((0, "this is no MCAP file: it does not begin with its magic bytes".into()));
    }
    match bytes.head(8)? {
        (op::HEADER, length) => Ok(8 + RECORD_HEAD + length),
        (code, _) => Err((8, format!("a header should follow, found a record of kind {code:#04x}"))),
    }
}

fn step(bytes: &Bytes, at: u64, scan: &mut Scan) -> Result<Step, Fault> {
    let (code, length) = bytes.head(at)?;
    match code {
        op::CHUNK => {
            let (records, mut entry, mut found) = chunk(bytes, at, length)?;
            let mut end = at + RECORD_HEAD + length;
            // The index of a chunk is written with it; a chunk whose index is cut was not acknowledged.
            for _ in 0..found.messages.len() {
                let (code, length) = bytes.head(end)?;
                if code != op::MESSAGE_INDEX {
                    return Err((
                        end,
                        format!("a message index should follow, found a record of kind {code:#04x}"),
                    ));
                }
                let channel = number(&bytes.read(end + RECORD_HEAD, 2)?, 0, 2) as u16;
                entry.indexes.push((channel, end));
                end += RECORD_HEAD + length;
            }
            entry.index_bytes = end - (at + RECORD_HEAD + length);
            scan.chunks.push(entry);
            scan.channels.schemas.append(&mut found.schemas);
            scan.channels.channels.append(&mut found.channels);
            for (channel, count) in found.messages {
                *scan.channels.messages.entry(channel).or_default() += count;
            }
            Ok(Step::Chunk(records, end))
        }
        op::DATA_END => Ok(Step::End),
        other => Err((at, format!("a chunk should follow, found a record of kind {other:#04x}"))),
    }
}

type ChunkParts = (Vec<(Document, Located)>, ChunkEntry, Channels);

fn chunk(bytes: &Bytes, at: u64, length: u64) -> Result<ChunkParts, Fault> {
    if length < CHUNK_HEAD {
        return Err((at, format!("a chunk of {length} bytes is shorter than its head")));
    }
    let head = bytes.read(at + RECORD_HEAD, CHUNK_HEAD)?;
    let (data_bytes, crc, compression) = (number(&head, 16, 8), number(&head, 24, 4), number(&head, 28, 4));
    if compression != 0 || data_bytes != length - CHUNK_HEAD {
        return Err((at, "the head of the chunk does not fit its length".into()));
    }
    let data_at = at + RECORD_HEAD + CHUNK_HEAD;
    let data = bytes.read(data_at, data_bytes)?;
    let found_crc = u64::from(crc32fast::hash(&data));
    if found_crc != crc {
        return Err((at, format!("the chunk's checksum is {found_crc:08x}, written was {crc:08x}")));
    }
    let (records, channels) = records(&data, at)?;
    let entry = ChunkEntry {
        start_ns: number(&head, 0, 8),
        end_ns: number(&head, 8, 8),
        offset: at,
        bytes: RECORD_HEAD + length,
        data_bytes,
        index_bytes: 0,
        indexes: Vec::new(),
    };
    Ok((records, entry, channels))
}

/// The records in the data of a chunk: blobs first, then the document that they belong to.
fn records(data: &[u8], chunk_at: u64) -> Result<(Vec<(Document, Located)>, Channels), Fault> {
    let data_at = chunk_at + RECORD_HEAD + CHUNK_HEAD;
    let mut records = Vec::new();
    let mut channels = Channels::default();
    let mut blobs: Vec<u64> = Vec::new();
    let (mut at, mut record_from) = (0, 0);
    while at < data.len() {
        let place = data_at + at as u64;
        let length = number(data, at + 1, 8) as usize;
        let end = at.saturating_add(RECORD_HEAD as usize).saturating_add(length);
        let whole = data.get(at..end).ok_or((place, "a message is longer than its chunk".to_owned()))?;
        let body = &whole[RECORD_HEAD as usize..];
        match whole[0] {
            op::SCHEMA => channels.adopt_schema(whole),
            op::CHANNEL => channels.adopt_channel(whole),
            op::MESSAGE => {
                *channels.messages.entry(number(body, 0, 2) as u16).or_default() += 1;
                let content = body.get(MESSAGE_HEAD as usize..).unwrap_or(&[]);
                match document(content) {
                    Some(document) => {
                        let mut located = Located {
                            chunk: chunk_at,
                            document: data_at + end as u64 - content.len() as u64,
                            document_bytes: content.len() as u64,
                            blobs: std::mem::take(&mut blobs),
                            message_bytes: (end - record_from) as u64,
                        };
                        if document.blobs.len() != located.blobs.len() {
                            return Err((
                                place,
                                format!(
                                    "record {} has {} blobs, its document says {}",
                                    document.id,
                                    located.blobs.len(),
                                    document.blobs.len()
                                ),
                            ));
                        }
                        for (end, info) in located.blobs.iter_mut().zip(&document.blobs) {
                            *end = end.saturating_sub(info.bytes);
                        }
                        records.push((document, located));
                        record_from = end;
                    }
                    // The bytes of a blob stand last in its message: its end and their number say where they begin.
                    None => blobs.push(data_at + end as u64),
                }
            }
            other => {
                return Err((place, format!("a message should follow, found a record of kind {other:#04x}")));
            }
        }
        at = end;
    }
    if blobs.is_empty() {
        Ok((records, channels))
    } else {
        Err((chunk_at, "blobs without their document".into()))
    }
}

/// The document that a message is, if it is one; the messages of blobs never begin with a brace.
fn document(content: &[u8]) -> Option<Document> {
    if content.first() == Some(&b'{') { serde_json::from_slice(content).ok() } else { None }
}
