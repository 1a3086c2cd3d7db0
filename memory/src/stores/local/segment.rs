//! Segment of a store: an MCAP file that grows by whole chunks, one for each batch of records.
//!
//! A chunk has a checksum over its messages, so that a batch is present as a whole or not at all. Chunks are
//! not compressed: the bytes of a blob are contiguous in the file and can be read alone.

use crate::document::{Document, Form};
use crate::error::Error;
use crate::foxglove;
use crc32fast::Hasher;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{IoSlice, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

pub(crate) const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

/// Opcodes of MCAP records.
pub(crate) mod op {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const STATISTICS: u8 = 0x0B;
    pub const SUMMARY_OFFSET: u8 = 0x0E;
    pub const DATA_END: u8 = 0x0F;
}

/// Size of opcode and length before each MCAP record, bytes.
pub(crate) const RECORD_HEAD: u64 = 9;
/// Size of the fields between the head of a chunk and its messages, bytes: times, size, checksum, no
/// compression, size.
pub(crate) const CHUNK_HEAD: u64 = 8 + 8 + 8 + 4 + 4 + 8;
/// Size of the fields between the head of a message and its data, bytes: channel, sequence, times.
pub(crate) const MESSAGE_HEAD: u64 = 2 + 4 + 8 + 8;

/// Maximum number of chunks in a segment, which limits the memory for its summary.
pub(crate) const MAX_CHUNKS: usize = 1 << 14;

/// A record to be written to a segment.
pub(crate) struct Encoded<'a> {
    pub document: Document,
    pub blobs: Vec<&'a [u8]>,
}

/// Offset of bytes in the file, with their checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Spot {
    /// Offset in the file.
    pub at: u64,
    pub crc32: u32,
}

/// Location of a record in a segment: its document and the bytes of its blobs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Located {
    pub chunk: u64,
    pub document: Spot,
    pub document_bytes: u64,
    pub blobs: Vec<Spot>,
    /// Total size of the record's messages in the file, bytes.
    pub message_bytes: u64,
}

/// Entry for a chunk in the summary of a segment.
#[derive(Clone, Debug)]
pub(crate) struct ChunkEntry {
    pub start_ns: u64,
    pub end_ns: u64,
    pub offset: u64,
    pub bytes: u64,
    pub data_bytes: u64,
    pub index_bytes: u64,
    /// Channel number and file offset of each message index of the chunk.
    pub indexes: Vec<(u16, u64)>,
}

/// Schemas and channels of a segment, with the message count of each channel.
#[derive(Default)]
pub(crate) struct Channels {
    pub schemas: Vec<Vec<u8>>,
    schema_ids: BTreeMap<Option<Form>, u16>,
    pub channels: Vec<Vec<u8>>,
    ids: BTreeMap<(String, Option<Form>), u16>,
    pub messages: BTreeMap<u16, u64>,
}

/// A segment open for writing.
pub(crate) struct Segment {
    pub path: PathBuf,
    pub number: u64,
    file: File,
    pub end: u64,
    pub channels: Channels,
    pub chunks: Vec<ChunkEntry>,
}

/// Writer of MCAP records into a buffer.
pub(crate) struct Writer<'a>(pub &'a mut Vec<u8>);

impl Writer<'_> {
    pub fn u16(&mut self, v: u16) {
        self.0.extend_from_slice(&v.to_le_bytes());
    }
    pub fn u32(&mut self, v: u32) {
        self.0.extend_from_slice(&v.to_le_bytes());
    }
    pub fn u64(&mut self, v: u64) {
        self.0.extend_from_slice(&v.to_le_bytes());
    }
    pub fn text(&mut self, v: &str) {
        self.bytes(v.as_bytes());
    }
    pub fn bytes(&mut self, v: &[u8]) {
        self.u32(v.len() as u32);
        self.0.extend_from_slice(v);
    }
    pub fn record(&mut self, code: u8, write: impl FnOnce(&mut Writer)) {
        self.0.push(code);
        let at = self.0.len();
        self.u64(0);
        write(&mut Writer(self.0));
        let length = (self.0.len() - at - 8) as u64;
        self.0[at..at + 8].copy_from_slice(&length.to_le_bytes());
    }
}

