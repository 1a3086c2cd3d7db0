//! The messages that robotics viewers know (schemas of the `foxglove` package), in the wire format of protocol buffers.
//!
//! Fields may stand in any order on that wire. The bytes of a blob are always written last, so that what stands before
//! them follows from the document alone and the bytes themselves lie in the file as one piece.

use crate::document::{BlobInfo, Document, Form};
use crate::transforms::Sample;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde_json::Value;

/// A schema as a segment declares it.
pub(crate) struct Schema {
    pub name: &'static str,
    pub encoding: &'static str,
    pub data: Vec<u8>,
}

/// How messages of a form are encoded, in the words of MCAP.
pub(crate) const PROTOBUF: &str = "protobuf";
/// How documents are encoded.
pub(crate) const JSON: &str = "json";

/// The schema of documents. It says what every document has and leaves the rest open.
pub(crate) fn document_schema() -> Schema {
    let text = r#"{"title":"descry.Document","type":"object","required":["id","kind","stamp_ns"],"properties":{"id":{"type":"integer"},"kind":{"type":"string"},"stamp_ns":{"type":"integer"},"end_ns":{"type":"integer"},"frame":{"type":"string"},"robot":{"type":"string"},"seen_from_m":{"type":"array","items":{"type":"number"}},"covers_m":{"type":"object","properties":{"min_m":{"type":"array","items":{"type":"number"}},"max_m":{"type":"array","items":{"type":"number"}}}},"objects":{"type":"array","items":{"type":"object","properties":{"object":{"type":"string"},"confidence":{"type":"number"}}}},"body":{},"blobs":{"type":"array","items":{"type":"object","properties":{"name":{"type":"string"},"form":{"type":"string"},"bytes":{"type":"integer"},"layout":{"type":"object"}}}}}}"#;
    Schema { name: "descry.Document", encoding: "jsonschema", data: text.as_bytes().to_vec() }
}

/// The schema of blobs of a form.
pub(crate) fn schema(form: Form) -> Schema {
    let name = match form {
        Form::PointCloud => "foxglove.PointCloud",
        Form::CompressedImage => "foxglove.CompressedImage",
        Form::RawImage => "foxglove.RawImage",
        Form::FrameTransforms => "foxglove.FrameTransforms",
        Form::Log => "foxglove.Log",
        Form::Bytes => "descry.Blob",
    };
    Schema { name, encoding: PROTOBUF, data: descriptor_set(name) }
}

/// The topic of a blob.
pub(crate) fn topic(document: &Document, blob: &BlobInfo) -> String {
    let frame = document.frame.trim_start_matches('/');
    let stem = match blob.form {
        Form::PointCloud => "cloud",
        Form::CompressedImage | Form::RawImage => "image",
        Form::FrameTransforms => return "/tf".into(),
        Form::Log => return "/log".into(),
        Form::Bytes => return format!("/blob/{}/{}", document.kind, blob.name),
    };
    let own = if blob.name == stem { String::new() } else { format!("/{}", blob.name) };
    if frame.is_empty() { format!("/{stem}{own}") } else { format!("/{stem}/{frame}{own}") }
}

/// The topic of a document.
pub(crate) fn document_topic(kind: &str) -> String {
    format!("/document/{kind}")
}

/// The part of a blob's message that stands before its bytes.
pub(crate) fn prefix(document: &Document, blob: &BlobInfo) -> Vec<u8> {
    let mut out = Wire::default();
    let number = |key: &str| blob.layout.get(key).and_then(Value::as_u64).unwrap_or(0) as u32;
    let text = |key: &str| blob.layout.get(key).and_then(Value::as_str).unwrap_or("").to_owned();
    match blob.form {
        Form::PointCloud => {
            out.timestamp(1, document.stamp_ns);
            out.text(2, &document.frame);
            out.message(3, |pose| {
                pose.message(1, |_| ());
                pose.message(2, |q| q.double(4, 1.0));
            });
            out.fixed32(4, number("stride"));
            for field in blob.layout.get("fields").and_then(Value::as_array).into_iter().flatten() {
                out.message(5, |f| {
                    f.text(1, field.get("name").and_then(Value::as_str).unwrap_or(""));
                    f.fixed32(2, field.get("offset").and_then(Value::as_u64).unwrap_or(0) as u32);
                    f.varint(3, numeric_type(field.get("type").and_then(Value::as_str).unwrap_or("")));
                });
            }
            out.bytes_header(6, blob.bytes);
        }
        Form::CompressedImage => {
            out.timestamp(1, document.stamp_ns);
            out.text(3, &text("format"));
            out.text(4, &document.frame);
            out.bytes_header(2, blob.bytes);
        }
        Form::RawImage => {
            out.timestamp(1, document.stamp_ns);
            out.text(7, &document.frame);
            out.fixed32(2, number("width"));
            out.fixed32(3, number("height"));
            out.text(4, &text("encoding"));
            out.fixed32(5, number("step"));
            out.bytes_header(6, blob.bytes);
        }
        Form::Bytes => {
            out.timestamp(1, document.stamp_ns);
            out.text(2, &blob.name);
            out.bytes_header(3, blob.bytes);
        }
        Form::FrameTransforms | Form::Log => (),
    }
    out.0
}

