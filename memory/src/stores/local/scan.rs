//! Reading a segment from end to end, as far as it is whole.

use super::segment::{
    CHUNK_HEAD, Channels, ChunkEntry, Located, MAGIC, MESSAGE_HEAD, RECORD_HEAD, Spot, message_index, op,
};
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
    pub torn: Option<Fault>,
    /// Chunks that are damaged while what follows them is not: where and what.
    pub damaged: Vec<Fault>,
}

/// The bytes of a segment with a name for every way in which they can be wrong.
struct Bytes {
    file: File,
    length: u64,
}

/// Where something is wrong, and what.
pub(super) type Fault = (u64, String);

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

/// Reads a segment chunk by chunk and hands over each record that is whole. `known` says, in order, where chunks are
/// known to begin: reading goes on there behind what is damaged.
///
/// # Errors
/// If the file cannot be opened, or `take` fails. Damage is no error: the scan says where it stopped.
pub(super) fn scan(
    path: &Path,
    known: &[u64],
    mut take: impl FnMut(Vec<(Document, Located)>, u64) -> Result<(), Error>,
) -> Result<Scan, Error> {
    let fail = |e| Error::file("cannot read", path, e);
    let file = File::open(path).map_err(fail)?;
    let bytes = Bytes { length: file.metadata().map_err(fail)?.len(), file };
    let mut scan = Scan::default();
    let mut at = match start(&bytes) {
        Ok(at) => at,
        Err(fault) => {
            scan.torn = Some(fault);
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
            Ok(Step::Unindexed(records, fault)) => match behind(&bytes, at, known) {
                Some(end) => {
                    (at, scan.end) = (end, end);
                    scan.damaged.push(fault);
                    take(records, end)?;
                }
                // The index of a chunk is written with it: one whose index is cut was not acknowledged.
                None => {
                    scan.torn = Some(fault);
                    break;
                }
            },
            Ok(Step::End) => {
                scan.torn = summary(&bytes, at).err();
                scan.complete = scan.torn.is_none();
                break;
            }
            Err(fault) => match behind(&bytes, at, known) {
                Some(end) => {
                    (at, scan.end) = (end, end);
                    scan.damaged.push(fault);
                }
                None => {
                    scan.torn = Some(fault);
                    break;
                }
            },
        }
    }
    Ok(scan)
}

/// Checks what stands behind the data of a complete segment.
fn summary(bytes: &Bytes, at: u64) -> Result<(), Fault> {
    let start = at + RECORD_HEAD + 4;
    if bytes.read(at, RECORD_HEAD + 4)?[1..] != [4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0] {
        return Err((at, "the end of the data is not as it was written".into()));
    }
    let rest = bytes.read(start, bytes.length.saturating_sub(start))?;
    let footer = rest.len().checked_sub(RECORD_HEAD as usize + 20 + MAGIC.len());
    let footer = footer.ok_or((start, "the summary is cut".to_owned()))?;
    let crc_at = rest.len() - MAGIC.len() - 4;
    if !rest.ends_with(MAGIC)
        || rest[footer] != op::FOOTER
        || number(&rest, footer + RECORD_HEAD as usize, 8) != start
    {
        return Err((start, "the summary is cut".into()));
    }
    let (found, written) = (u64::from(crc32fast::hash(&rest[..crc_at])), number(&rest, crc_at, 4));
    if found != written {
        return Err((start, format!("the summary's checksum is {found:08x}, written was {written:08x}")));
    }
    Ok(())
}

/// Where reading can go on behind a damaged chunk: behind its index, if both are there in their full length, or where
/// the next chunk is known to begin.
fn behind(bytes: &Bytes, at: u64, known: &[u64]) -> Option<u64> {
    let next = known.iter().copied().find(|k| *k > at && matches!(bytes.head(*k), Ok((op::CHUNK, _))));
    let by_length = || {
        let (op::CHUNK, length) = bytes.head(at).ok()? else { return None };
        let mut end = at + RECORD_HEAD + length;
        while let Ok((op::MESSAGE_INDEX, length)) = bytes.head(end) {
            end += RECORD_HEAD + length;
        }
        matches!(bytes.head(end), Ok((op::CHUNK | op::DATA_END, _))).then_some(end)
    };
    by_length().filter(|end| next.is_none_or(|n| *end <= n)).or(next)
}

enum Step {
    Chunk(Vec<(Document, Located)>, u64),
    /// Its records are whole, the index behind it is not.
    Unindexed(Vec<(Document, Located)>, Fault),
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
            let (records, mut entry, mut found, messages) = chunk(bytes, at, length)?;
            let index_at = at + RECORD_HEAD + length;
            let (index, begins) = message_index(&messages);
            if bytes.read(index_at, index.len() as u64).is_ok_and(|found| found == index) {
                entry.indexes = begins.into_iter().map(|(channel, at)| (channel, index_at + at)).collect();
            }
            entry.index_bytes = index.len() as u64;
            let end = index_at + entry.index_bytes;
            let fault = entry
                .indexes
                .is_empty()
                .then(|| (index_at, "the message index is not that of its chunk".into()));
            scan.chunks.push(entry);
            scan.channels.schemas.append(&mut found.schemas);
            scan.channels.channels.append(&mut found.channels);
            for (channel, count) in found.messages {
                *scan.channels.messages.entry(channel).or_default() += count;
            }
            Ok(match fault {
                Some(fault) => Step::Unindexed(records, fault),
                None => Step::Chunk(records, end),
            })
        }
        op::DATA_END => Ok(Step::End),
        other => Err((at, format!("a chunk should follow, found a record of kind {other:#04x}"))),
    }
}