impl Channels {
    /// Number of the channel of a topic; the declaration of a new channel is appended to `declare`.
    fn channel(&mut self, topic: &str, form: Option<Form>, declare: &mut Vec<u8>) -> Result<u16, Error> {
        let key = (topic.to_owned(), form);
        if let Some(id) = self.ids.get(&key) {
            return Ok(*id);
        }
        let schema_id = match self.schema_ids.get(&form) {
            Some(id) => *id,
            None => {
                let schema = form.map_or_else(foxglove::document_schema, foxglove::schema);
                let id = self.schemas.len() as u16 + 1;
                let mut bytes = Vec::new();
                Writer(&mut bytes).record(op::SCHEMA, |w| {
                    w.u16(id);
                    w.text(schema.name);
                    w.text(schema.encoding);
                    w.bytes(&schema.data);
                });
                declare.extend_from_slice(&bytes);
                self.schemas.push(bytes);
                self.schema_ids.insert(form, id);
                id
            }
        };
        let id = u16::try_from(self.ids.len()).map_err(|_| Error::Input {
            what: format!("`{topic}` would be the 65537th topic of a segment"),
            mend: "give kinds and frames few names; what varies belongs into the body".into(),
        })?;
        let encoding = if form.is_some() { foxglove::PROTOBUF } else { foxglove::JSON };
        let mut bytes = Vec::new();
        Writer(&mut bytes).record(op::CHANNEL, |w| {
            w.u16(id);
            w.u16(schema_id);
            w.text(topic);
            w.text(encoding);
            w.u32(0);
        });
        declare.extend_from_slice(&bytes);
        self.channels.push(bytes);
        self.ids.insert(key, id);
        Ok(id)
    }

    /// Adds the schema record of a segment that is being repaired.
    pub fn adopt_schema(&mut self, record: &[u8]) {
        self.schemas.push(record.to_vec());
    }

    /// Adds the channel record of a segment that is being repaired.
    pub fn adopt_channel(&mut self, record: &[u8]) {
        self.channels.push(record.to_vec());
    }
}

/// A chunk under construction: small parts in one buffer, blobs by reference.
#[derive(Default)]
struct Batch<'a> {
    small: Vec<u8>,
    /// Blobs, each with the offset in `small` before which it stands, and its checksum.
    blobs: Vec<(usize, &'a [u8], Hasher)>,
    blob_bytes: u64,
    start_ns: u64,
    end_ns: u64,
    /// Channel, time stamp in nanoseconds and offset of each message.
    messages: Vec<(u16, u64, u64)>,
}

impl<'a> Batch<'a> {
    fn len(&self) -> u64 {
        self.small.len() as u64 + self.blob_bytes
    }

    /// Adds a message and returns the offset of its last part within the chunk's data, and the checksum of
    /// that part.
    fn message(
        &mut self,
        channel: u16,
        sequence: u32,
        stamp_ns: u64,
        head: &[u8],
        tail: &'a [u8],
        copy: bool,
    ) -> Spot {
        if self.messages.is_empty() {
            (self.start_ns, self.end_ns) = (stamp_ns, stamp_ns);
        }
        (self.start_ns, self.end_ns) = (self.start_ns.min(stamp_ns), self.end_ns.max(stamp_ns));
        self.messages.push((channel, stamp_ns, self.len()));
        let mut w = Writer(&mut self.small);
        w.0.push(op::MESSAGE);
        w.u64(MESSAGE_HEAD + (head.len() + tail.len()) as u64);
        w.u16(channel);
        w.u32(sequence);
        w.u64(stamp_ns);
        w.u64(stamp_ns);
        w.0.extend_from_slice(head);
        let at = self.len();
        let mut sum = Hasher::new();
        sum.update(tail);
        let crc32 = sum.clone().finalize();
        if copy {
            self.small.extend_from_slice(tail);
        } else {
            self.blobs.push((self.small.len(), tail, sum));
            self.blob_bytes += tail.len() as u64;
        }
        Spot { at, crc32 }
    }