fn numeric_type(name: &str) -> u64 {
    let names = ["unknown", "u8", "i8", "u16", "i16", "u32", "i32", "f32", "f64"];
    names.iter().position(|n| *n == name).unwrap_or(0) as u64
}

/// Severity of a line of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogLevel {
    /// For who mends the program.
    Debug = 1,
    /// News.
    Info = 2,
    /// Something to look at.
    Warning = 3,
    /// Something went wrong.
    Error = 4,
}

/// One line of the log (`foxglove.Log`).
pub(crate) fn log(stamp_ns: i64, level: LogLevel, name: &str, message: &str) -> Vec<u8> {
    let mut out = Wire::default();
    out.timestamp(1, stamp_ns);
    out.varint(2, level as u64);
    out.text(3, message);
    out.text(4, name);
    out.0
}

/// Transforms of one link (`foxglove.FrameTransforms`).
pub(crate) fn frame_transforms(parent: &str, child: &str, samples: &[Sample]) -> Vec<u8> {
    let mut out = Wire(Vec::with_capacity(samples.len() * (100 + parent.len() + child.len())));
    for sample in samples {
        let (t, q) = (sample.parent_from_child.translation.vector, sample.parent_from_child.rotation.coords);
        out.message(1, |m| {
            m.timestamp(1, sample.stamp_ns);
            m.text(2, parent);
            m.text(3, child);
            m.message(4, |v| (1..).zip(t.iter()).for_each(|(n, x)| v.double(n, *x)));
            m.message(5, |v| (1..).zip(q.iter()).for_each(|(n, x)| v.double(n, *x)));
        });
    }
    out.0
}

/// Reads `foxglove.FrameTransforms` back: the samples, bit for bit. `None` if the bytes are no such message.
pub(crate) fn read_frame_transforms(bytes: &[u8]) -> Option<Vec<Sample>> {
    let mut samples = Vec::new();
    let mut reader = WireReader(bytes);
    while let Some((1, Field::Bytes(message))) = reader.next()? {
        let mut stamp_ns = 0;
        let (mut t, mut q) = ([0.0; 3], [0.0; 4]);
        let mut fields = WireReader(message);
        while let Some(field) = fields.next()? {
            match field {
                (1, Field::Bytes(b)) => stamp_ns = read_timestamp(b)?,
                (4, Field::Bytes(b)) => read_doubles(b, &mut t)?,
                (5, Field::Bytes(b)) => read_doubles(b, &mut q)?,
                _ => (),
            }
        }
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(q[3], q[0], q[1], q[2]));
        let parent_from_child = Isometry3::from_parts(Translation3::new(t[0], t[1], t[2]), rotation);
        samples.push(Sample { stamp_ns, parent_from_child });
    }
    reader.0.is_empty().then_some(samples)
}

fn read_timestamp(bytes: &[u8]) -> Option<i64> {
    let (mut seconds, mut nanos) = (0_i64, 0_i64);
    let mut fields = WireReader(bytes);
    while let Some(field) = fields.next()? {
        match field {
            (1, Field::Varint(v)) => seconds = v as i64,
            (2, Field::Varint(v)) => nanos = v as i64,
            _ => (),
        }
    }
    seconds.checked_mul(1_000_000_000)?.checked_add(nanos)
}

