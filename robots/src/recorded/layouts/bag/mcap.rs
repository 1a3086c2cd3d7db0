//! Bags in MCAP.

use super::{Message, Messages, Place, Topic};
use crate::input::InputError;
use crate::recorded::folder::shown;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;
/// Maximum size of an unpacked chunk, bytes. From: chosen.
const MOST_CHUNK: u64 = 1 << 30;
/// Marks a message outside of chunks, in place of its offset in a chunk.
const OUTSIDE: u64 = u64::MAX;

pub(super) struct Mcap {
    path: PathBuf,
    file: BufReader<File>,
    length: u64,
    topics: BTreeMap<u16, Topic>,
    /// Records of the chunk that was unpacked last, with the offset of the chunk in the file.
    unpacked: Option<(u64, Arc<Vec<u8>>)>,
}

/// Bytes of a record, read from front to back.
struct Part<'a>(&'a [u8]);

impl<'a> Part<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (found, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(found)
    }

    fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn text(&mut self) -> Option<String> {
        let length = self.u32()? as usize;
        String::from_utf8(self.take(length)?.to_vec()).ok()
    }

    /// Next record: its opcode and its content; `None` if the bytes end within it.
    fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let kind = *self.take(1)?.first()?;
        let length = usize::try_from(self.u64()?).ok()?;
        Some((kind, self.take(length)?))
    }
}

/// Schemas and channels of the file, collected from records.
#[derive(Default)]
struct Channels {
    schemas: BTreeMap<u16, String>,
    topics: BTreeMap<u16, Topic>,
}

impl Channels {
    fn hear(&mut self, kind: u8, content: &[u8]) -> Option<()> {
        let mut part = Part(content);
        match kind {
            SCHEMA => {
                self.schemas.insert(part.u16()?, part.text()?);
            }
            CHANNEL => {
                let (id, schema) = (part.u16()?, part.u16()?);
                let (name, encoding) = (part.text()?, part.text()?);
                let kind = self.schemas.get(&schema).cloned().unwrap_or_default();
                self.topics.insert(id, Topic { name, kind, encoding });
            }
            _ => {}
        }
        Some(())
    }
}

