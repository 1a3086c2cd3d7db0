//! The wire format of protocol buffers.

/// Protocol buffer writer.
#[derive(Default)]
pub(crate) struct Wire(pub Vec<u8>);

impl Wire {
    fn raw_varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn tag(&mut self, number: u32, wire_type: u32) {
        self.raw_varint(u64::from(number << 3 | wire_type));
    }

    pub fn varint(&mut self, number: u32, value: u64) {
        self.tag(number, 0);
        self.raw_varint(value);
    }

    pub fn double(&mut self, number: u32, value: f64) {
        // Positive zero is what a missing field means.
        if value.to_bits() != 0 {
            self.tag(number, 1);
            self.0.extend_from_slice(&value.to_le_bytes());
        }
    }

    pub fn fixed32(&mut self, number: u32, value: u32) {
        self.tag(number, 5);
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    /// Writes packed doubles, also zeros.
    pub fn doubles(&mut self, number: u32, values: &[f64]) {
        self.bytes_header(number, 8 * values.len() as u64);
        values.iter().for_each(|value| self.0.extend_from_slice(&value.to_le_bytes()));
    }

    pub fn bytes(&mut self, number: u32, value: &[u8]) {
        self.bytes_header(number, value.len() as u64);
        self.0.extend_from_slice(value);
    }

    pub fn bytes_header(&mut self, number: u32, length: u64) {
        self.tag(number, 2);
        self.raw_varint(length);
    }

    pub fn text(&mut self, number: u32, value: &str) {
        self.bytes(number, value.as_bytes());
    }

    pub fn message(&mut self, number: u32, write: impl FnOnce(&mut Wire)) {
        let mut inner = Wire::default();
        write(&mut inner);
        self.bytes(number, &inner.0);
    }

    pub fn timestamp(&mut self, number: u32, stamp_ns: i64) {
        self.message(number, |t| {
            t.varint(1, stamp_ns.div_euclid(1_000_000_000) as u64);
            t.varint(2, stamp_ns.rem_euclid(1_000_000_000) as u64);
        });
    }
}

/// Protocol buffer reader, field by field.
pub(super) struct WireReader<'a>(pub &'a [u8]);

pub(super) enum Field<'a> {
    Varint(u64),
    Fixed64(u64),
    Bytes(&'a [u8]),
    Fixed32,
}

impl<'a> WireReader<'a> {
    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(head)
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.take(1)?[0];
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    /// Reads the next field; `Some(None)` at the end, `None` if the bytes are malformed.
    #[expect(clippy::option_option, reason = "the end of a message and a broken one are different things")]
    pub fn next(&mut self) -> Option<Option<(u32, Field<'a>)>> {
        if self.0.is_empty() {
            return Some(None);
        }
        let tag = self.varint()?;
        let field = match tag & 7 {
            0 => Field::Varint(self.varint()?),
            1 => Field::Fixed64(u64::from_le_bytes(self.take(8)?.try_into().ok()?)),
            2 => {
                let length = usize::try_from(self.varint()?).ok()?;
                Field::Bytes(self.take(length)?)
            }
            5 => {
                self.take(4)?;
                Field::Fixed32
            }
            _ => return None,
        };
        Some(Some((u32::try_from(tag >> 3).ok()?, field)))
    }
}