fn read_doubles(bytes: &[u8], into: &mut [f64]) -> Option<()> {
    let mut fields = WireReader(bytes);
    while let Some(field) = fields.next()? {
        if let (number, Field::Fixed64(v)) = field {
            *into.get_mut(number.checked_sub(1)? as usize)? = f64::from_bits(v);
        }
    }
    Some(())
}

/// Writes protocol buffers.
#[derive(Default)]
struct Wire(Vec<u8>);

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

    fn varint(&mut self, number: u32, value: u64) {
        self.tag(number, 0);
        self.raw_varint(value);
    }

    fn double(&mut self, number: u32, value: f64) {
        // Positive zero is what a missing field means.
        if value.to_bits() != 0 {
            self.tag(number, 1);
            self.0.extend_from_slice(&value.to_le_bytes());
        }
    }

    fn fixed32(&mut self, number: u32, value: u32) {
        self.tag(number, 5);
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    fn bytes_header(&mut self, number: u32, length: u64) {
        self.tag(number, 2);
        self.raw_varint(length);
    }

    fn text(&mut self, number: u32, value: &str) {
        self.bytes_header(number, value.len() as u64);
        self.0.extend_from_slice(value.as_bytes());
    }

    fn message(&mut self, number: u32, write: impl FnOnce(&mut Wire)) {
        let mut inner = Wire::default();
        write(&mut inner);
        self.bytes_header(number, inner.0.len() as u64);
        self.0.extend_from_slice(&inner.0);
    }

    fn timestamp(&mut self, number: u32, stamp_ns: i64) {
        self.message(number, |t| {
            t.varint(1, stamp_ns.div_euclid(1_000_000_000) as u64);
            t.varint(2, stamp_ns.rem_euclid(1_000_000_000) as u64);
        });
    }
}

/// Reads protocol buffers, field by field.
struct WireReader<'a>(&'a [u8]);

