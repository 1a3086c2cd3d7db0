//! Sequential reading of a segment: every chunk with a valid checksum is found, wherever it stands.
//!
//! A segment is a sequence of self-validating chunks: the head of a chunk gives the length three times, and a
//! checksum covers the data. Where a chunk cannot be read, the bytes behind it are searched for the next
//! valid one, so that damage costs no chunks but those it hits. Damage is distinguished from the unfinished
//! last write of a killed process.

use super::segment::{
    CHUNK_HEAD, Channels, ChunkEntry, Located, MAGIC, MESSAGE_HEAD, RECORD_HEAD, Spot, message_index, op,
};
use crate::document::Document;
use crate::error::Error;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Content of a segment, as far as it can be read.
#[derive(Default)]
pub(super) struct Scan {
    /// End of the last complete chunk; bytes behind it belong to no record.
    pub end: u64,
    /// Bytes missing in the message index of the last chunk, because its write was cut off there.
    pub unwritten: Vec<u8>,
    /// True if the summary of the segment follows the chunks.
    pub complete: bool,
    pub channels: Channels,
    pub chunks: Vec<ChunkEntry>,
    /// Unfinished last write: its offset, and a description of what is missing.
    pub torn: Option<Fault>,
    /// Damage that no unfinished write explains: each with its offset and a description.
    pub damaged: Vec<Fault>,
    /// Highest record number read so far.
    last: Option<u64>,
}

/// File access to a segment, with a description of every failure.
struct Bytes {
    file: File,
    length: u64,
}

/// Offset and description of a fault.
pub(super) type Fault = (u64, String);

/// True if a regular file begins as MCAP files do.
pub(super) fn is_mcap(path: &Path) -> bool {
    let is_file = path.metadata().is_ok_and(|metadata| metadata.is_file());
    is_file && Bytes::open(path).is_ok_and(|bytes| bytes.read(0, 8).is_ok_and(|found| found == MAGIC))
}

/// Number of bytes that are read at once in the search for the next chunk.
const WINDOW: u64 = 1 << 20;

impl Bytes {
    fn open(path: &Path) -> std::io::Result<Self> {
        let file = File::open(path)?;
        Ok(Bytes { length: file.metadata()?.len(), file })
    }

    fn read(&self, at: u64, length: u64) -> Result<Vec<u8>, Fault> {
        if at.checked_add(length).is_none_or(|end| end > self.length) {
            let left = self.length.saturating_sub(at);
            return Err((at, format!("{length} bytes should follow, the file has {left}")));
        }
        let mut bytes = vec![0; length as usize];
        self.file.read_exact_at(&mut bytes, at).map_err(|e| (at, format!("cannot be read: {e}")))?;
        Ok(bytes)
    }

    /// Opcode and content length of the MCAP record at an offset.
    fn head(&self, at: u64) -> Result<(u8, u64), Fault> {
        let head = self.read(at, RECORD_HEAD)?;
        let length = number(&head, 1, 8);
        if at.checked_add(RECORD_HEAD + length.min(self.length)).is_none_or(|end| end > self.length) {
            return Err((at, format!("a record of {length} bytes should follow, the file is cut")));
        }
        Ok((head[0], length))
    }

    /// True if only zeros stand between an offset and the end of the file.
    fn is_blank_from(&self, mut at: u64) -> bool {
        while at < self.length {
            let length = WINDOW.min(self.length - at);
            match self.read(at, length) {
                Ok(bytes) if bytes.iter().all(|b| *b == 0) => at += length,
                _ => return false,
            }
        }
        true
    }
}

/// Reads a little-endian number of `width` bytes at an offset; 0 beyond the end.
fn number(bytes: &[u8], at: usize, width: usize) -> u64 {
    let slice = bytes.get(at..at + width).unwrap_or(&[]);
    match slice.try_into() {
        Ok(eight) => u64::from_le_bytes(eight),
        Err(_) => slice.iter().rev().fold(0, |v, b| v << 8 | u64::from(*b)),
    }
}

/// Head of a chunk as stored.
struct Head {
    /// Size of the chunk's data, bytes, as each of the three fields for it says.
    sizes: [Option<u64>; 3],
    times: (u64, u64),
    crc32: u32,
    /// True if opcode and compression are those of descry's chunks.
    is_chunk: bool,
}

