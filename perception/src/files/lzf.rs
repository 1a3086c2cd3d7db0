//! LZF, the compression of `binary_compressed` PCD: literal runs of up to 32 bytes, and back references of 3 to 264
//! bytes within 8 KiB.

const MAX_LITERAL: usize = 32;
const MAX_OFFSET: usize = 1 << 13;
const MAX_MATCH: usize = 264;
const HASH_BITS: u32 = 15;

/// Reason why a stream cannot be unpacked; `at` is the offset in the compressed stream, bytes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LzfError {
    #[error("the stream ends inside a run")]
    Truncated { at: usize },
    #[error("a back reference points before the beginning")]
    BeforeStart { at: usize },
    #[error("the data unpack to more than {expected} bytes")]
    TooLong { at: usize, expected: usize },
    #[error("the data unpack to {found} bytes where the header says {expected}")]
    TooShort { at: usize, found: usize, expected: usize },
}

impl LzfError {
    /// Offset of the error in the compressed stream, bytes.
    pub(super) fn at(&self) -> usize {
        match *self {
            LzfError::Truncated { at }
            | LzfError::BeforeStart { at }
            | LzfError::TooLong { at, .. }
            | LzfError::TooShort { at, .. } => at,
        }
    }
}

/// Unpacks `packed` to exactly `expected` bytes.
pub fn unpack(packed: &[u8], expected: usize) -> Result<Vec<u8>, LzfError> {
    // A back reference of 3 bytes gives at most 264: a header that claims more lies, and must not make us allocate.
    if expected / MAX_MATCH > packed.len() {
        return Err(LzfError::TooShort { at: packed.len(), found: 0, expected });
    }
    let mut out: Vec<u8> = Vec::with_capacity(expected);
    let mut at = 0;
    while at < packed.len() {
        let control = packed[at] as usize;
        let start = at;
        at += 1;
        if control < MAX_LITERAL {
            let run = packed.get(at..at + control + 1).ok_or(LzfError::Truncated { at: start })?;
            if out.len() + run.len() > expected {
                return Err(LzfError::TooLong { at: start, expected });
            }
            out.extend_from_slice(run);
            at += run.len();
            continue;
        }
        let mut length = control >> 5;
        if length == 7 {
            length += *packed.get(at).ok_or(LzfError::Truncated { at: start })? as usize;
            at += 1;
        }
        length += 2;
        let low = *packed.get(at).ok_or(LzfError::Truncated { at: start })? as usize;
        at += 1;
        let back = ((control & 0x1f) << 8 | low) + 1;
        let from = out.len().checked_sub(back).ok_or(LzfError::BeforeStart { at: start })?;
        if out.len() + length > expected {
            return Err(LzfError::TooLong { at: start, expected });
        }
        copy_within(&mut out, from, length);
    }
    if out.len() < expected {
        return Err(LzfError::TooShort { at, found: out.len(), expected });
    }
    Ok(out)
}

/// Appends `length` bytes of `out` starting at index `from`; if source and copy overlap, the bytes between repeat.
fn copy_within(out: &mut Vec<u8>, from: usize, length: usize) {
    let mut left = length;
    while left > 0 {
        // What was repeated once can be repeated as a whole.
        let step = left.min(out.len() - from);
        out.extend_from_within(from..from + step);
        left -= step;
    }
}

/// Packs `data`; incompressible data grow by one byte in 32.
pub fn pack(data: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(data.len() / 2 + 16);
    let mut last_at = vec![usize::MAX; 1 << HASH_BITS];
    let mut literal_from = 0;
    let mut at = 0;
    while at + 2 < data.len() {
        let hash = hash3(data[at], data[at + 1], data[at + 2]);
        let candidate = std::mem::replace(&mut last_at[hash], at);
        let near = candidate < at && at - candidate <= MAX_OFFSET;
        if !near || data[candidate..candidate + 3] != data[at..at + 3] {
            at += 1;
            continue;
        }
        let limit = (data.len() - at).min(MAX_MATCH);
        let length = (3..limit).find(|&i| data[candidate + i] != data[at + i]).unwrap_or(limit);
        flush_literals(&mut out, &data[literal_from..at]);
        let offset = at - candidate - 1;
        if length - 2 < 7 {
            out.push(((length - 2) << 5 | offset >> 8) as u8);
        } else {
            out.push((7 << 5 | offset >> 8) as u8);
            out.push((length - 9) as u8);
        }
        out.push((offset & 0xff) as u8);
        at += length;
        literal_from = at;
    }
    flush_literals(&mut out, &data[literal_from..]);
    out
}

fn hash3(a: u8, b: u8, c: u8) -> usize {
    let word = u32::from(a) << 16 | u32::from(b) << 8 | u32::from(c);
    (word.wrapping_mul(0x9E37_79B1) >> (32 - HASH_BITS)) as usize
}

fn flush_literals(out: &mut Vec<u8>, run: &[u8]) {
    for part in run.chunks(MAX_LITERAL) {
        out.push((part.len() - 1) as u8);
        out.extend_from_slice(part);
    }
}