    /// Data of the chunk in slices, and its checksum, combined from those of the blobs.
    fn slices(&self) -> (Vec<&[u8]>, u32) {
        let mut slices = Vec::with_capacity(2 * self.blobs.len() + 1);
        let mut sum = Hasher::new();
        let mut from = 0;
        for (at, blob, of_blob) in &self.blobs {
            slices.extend([&self.small[from..*at], blob]);
            sum.update(&self.small[from..*at]);
            sum.combine(of_blob);
            from = *at;
        }
        slices.push(&self.small[from..]);
        sum.update(&self.small[from..]);
        slices.retain(|s| !s.is_empty());
        (slices, sum.finalize())
    }
}

/// Size below which a blob is copied into one buffer, bytes, since a system call for each would cost more.
const COPIED_BELOW: usize = 16 << 10;

impl Segment {
    /// Creates a segment; its header is written, but not synced.
    pub fn create(path: &Path, number: u64) -> Result<Self, Error> {
        let file = File::options().read(true).write(true).create_new(true).open(path);
        let file = file.map_err(|e| Error::file("cannot create", path, e))?;
        let mut head = MAGIC.to_vec();
        Writer(&mut head).record(op::HEADER, |w| {
            w.text("");
            w.text(concat!("descry ", env!("CARGO_PKG_VERSION")));
        });
        let mut segment = Segment {
            path: path.to_owned(),
            number,
            file,
            end: 0,
            channels: Channels::default(),
            chunks: Vec::new(),
        };
        segment.write(&[&head])?;
        Ok(segment)
    }

    /// Reopens an existing segment to finish it.
    pub fn reopen(
        path: &Path,
        number: u64,
        end: u64,
        channels: Channels,
        chunks: Vec<ChunkEntry>,
    ) -> Result<Self, Error> {
        let file = File::options()
            .read(true)
            .write(true)
            .open(path)
            .map_err(|e| Error::file("cannot write", path, e))?;
        let segment = Segment { path: path.to_owned(), number, file, end, channels, chunks };
        segment.cut()?;
        Ok(segment)
    }

    /// Writes a batch as one chunk; on an error the file stays unchanged.
    pub fn append(&mut self, batch: &[Encoded]) -> Result<Vec<Located>, Error> {
        let mut declared = Vec::new();
        let (counts, schemas, channels) =
            (self.channels.messages.clone(), self.channels.schemas.len(), self.channels.channels.len());
        let result = self.chunk(batch, &mut declared);
        if result.is_err() {
            self.channels.messages = counts;
            self.forget_after(schemas, channels);
            self.cut()?;
        }
        result
    }

    fn forget_after(&mut self, schemas: usize, channels: usize) {
        let c = &mut self.channels;
        c.schemas.truncate(schemas);
        c.channels.truncate(channels);
        c.schema_ids.retain(|_, id| usize::from(*id) <= schemas);
        c.ids.retain(|_, id| usize::from(*id) < channels);
    }

    fn chunk(&mut self, batch: &[Encoded], declared: &mut Vec<u8>) -> Result<Vec<Located>, Error> {
        let mut chunk = Batch::default();
        let chunk_at = self.end;
        let data_at = chunk_at + RECORD_HEAD + CHUNK_HEAD;
        let mut located = Vec::with_capacity(batch.len());
        for record in batch {
            let document = &record.document;
            let stamp_ns = document.stamp_ns.max(0) as u64;
            let mut place = Located {
                chunk: chunk_at,
                document: Spot { at: 0, crc32: 0 },
                document_bytes: 0,
                blobs: Vec::new(),
                message_bytes: 0,
            };
            let before = chunk.len();
            for (info, data) in document.blobs.iter().zip(&record.blobs) {
                let topic = foxglove::topic(document, info);
                let channel = self.channels.channel(&topic, Some(info.form), declared)?;
                chunk.small.append(declared);
                let prefix = foxglove::prefix(document, info);
                let sequence = self.channels.count(channel);
                let spot =
                    chunk.message(channel, sequence, stamp_ns, &prefix, data, data.len() < COPIED_BELOW);
                place.blobs.push(Spot { at: data_at + spot.at, ..spot });
            }
            let text = encode(document)?;
            let channel = self.channels.channel(&foxglove::document_topic(&document.kind), None, declared)?;
            chunk.small.append(declared);
            let sequence = self.channels.count(channel);
            let end = chunk.message(channel, sequence, stamp_ns, &text, &[], true).at;
            place.document = Spot { at: data_at + end - text.len() as u64, crc32: crc32fast::hash(&text) };
            place.document_bytes = text.len() as u64;
            place.message_bytes = chunk.len() - before;
            located.push(place);
        }
        self.write_chunk(&chunk)?;
        Ok(located)
    }