impl Mcap {
    pub(super) fn open(path: &Path) -> Result<Mcap, InputError> {
        let unreadable = |e: std::io::Error| {
            InputError::whole(shown(path), format!("cannot be read: {e}"), "the file of a bag is expected")
        };
        let file = File::open(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        let mut bag = Mcap {
            path: path.into(),
            file: BufReader::new(file),
            length,
            topics: BTreeMap::new(),
            unpacked: None,
        };
        let mut magic = [0; 8];
        if bag.file.read_exact(&mut magic).is_err() || magic != MAGIC {
            return Err(bag.broken(0, "the first bytes are not those of MCAP"));
        }
        let mut channels = Channels::default();
        bag.walk(&mut |_, _, kind, content| {
            channels.hear(kind, content);
            Ok(())
        })?;
        bag.topics = channels.topics;
        Ok(bag)
    }

    fn broken(&self, offset: u64, problem: &str) -> InputError {
        let place = format!("{}, byte {offset}", shown(&self.path));
        InputError::whole(
            place,
            problem,
            "the file is damaged or was cut: `mcap recover` saves what is whole",
        )
    }

    /// Opcode and content of the record at an offset of the file, and the offset of the next record.
    fn record_at(&mut self, offset: u64) -> Result<(u8, Vec<u8>, u64), InputError> {
        let mut head = [0; 9];
        let read = self.file.seek(SeekFrom::Start(offset)).and_then(|_| self.file.read_exact(&mut head));
        let length = u64::from_le_bytes(head[1..].try_into().unwrap_or_default());
        let end = (offset + 9).checked_add(length).filter(|end| *end <= self.length);
        let (Ok(()), Some(end)) = (read, end) else {
            return Err(self.broken(offset, "a record reaches beyond the end of the file"));
        };
        let mut content = Vec::new();
        let read = (&mut self.file).take(length).read_to_end(&mut content);
        match read {
            Ok(_) if content.len() as u64 == length => Ok((head[0], content, end)),
            _ => Err(self.broken(offset, "a record cannot be read")),
        }
    }

    /// Decompresses the records of a chunk.
    fn unpack(&self, offset: u64, content: &[u8]) -> Result<Vec<u8>, InputError> {
        let mut part = Part(content);
        let head = (|| {
            let (_, _, size, _) = (part.u64()?, part.u64()?, part.u64()?, part.u32()?);
            let compression = part.text()?;
            let length = usize::try_from(part.u64()?).ok()?;
            Some((size, compression, part.take(length)?))
        })();
        let Some((size, compression, records)) = head.filter(|(size, _, _)| *size <= MOST_CHUNK) else {
            return Err(self.broken(offset, "a chunk whose head cannot be"));
        };
        let mut unpacked = Vec::new();
        let read = match compression.as_str() {
            "" => return Ok(records.to_vec()),
            "zstd" => ruzstd::decoding::StreamingDecoder::new(records)
                .map_err(|e| e.to_string())
                .and_then(|decoder| decoder.take(size).read_to_end(&mut unpacked).map_err(|e| e.to_string())),
            "lz4" => lz4_flex::frame::FrameDecoder::new(records)
                .take(size)
                .read_to_end(&mut unpacked)
                .map_err(|e| e.to_string()),
            other => {
                return Err(self.broken(offset, &format!("a chunk packed by {other}, expected zstd or lz4")));
            }
        };
        match read {
            Ok(_) if unpacked.len() as u64 == size => Ok(unpacked),
            Ok(_) => Err(self.broken(offset, "a chunk is shorter than it says")),
            Err(e) => Err(self.broken(offset, &format!("a chunk cannot be unpacked: {e}"))),
        }
    }

    fn chunk(&mut self, offset: u64) -> Result<Arc<Vec<u8>>, InputError> {
        match &self.unpacked {
            Some((at, records)) if *at == offset => return Ok(Arc::clone(records)),
            _ => {}
        }
        let (_, content, _) = self.record_at(offset)?;
        let records = Arc::new(self.unpack(offset, &content)?);
        self.unpacked = Some((offset, Arc::clone(&records)));
        Ok(records)
    }

    /// Calls `see` for every record of the data with four values: the offset of its chunk (or its own,
    /// outside of chunks), its offset in the chunk (or [`OUTSIDE`]), opcode and content.
    fn walk(
        &mut self,
        see: &mut dyn FnMut(u64, u64, u8, &[u8]) -> Result<(), InputError>,
    ) -> Result<(), InputError> {
        let mut offset = MAGIC.len() as u64;
        while offset < self.length {
            let (kind, content, next) = self.record_at(offset)?;
            match kind {
                DATA_END => return Ok(()),
                CHUNK => {
                    let records = self.unpack(offset, &content)?;
                    let mut part = Part(&records);
                    while !part.0.is_empty() {
                        let place = (records.len() - part.0.len()) as u64;
                        let Some((kind, content)) = part.record() else {
                            return Err(self.broken(offset, "a record reaches beyond its chunk"));
                        };
                        see(offset, place, kind, content)?;
                    }
                }
                _ => see(offset, OUTSIDE, kind, &content)?,
            }
            offset = next;
        }
        Ok(())
    }
}

/// Length of a message's fields before its data, bytes: channel, sequence and two times.
const HEAD: usize = 2 + 4 + 8 + 8;

impl Messages for Mcap {
    fn topics(&self) -> Vec<Topic> {
        self.topics.values().cloned().collect()
    }

    fn each(
        &mut self,
        wanted: &dyn Fn(&Topic) -> bool,
        see: &mut dyn FnMut(Message<'_>) -> Result<(), InputError>,
    ) -> Result<(), InputError> {
        let topics = std::mem::take(&mut self.topics);
        let walked = self.walk(&mut |chunk, place, kind, content| {
            let channel = Part(content).u16().filter(|_| kind == MESSAGE);
            let Some(topic) = channel.and_then(|id| topics.get(&id)).filter(|topic| wanted(topic)) else {
                return Ok(());
            };
            see(Message { topic, place: Place(chunk, place), data: content.get(HEAD..).unwrap_or_default() })
        });
        self.topics = topics;
        walked
    }

    fn at(&mut self, place: Place) -> Result<Vec<u8>, InputError> {
        if place.1 == OUTSIDE {
            let (_, content, _) = self.record_at(place.0)?;
            return Ok(content.get(HEAD..).unwrap_or_default().to_vec());
        }
        let records = self.chunk(place.0)?;
        let rest = usize::try_from(place.1).ok().and_then(|at| records.get(at..)).unwrap_or_default();
        let record = Part(rest).record();
        let (_, content) = record.ok_or_else(|| self.broken(place.0, "a record reaches beyond its chunk"))?;
        Ok(content.get(HEAD..).unwrap_or_default().to_vec())
    }
}