/// Number of bytes of a chunk before its data.
const HEAD: u64 = RECORD_HEAD + CHUNK_HEAD;

impl Head {
    fn parse(head: &[u8]) -> Self {
        Head {
            sizes: [
                number(head, 1, 8).checked_sub(CHUNK_HEAD),
                Some(number(head, 25, 8)),
                Some(number(head, 41, 8)),
            ],
            times: (number(head, 9, 8), number(head, 17, 8)),
            crc32: number(head, 33, 4) as u32,
            is_chunk: head.first() == Some(&op::CHUNK) && number(head, 37, 4) == 0,
        }
    }

    /// Size that at least two of the three fields agree on, bytes, so that one damaged field does not matter;
    /// else `None`.
    fn agreed(&self) -> Option<u64> {
        let [a, b, c] = self.sizes;
        let size = if a == b || a == c {
            a
        } else if b == c {
            b
        } else {
            None
        };
        size.filter(|size| *size > 0)
    }

    fn is_whole(&self) -> bool {
        self.is_chunk
            && self.agreed().is_some()
            && self.sizes[0] == self.sizes[1]
            && self.sizes[0] == self.sizes[2]
    }
}

/// Reads a segment chunk by chunk and passes the undamaged records of each to `take`. `acknowledged`, if
/// known, is the offset up to which writes were completed.
///
/// # Errors
/// If the file cannot be opened, or `take` fails. Damage is reported in the scan instead.
pub(super) fn scan(
    path: &Path,
    acknowledged: Option<u64>,
    mut take: impl FnMut(Vec<(Document, Located)>, u64) -> Result<(), Error>,
) -> Result<Scan, Error> {
    let bytes = Bytes::open(path).map_err(|e| Error::file("cannot read", path, e))?;
    let mut scan = Scan::default();
    let begin = start(&bytes);
    let mut at = *begin.as_ref().unwrap_or(&0);
    let mut read = begin.and_then(|at| step(&bytes, at));
    scan.end = at;
    while at < bytes.length {
        match read {
            Ok(None) => {
                match summary(&bytes, at) {
                    Ok(()) => scan.complete = true,
                    Err(fault) => scan.stop(&bytes, at, fault, acknowledged),
                }
                break;
            }
            Ok(Some(chunk)) => {
                let records = scan.adopt(chunk);
                at = scan.end;
                take(records, at)?;
            }
            Err(fault) => {
                // A header of which any byte may be wrong does not say where the first chunk is.
                let from = if scan.chunks.is_empty() { 0 } else { at };
                let Some(next) = resume(&bytes, from) else {
                    scan.stop(&bytes, at, fault, acknowledged);
                    break;
                };
                let gap = scan.gap(&bytes, from, next, &fault);
                scan.damaged.push(gap);
                at = next;
            }
        }
        if scan.torn.is_some() {
            break;
        }
        read = step(&bytes, at);
    }
    if bytes.length == 0 {
        scan.torn = Some((0, "the file is empty".into()));
    }
    Ok(scan)
}

impl Scan {
    /// Adds a chunk to the scan and returns its records.
    fn adopt(&mut self, chunk: Chunk) -> Vec<(Document, Located)> {
        self.end = chunk.end;
        self.unwritten = chunk.unwritten;
        self.torn = chunk.torn;
        self.damaged.extend(chunk.faults);
        self.last = chunk.records.iter().map(|(document, _)| document.id.0).max().max(self.last);
        self.channels.schemas.extend(chunk.channels.schemas);
        self.channels.channels.extend(chunk.channels.channels);
        for (channel, count) in chunk.channels.messages {
            *self.channels.messages.entry(channel).or_default() += count;
        }
        self.chunks.push(chunk.entry);
        chunk.records
    }

    /// Fault for unreadable bytes between two chunks, with the missing record numbers.
    fn gap(&self, bytes: &Bytes, from: u64, to: u64, (at, what): &Fault) -> Fault {
        let first = match step(bytes, to) {
            Ok(Some(chunk)) => chunk.records.first().map(|(document, _)| document.id.0),
            _ => None,
        };
        let missing = match (self.last.unwrap_or(0), first) {
            (last, Some(first)) if first == last + 2 => format!("; record {} is missing there", last + 1),
            (last, Some(first)) if first > last + 2 => {
                format!("; records {} to {} are missing there", last + 1, first - 1)
            }
            _ => String::new(),
        };
        (
            *at,
            format!("{what}; {} bytes cannot be read, and reading goes on at byte {to}{missing}", to - from),
        )
    }