    fn write_chunk(&mut self, chunk: &Batch) -> Result<(), Error> {
        let (slices, crc32) = chunk.slices();
        let mut head = Vec::with_capacity(64);
        let mut w = Writer(&mut head);
        w.0.push(op::CHUNK);
        w.u64(CHUNK_HEAD + chunk.len());
        w.u64(chunk.start_ns);
        w.u64(chunk.end_ns);
        w.u64(chunk.len());
        w.u32(crc32);
        w.text("");
        w.u64(chunk.len());
        let offset = self.end;
        let bytes = head.len() as u64 + chunk.len();
        let (index, indexes) = message_index(&chunk.messages);
        let indexes = indexes.into_iter().map(|(channel, at)| (channel, offset + bytes + at)).collect();
        let mut parts = vec![head.as_slice()];
        parts.extend(slices);
        parts.push(&index);
        self.write(&parts)?;
        self.chunks.push(ChunkEntry {
            start_ns: chunk.start_ns,
            end_ns: chunk.end_ns,
            offset,
            bytes,
            data_bytes: chunk.len(),
            index_bytes: index.len() as u64,
            indexes,
        });
        Ok(())
    }

    /// Removes the last chunks, from offset `end` on, whose records could not be indexed.
    pub fn take_back(&mut self, end: u64) -> Result<(), Error> {
        self.chunks.retain(|c| c.offset < end);
        self.end = end;
        self.cut()
    }

    /// Syncs everything to the disk.
    pub fn sync(&self) -> Result<(), Error> {
        self.file.sync_data().map_err(|e| Error::file("cannot sync", &self.path, e))
    }

    /// True if the segment is so long that another should follow.
    pub fn is_long(&self, segment_bytes: u64) -> bool {
        self.end >= segment_bytes || self.chunks.len() >= MAX_CHUNKS
    }

    /// Writes the summary, which viewers use to seek, and syncs; the file is then complete. Returns its
    /// length, bytes.
    pub fn finish(&mut self) -> Result<u64, Error> {
        let end = self.end;
        let bytes = self.summary();
        let result = self.write(&[&bytes]).and_then(|()| self.sync());
        if result.is_err() {
            self.end = end;
            self.cut()?;
        }
        result.map(|()| self.end)
    }

    fn summary(&self) -> Vec<u8> {
        let mut out = Vec::new();
        Writer(&mut out).record(op::DATA_END, |w| w.u32(0));
        let start = out.len();
        let mut groups: Vec<(u8, usize, usize)> = Vec::new();
        let mut group = |code, out: &mut Vec<u8>, write: &mut dyn FnMut(&mut Vec<u8>)| {
            let from = out.len();
            write(out);
            if out.len() > from {
                groups.push((code, from, out.len() - from));
            }
        };
        group(op::SCHEMA, &mut out, &mut |o| {
            self.channels.schemas.iter().for_each(|s| o.extend_from_slice(s))
        });
        group(op::CHANNEL, &mut out, &mut |o| {
            self.channels.channels.iter().for_each(|c| o.extend_from_slice(c))
        });
        group(op::STATISTICS, &mut out, &mut |o| self.statistics(o));
        group(op::CHUNK_INDEX, &mut out, &mut |o| self.chunks.iter().for_each(|c| c.write(o)));
        let offsets_at = out.len();
        for (code, from, length) in groups {
            Writer(&mut out).record(op::SUMMARY_OFFSET, |w| {
                w.0.push(code);
                w.u64(self.end + from as u64);
                w.u64(length as u64);
            });
        }
        let mut w = Writer(&mut out);
        w.0.push(op::FOOTER);
        w.u64(20);
        w.u64(self.end + start as u64);
        w.u64(self.end + offsets_at as u64);
        let crc = crc32fast::hash(&out[start..]);
        out.extend_from_slice(&crc.to_le_bytes());
        out.extend_from_slice(MAGIC);
        out
    }

