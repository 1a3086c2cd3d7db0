//! Messages known to robotics viewers (schemas of the `foxglove` package), in the wire format of protocol
//! buffers.
//!
//! Fields may be encoded in any order. The bytes of a blob are always encoded last, so that the part before
//! them follows from the document alone, and the bytes are one piece of the file.

#[doc(hidden)]
pub mod descriptor;
pub(crate) mod wire;

use crate::document::{BlobInfo, Document, Form};
use crate::transforms::Sample;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde_json::Value;
use wire::{Field, Wire, WireReader};

/// A message schema, as declared in an MCAP file.
pub(crate) struct Schema {
    pub name: &'static str,
    pub encoding: &'static str,
    pub data: Vec<u8>,
}

/// MCAP's name for the encoding of blob messages.
pub const PROTOBUF: &str = "protobuf";
/// MCAP's name for the encoding of documents.
pub(crate) const JSON: &str = "json";

/// JSON schema of documents: the common fields; others are allowed.
pub(crate) fn document_schema() -> Schema {
    let text = r#"{"title":"descry.Document","type":"object","required":["id","kind","stamp_ns"],"properties":{"id":{"type":"integer"},"kind":{"type":"string"},"stamp_ns":{"type":"integer"},"end_ns":{"type":"integer"},"frame":{"type":"string"},"robot":{"type":"string"},"seen_from_m":{"type":"array","items":{"type":"number"}},"covers_m":{"type":"object","properties":{"min_m":{"type":"array","items":{"type":"number"}},"max_m":{"type":"array","items":{"type":"number"}}}},"objects":{"type":"array","items":{"type":"object","properties":{"object":{"type":"string"},"confidence":{"type":"number"}}}},"body":{},"blobs":{"type":"array","items":{"type":"object","properties":{"name":{"type":"string"},"form":{"type":"string"},"bytes":{"type":"integer"},"layout":{"type":"object"}}}}}}"#;
    Schema { name: "descry.Document", encoding: "jsonschema", data: text.as_bytes().to_vec() }
}

/// Schema for blobs of a form.
pub(crate) fn schema(form: Form) -> Schema {
    let name = match form {
        Form::PointCloud => "foxglove.PointCloud",
        Form::LaserScan => "foxglove.LaserScan",
        Form::CompressedImage => "foxglove.CompressedImage",
        Form::RawImage => "foxglove.RawImage",
        Form::FrameTransforms => "foxglove.FrameTransforms",
        Form::Log => "foxglove.Log",
        Form::SceneUpdate => "foxglove.SceneUpdate",
        Form::Grid => "foxglove.Grid",
        Form::CameraCalibration => "foxglove.CameraCalibration",
        Form::Bytes => "descry.Blob",
    };
    Schema { name, encoding: PROTOBUF, data: descriptor::set(name) }
}

/// Topic of a blob in an MCAP file.
pub(crate) fn topic(document: &Document, blob: &BlobInfo) -> String {
    let frame = document.frame.trim_start_matches('/');
    let stem = match blob.form {
        Form::PointCloud => "cloud",
        Form::LaserScan => "scan",
        Form::CompressedImage | Form::RawImage => "image",
        Form::FrameTransforms => return "/tf".into(),
        Form::Log | Form::SceneUpdate => return format!("/{}", blob.name),
        Form::Grid => "grid",
        Form::CameraCalibration => "calibration",
        Form::Bytes => return format!("/blob/{}/{}", document.kind, blob.name),
    };
    let own = if blob.name == stem { String::new() } else { format!("/{}", blob.name) };
    if frame.is_empty() { format!("/{stem}{own}") } else { format!("/{stem}/{frame}{own}") }
}

/// Topic of documents of a kind in an MCAP file.
pub(crate) fn document_topic(kind: &str) -> String {
    format!("/document/{kind}")
}

/// Encodes the part of a blob's message that precedes the bytes of the blob.
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
        Form::LaserScan => {
            let angle = |key: &str| blob.layout.get(key).and_then(Value::as_f64).unwrap_or(0.0);
            out.timestamp(1, document.stamp_ns);
            out.text(2, &document.frame);
            out.message(3, |pose| {
                pose.message(1, |_| ());
                pose.message(2, |q| q.double(4, 1.0));
            });
            out.double(4, angle("first_rad"));
            out.double(5, angle("last_rad"));
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
        Form::FrameTransforms | Form::Log | Form::SceneUpdate | Form::Grid | Form::CameraCalibration => (),
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
    /// Details for developers.
    Debug = 1,
    /// Normal event.
    Info = 2,
    /// Unexpected event.
    Warning = 3,
    /// Failure.
    Error = 4,
}

/// Encodes a line of the log (`foxglove.Log`).
pub(crate) fn log(stamp_ns: i64, level: LogLevel, name: &str, message: &str) -> Vec<u8> {
    let mut out = Wire::default();
    out.timestamp(1, stamp_ns);
    out.varint(2, level as u64);
    out.text(3, message);
    out.text(4, name);
    out.0
}

/// Encodes transforms between one pair of frames (`foxglove.FrameTransforms`).
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

/// Decodes `foxglove.FrameTransforms`, losslessly. `None` if the bytes are not such a message.
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