    /// Classifies the bytes behind the last complete chunk as an unfinished write or as damage.
    fn stop(&mut self, bytes: &Bytes, at: u64, (place, what): Fault, acknowledged: Option<u64>) {
        if acknowledged.is_some_and(|end| at >= end) || is_unfinished(bytes, at) {
            self.torn = Some((place, what));
        } else {
            let left = bytes.length - at;
            self.damaged.push((place, format!("{what}; the last {left} bytes cannot be read")));
        }
    }
}

/// True if the bytes from an offset to the end of the file are an unfinished write: the file ends within a
/// head, before the end of the data that a complete head announces, or within the summary, or the rest is all
/// zeros.
fn is_unfinished(bytes: &Bytes, at: u64) -> bool {
    let left = bytes.length.saturating_sub(at);
    let Ok(found) = bytes.read(at, left.min(HEAD)) else { return false };
    let begun = match found.first() {
        _ if at == 0 => left < HEAD && (MAGIC.starts_with(&found) || found.starts_with(MAGIC)),
        Some(&op::CHUNK) if left >= HEAD => {
            let head = Head::parse(&found);
            head.is_whole() && head.agreed().is_some_and(|size| size > left - HEAD)
        }
        Some(&op::CHUNK) => true,
        Some(&op::DATA_END) => !bytes.read(bytes.length - 8, 8).is_ok_and(|end| end == MAGIC),
        _ => false,
    };
    begun || bytes.is_blank_from(at)
}