    fn statistics(&self, out: &mut Vec<u8>) {
        Writer(out).record(op::STATISTICS, |w| {
            w.u64(self.channels.messages.values().sum());
            w.u16(self.channels.schemas.len() as u16);
            w.u32(self.channels.channels.len() as u32);
            w.u32(0);
            w.u32(0);
            w.u32(self.chunks.len() as u32);
            w.u64(self.chunks.iter().map(|c| c.start_ns).min().unwrap_or(0));
            w.u64(self.chunks.iter().map(|c| c.end_ns).max().unwrap_or(0));
            w.u32(self.channels.messages.len() as u32 * 10);
            for (channel, count) in &self.channels.messages {
                w.u16(*channel);
                w.u64(*count);
            }
        });
    }

    /// Writes bytes at the end of the valid data.
    pub fn write(&mut self, parts: &[&[u8]]) -> Result<(), Error> {
        let mut slices: Vec<IoSlice> = parts.iter().map(|p| IoSlice::new(p)).collect();
        let mut rest = slices.as_mut_slice();
        let fail = |path: &Path, e| Error::file("cannot write", path, e);
        self.file.seek(SeekFrom::Start(self.end)).map_err(|e| fail(&self.path, e))?;
        IoSlice::advance_slices(&mut rest, 0);
        while !rest.is_empty() {
            match self.file.write_vectored(rest) {
                Ok(0) => return Err(fail(&self.path, std::io::ErrorKind::WriteZero.into())),
                Ok(n) => IoSlice::advance_slices(&mut rest, n),
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => (),
                Err(e) => return Err(fail(&self.path, e)),
            }
        }
        self.end += parts.iter().map(|p| p.len() as u64).sum::<u64>();
        Ok(())
    }

    /// Truncates the file to the end of the valid data.
    fn cut(&self) -> Result<(), Error> {
        self.file.set_len(self.end).map_err(|e| Error::file("cannot shorten", &self.path, e))
    }
}

impl Channels {
    /// Number of the next message of a channel, from 0.
    fn count(&mut self, channel: u16) -> u32 {
        let count = self.messages.entry(channel).or_default();
        *count += 1;
        (*count - 1) as u32
    }
}

impl ChunkEntry {
    fn write(&self, out: &mut Vec<u8>) {
        Writer(out).record(op::CHUNK_INDEX, |w| {
            w.u64(self.start_ns);
            w.u64(self.end_ns);
            w.u64(self.offset);
            w.u64(self.bytes);
            w.u32(self.indexes.len() as u32 * 10);
            for (channel, at) in &self.indexes {
                w.u16(*channel);
                w.u64(*at);
            }
            w.u64(self.index_bytes);
            w.text("");
            w.u64(self.data_bytes);
            w.u64(self.data_bytes);
        });
    }
}

/// Encodes the message index of a chunk; also returns the offset of each channel's part. `messages` are
/// channel, time and offset of each message.
pub(crate) fn message_index(messages: &[(u16, u64, u64)]) -> (Vec<u8>, Vec<(u16, u64)>) {
    let mut by_channel: BTreeMap<u16, Vec<(u64, u64)>> = BTreeMap::new();
    for (channel, stamp_ns, at) in messages {
        by_channel.entry(*channel).or_default().push((*stamp_ns, *at));
    }
    let mut index = Vec::new();
    let mut begins = Vec::new();
    for (channel, entries) in by_channel {
        begins.push((channel, index.len() as u64));
        Writer(&mut index).record(op::MESSAGE_INDEX, |w| {
            w.u16(channel);
            w.u32(entries.len() as u32 * 16);
            for (stamp_ns, at) in entries {
                w.u64(stamp_ns);
                w.u64(at);
            }
        });
    }
    (index, begins)
}

/// Encodes a document as the bytes of its message.
fn encode(document: &Document) -> Result<Vec<u8>, Error> {
    serde_json::to_vec(document).map_err(|e| Error::Input {
        what: format!("the {} cannot be written as JSON: {e}", document.kind),
        mend: "give maps text for keys".into(),
    })
}