/// Records, entry for the summary, what was declared, and channel, time and offset of each message.
type ChunkParts = (Vec<(Document, Located)>, ChunkEntry, Channels, Vec<(u16, u64, u64)>);

fn chunk(bytes: &Bytes, at: u64, length: u64) -> Result<ChunkParts, Fault> {
    if length < CHUNK_HEAD {
        return Err((at, format!("a chunk of {length} bytes is shorter than its head")));
    }
    let head = bytes.read(at + RECORD_HEAD, CHUNK_HEAD)?;
    let (data_bytes, crc, compression) = (number(&head, 16, 8), number(&head, 24, 4), number(&head, 28, 4));
    if compression != 0 || data_bytes != length - CHUNK_HEAD || number(&head, 32, 8) != data_bytes {
        return Err((at, "the head of the chunk does not fit its length".into()));
    }
    let data_at = at + RECORD_HEAD + CHUNK_HEAD;
    let data = bytes.read(data_at, data_bytes)?;
    let found_crc = u64::from(crc32fast::hash(&data));
    if found_crc != crc {
        return Err((at, format!("the chunk's checksum is {found_crc:08x}, written was {crc:08x}")));
    }
    let (records, channels, messages) = records(&data, at)?;
    let times = || messages.iter().map(|(_, stamp_ns, _)| *stamp_ns);
    let (start_ns, end_ns) = (times().min().unwrap_or(0), times().max().unwrap_or(0));
    if (start_ns, end_ns) != (number(&head, 0, 8), number(&head, 8, 8)) {
        return Err((at, "the head of the chunk does not give the times of its messages".into()));
    }
    let entry = ChunkEntry {
        start_ns,
        end_ns,
        offset: at,
        bytes: RECORD_HEAD + length,
        data_bytes,
        index_bytes: 0,
        indexes: Vec::new(),
    };
    Ok((records, entry, channels, messages))
}

type RecordParts = (Vec<(Document, Located)>, Channels, Vec<(u16, u64, u64)>);

/// The records in the data of a chunk: blobs first, then the document that they belong to.
fn records(data: &[u8], chunk_at: u64) -> Result<RecordParts, Fault> {
    let data_at = chunk_at + RECORD_HEAD + CHUNK_HEAD;
    let mut records = Vec::new();
    let mut channels = Channels::default();
    let mut messages = Vec::new();
    let mut blobs: Vec<usize> = Vec::new();
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
                let channel = number(body, 0, 2) as u16;
                *channels.messages.entry(channel).or_default() += 1;
                messages.push((channel, number(body, 6, 8), at as u64));
                let content = body.get(MESSAGE_HEAD as usize..).unwrap_or(&[]);
                match document(content) {
                    Some(document) => {
                        let ends = std::mem::take(&mut blobs);
                        let blobs =
                            located_blobs(data, data_at, &document, &ends).map_err(|what| (place, what))?;
                        let located = Located {
                            chunk: chunk_at,
                            document: spot(data, data_at, end, content.len()),
                            document_bytes: content.len() as u64,
                            blobs,
                            message_bytes: (end - record_from) as u64,
                        };
                        records.push((document, located));
                        record_from = end;
                    }
                    // The bytes of a blob stand last in its message: its end and their number say where they begin.
                    None => blobs.push(end),
                }
            }
            other => {
                return Err((place, format!("a message should follow, found a record of kind {other:#04x}")));
            }
        }
        at = end;
    }
    if blobs.is_empty() {
        Ok((records, channels, messages))
    } else {
        Err((chunk_at, "blobs without their document".into()))
    }
}

/// The last `length` bytes before `end` in the data of a chunk.
fn spot(data: &[u8], data_at: u64, end: usize, length: usize) -> Spot {
    let from = end.saturating_sub(length);
    Spot { at: data_at + from as u64, crc32: crc32fast::hash(data.get(from..end).unwrap_or(&[])) }
}

/// Where the blobs of a document lie, whose messages end there.
fn located_blobs(
    data: &[u8],
    data_at: u64,
    document: &Document,
    ends: &[usize],
) -> Result<Vec<Spot>, String> {
    if document.blobs.len() != ends.len() {
        let (id, found, said) = (document.id, ends.len(), document.blobs.len());
        return Err(format!("record {id} has {found} blobs, its document says {said}"));
    }
    let blobs = ends.iter().zip(&document.blobs);
    Ok(blobs.map(|(end, info)| spot(data, data_at, *end, info.bytes as usize)).collect())
}

/// The document that a message is, if it is one; the messages of blobs never begin with a brace.
fn document(content: &[u8]) -> Option<Document> {
    if content.first() == Some(&b'{') { serde_json::from_slice(content).ok() } else { None }
}