enum Field<'a> {
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

    /// The next field; `Some(None)` at the end, `None` if the bytes are no message.
    #[expect(clippy::option_option, reason = "the end of a message and a broken one are different things")]
    fn next(&mut self) -> Option<Option<(u32, Field<'a>)>> {
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

/// A field of a message for [`descriptor_set`]: number, name, type (as in `descriptor.proto`), repeated, type name.
type FieldSpec = (u32, &'static str, u64, bool, &'static str);

const DOUBLE: u64 = 1;
const INT64: u64 = 3;
const INT32: u64 = 5;
const FIXED32: u64 = 7;
const STRING: u64 = 9;
const MESSAGE: u64 = 11;
const BYTES: u64 = 12;
const ENUM: u64 = 14;

/// What a message is called, what it is made of, and the files that it needs.
fn message_spec(name: &str) -> (&'static [FieldSpec], &'static [&'static str]) {
    const TIME: FieldSpec = (1, "timestamp", MESSAGE, false, ".google.protobuf.Timestamp");
    match name {
        "google.protobuf.Timestamp" => {
            (&[(1, "seconds", INT64, false, ""), (2, "nanos", INT32, false, "")], &[])
        }
        "foxglove.Vector3" => {
            (&[(1, "x", DOUBLE, false, ""), (2, "y", DOUBLE, false, ""), (3, "z", DOUBLE, false, "")], &[])
        }
        "foxglove.Quaternion" => (
            &[
                (1, "x", DOUBLE, false, ""),
                (2, "y", DOUBLE, false, ""),
                (3, "z", DOUBLE, false, ""),
                (4, "w", DOUBLE, false, ""),
            ],
            &[],
        ),
        "foxglove.Pose" => (
            &[
                (1, "position", MESSAGE, false, ".foxglove.Vector3"),
                (2, "orientation", MESSAGE, false, ".foxglove.Quaternion"),
            ],
            &["foxglove.Vector3", "foxglove.Quaternion"],
        ),
        "foxglove.PackedElementField" => (
            &[
                (1, "name", STRING, false, ""),
                (2, "offset", FIXED32, false, ""),
                (3, "type", ENUM, false, ".foxglove.PackedElementField.NumericType"),
            ],
            &[],
        ),
        "foxglove.PointCloud" => (
            &[
                TIME,
                (2, "frame_id", STRING, false, ""),
                (3, "pose", MESSAGE, false, ".foxglove.Pose"),
                (4, "point_stride", FIXED32, false, ""),
                (5, "fields", MESSAGE, true, ".foxglove.PackedElementField"),
                (6, "data", BYTES, false, ""),
            ],
            &["google.protobuf.Timestamp", "foxglove.Pose", "foxglove.PackedElementField"],
        ),
        "foxglove.CompressedImage" => (
            &[
                TIME,
                (4, "frame_id", STRING, false, ""),
                (2, "data", BYTES, false, ""),
                (3, "format", STRING, false, ""),
            ],
            &["google.protobuf.Timestamp"],
        ),
        "foxglove.RawImage" => (
            &[
                TIME,
                (7, "frame_id", STRING, false, ""),
                (2, "width", FIXED32, false, ""),
                (3, "height", FIXED32, false, ""),
                (4, "encoding", STRING, false, ""),
                (5, "step", FIXED32, false, ""),
                (6, "data", BYTES, false, ""),
            ],
            &["google.protobuf.Timestamp"],
        ),
        "foxglove.FrameTransform" => (
            &[
                TIME,
                (2, "parent_frame_id", STRING, false, ""),
                (3, "child_frame_id", STRING, false, ""),
                (4, "translation", MESSAGE, false, ".foxglove.Vector3"),
                (5, "rotation", MESSAGE, false, ".foxglove.Quaternion"),
            ],
            &["google.protobuf.Timestamp", "foxglove.Vector3", "foxglove.Quaternion"],
        ),
        "foxglove.FrameTransforms" => {
            (&[(1, "transforms", MESSAGE, true, ".foxglove.FrameTransform")], &["foxglove.FrameTransform"])
        }
        "foxglove.Log" => (
            &[
                TIME,
                (2, "level", ENUM, false, ".foxglove.LogLevel"),
                (3, "message", STRING, false, ""),
                (4, "name", STRING, false, ""),
                (5, "file", STRING, false, ""),
                (6, "line", FIXED32, false, ""),
            ],
            &["google.protobuf.Timestamp"],
        ),
        _ => (
            &[TIME, (2, "name", STRING, false, ""), (3, "data", BYTES, false, "")],
            &["google.protobuf.Timestamp"],
        ),
    }
}

fn file_name(message: &str) -> String {
    match message {
        "google.protobuf.Timestamp" => "google/protobuf/timestamp.proto".into(),
        other => format!("{}.proto", other.replace('.', "/")),
    }
}

/// The `FileDescriptorSet` of a message and all that it needs, what is needed first.
fn descriptor_set(message: &'static str) -> Vec<u8> {
    fn visit(message: &'static str, done: &mut Vec<&'static str>) {
        for needed in message_spec(message).1 {
            visit(needed, done);
        }
        if !done.contains(&message) {
            done.push(message);
        }
    }
    let mut order = Vec::new();
    visit(message, &mut order);
    let mut out = Wire::default();
    for name in order {
        out.message(1, |file| write_file(file, name));
    }
    out.0
}

/// A `FileDescriptorProto` with one message.
fn write_file(file: &mut Wire, name: &str) {
    let (package, short) = name.rsplit_once('.').unwrap_or(("", name));
    let (fields, needs) = message_spec(name);
    file.text(1, &file_name(name));
    file.text(2, package);
    for needed in needs {
        file.text(3, &file_name(needed));
    }
    file.message(4, |m| {
        m.text(1, short);
        for (number, field, kind, repeated, type_name) in fields {
            m.message(2, |f| {
                f.text(1, field);
                f.varint(3, u64::from(*number));
                f.varint(4, if *repeated { 3 } else { 1 });
                f.varint(5, *kind);
                if !type_name.is_empty() {
                    f.text(6, type_name);
                }
            });
        }
        if name == "foxglove.PackedElementField" {
            let values =
                ["UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"];
            m.message(4, |e| write_enum(e, "NumericType", &values));
        }
    });
    if name == "foxglove.Log" {
        file.message(5, |e| {
            write_enum(e, "LogLevel", &["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"])
        });
    }
    file.text(12, "proto3");
}

fn write_enum(out: &mut Wire, name: &str, values: &[&str]) {
    out.text(1, name);
    for (i, value) in values.iter().enumerate() {
        out.message(2, |v| {
            v.text(1, value);
            v.varint(2, i as u64);
        });
    }
}