/// Checks the summary of a complete segment.
fn summary(bytes: &Bytes, at: u64) -> Result<(), Fault> {
    let start = at + RECORD_HEAD + 4;
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

/// Offset behind damage at which reading can resume: a valid chunk, or the end of the data; `None` if there
/// is none. A chunk with damaged data but of full length is skipped as a whole, so that no bytes within its
/// blobs are mistaken for a chunk.
fn resume(bytes: &Bytes, at: u64) -> Option<u64> {
    let passed = bytes.read(at, HEAD).ok().map(|head| Head::parse(&head)).filter(|head| head.is_chunk);
    let passed = passed.and_then(|head| head.agreed()).and_then(|size| at.checked_add(HEAD + size));
    let is_followed = |end: &u64| matches!(bytes.head(*end), Ok((op::MESSAGE_INDEX, _)));
    let mut from = passed.filter(is_followed).unwrap_or(at + 1);
    while from < bytes.length {
        let window = bytes.read(from, (WINDOW + HEAD).min(bytes.length - from)).ok()?;
        for offset in 0..window.len().min(WINDOW as usize) {
            let here = &window[offset..];
            let place = from + offset as u64;
            let is_end = here.starts_with(&END_OF_DATA) && summary(bytes, place).is_ok();
            let is_chunk = here.len() >= HEAD as usize
                && Head::parse(here).agreed().is_some_and(|size| size <= bytes.length - place - HEAD)
                && chunk(bytes, place).is_ok();
            if is_end || is_chunk {
                return Some(place);
            }
        }
        from += WINDOW;
    }
    None
}

/// MCAP record that ends the data section, written without a checksum.
const END_OF_DATA: [u8; 13] = [op::DATA_END, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

/// A valid chunk.
struct Chunk {
    records: Vec<(Document, Located)>,
    entry: ChunkEntry,
    channels: Channels,
    /// Expected offset of the next chunk.
    end: u64,
    /// Faults in the chunk, whose undamaged records are in `records`.
    faults: Vec<Fault>,
    /// Fault if the message index of the chunk is cut off by the end of the file.
    torn: Option<Fault>,
    unwritten: Vec<u8>,
}

fn start(bytes: &Bytes) -> Result<u64, Fault> {
    if bytes.read(0, 8)? != MAGIC {
        return Err((0, "this is no MCAP file: it does not begin with its magic bytes".into()));
    }
    match bytes.head(8)? {
        (op::HEADER, length) => {
            let profile = number(&bytes.read(8 + RECORD_HEAD, 4)?, 0, 4);
            let library = number(&bytes.read(8 + RECORD_HEAD + 4 + profile, 4)?, 0, 4);
            let fits = length == 8 + profile + library;
            fits.then_some(8 + RECORD_HEAD + length)
                .ok_or_else(|| (8, format!("a header of {length} bytes does not fit its texts")))
        }
        (code, _) => Err((8, format!("a header should follow, found a record of kind {code:#04x}"))),
    }
}

/// Reads the chunk at an offset; `None` at the end of the data.
fn step(bytes: &Bytes, at: u64) -> Result<Option<Chunk>, Fault> {
    if bytes.read(at, END_OF_DATA.len() as u64).is_ok_and(|found| found == END_OF_DATA) {
        return Ok(None);
    }
    chunk(bytes, at).map(Some)
}

/// Reads the chunk at an offset. A damaged field of its head is outvoted by the others; the checksum decides.
fn chunk(bytes: &Bytes, at: u64) -> Result<Chunk, Fault> {
    let code = bytes.read(at, 1)?[0];
    let raw = bytes.read(at, HEAD)?;
    let head = Head::parse(&raw);
    let Some(data_bytes) = head.agreed() else {
        return Err((
            at,
            format!("a chunk should follow, found a record of kind {code:#04x} whose head does not fit"),
        ));
    };
    let data_at = at + HEAD;
    let data = bytes.read(data_at, data_bytes)?;
    let found = crc32fast::hash(&data);
    // One bit of the checksum itself may be damaged.
    if (found ^ head.crc32).count_ones() > 1 {
        return Err((at, format!("the chunk's checksum is {found:08x}, written was {:08x}", head.crc32)));
    }
    let (records, channels, messages) = records(&data, at)?;
    let times = || messages.iter().map(|(_, stamp_ns, _)| *stamp_ns);
    let times = (times().min().unwrap_or(0), times().max().unwrap_or(0));
    let mut faults = Vec::new();
    if !head.is_whole() || found != head.crc32 || times != head.times {
        faults.push((at, "the head of the chunk is damaged; its records are whole".into()));
    }
    let index_at = data_at + data_bytes;
    let (index, begins) = message_index(&messages);
    let there = bytes.read(index_at, (index.len() as u64).min(bytes.length - index_at))?;
    let same = index.iter().zip(&there).take_while(|(a, b)| a == b).count();
    let (mut torn, mut unwritten, mut end) = (None, Vec::new(), index_at + index.len() as u64);
    if same < index.len() && bytes.is_blank_from(index_at + same as u64) {
        torn = Some((index_at, "the message index is cut; the records of its chunk are whole".into()));
        end = index_at;
        unwritten = index.clone();
    } else if same < index.len() {
        faults.push((index_at, "the message index is not that of its chunk; its records are whole".into()));
        end = if begins_at(bytes, end) { end } else { index_at };
    }
    let entry = ChunkEntry {
        start_ns: times.0,
        end_ns: times.1,
        offset: at,
        bytes: HEAD + data_bytes,
        data_bytes,
        index_bytes: index.len() as u64,
        indexes: begins.into_iter().map(|(channel, at)| (channel, index_at + at)).collect(),
    };
    Ok(Chunk { records, entry, channels, end, faults, torn, unwritten })
}

type RecordParts = (Vec<(Document, Located)>, Channels, Vec<(u16, u64, u64)>);

/// Decodes the records in the data of a chunk, where the blobs of a record precede its document.
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

/// Location and checksum of the last `length` bytes before `end` in the data of a chunk.
fn spot(data: &[u8], data_at: u64, end: usize, length: usize) -> Spot {
    let from = end.saturating_sub(length);
    Spot { at: data_at + from as u64, crc32: crc32fast::hash(data.get(from..end).unwrap_or(&[])) }
}

/// Locations and checksums of the blobs of a document, whose messages end at these offsets.
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

/// Decodes a message as a document; `None` for messages of blobs, which never begin with a brace.
fn document(content: &[u8]) -> Option<Document> {
    if content.first() == Some(&b'{') { serde_json::from_slice(content).ok() } else { None }
}

/// True if a chunk, the end of the data, or the end of the file is at this offset.
fn begins_at(bytes: &Bytes, at: u64) -> bool {
    at == bytes.length
        || bytes.read(at, HEAD).is_ok_and(|head| Head::parse(&head).is_whole())
        || bytes.read(at, END_OF_DATA.len() as u64).is_ok_and(|found| found == END_OF_DATA)
}
