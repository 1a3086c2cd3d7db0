//! Schemas of the messages (`descriptor.proto`), as declared by every MCAP file.

use super::wire::Wire;

/// Messages by name, with their fields in `.proto` syntax. A field of message type refers to the file of that
/// message.
pub const MESSAGES: [(&str, &str); 22] = [
    ("google.protobuf.Timestamp", "int64 seconds = 1; int32 nanos = 2"),
    ("foxglove.Vector3", "double x = 1; double y = 2; double z = 3"),
    ("foxglove.Quaternion", "double x = 1; double y = 2; double z = 3; double w = 4"),
    ("foxglove.Pose", "foxglove.Vector3 position = 1; foxglove.Quaternion orientation = 2"),
    (
        "foxglove.PackedElementField",
        "string name = 1; fixed32 offset = 2; enum foxglove.PackedElementField.NumericType type = 3",
    ),
    (
        "foxglove.PointCloud",
        "google.protobuf.Timestamp timestamp = 1; string frame_id = 2; foxglove.Pose pose = 3; fixed32 point_stride = 4; \
         repeated foxglove.PackedElementField fields = 5; bytes data = 6",
    ),
    (
        "foxglove.LaserScan",
        "google.protobuf.Timestamp timestamp = 1; string frame_id = 2; foxglove.Pose pose = 3; double start_angle = 4; \
         double end_angle = 5; repeated double ranges = 6; repeated double intensities = 7",
    ),
    (
        "foxglove.CompressedImage",
        "google.protobuf.Timestamp timestamp = 1; string frame_id = 4; bytes data = 2; string format = 3",
    ),
    (
        "foxglove.RawImage",
        "google.protobuf.Timestamp timestamp = 1; string frame_id = 7; fixed32 width = 2; fixed32 height = 3; \
         string encoding = 4; fixed32 step = 5; bytes data = 6",
    ),
    (
        "foxglove.FrameTransform",
        "google.protobuf.Timestamp timestamp = 1; string parent_frame_id = 2; string child_frame_id = 3; \
         foxglove.Vector3 translation = 4; foxglove.Quaternion rotation = 5",
    ),
    ("foxglove.FrameTransforms", "repeated foxglove.FrameTransform transforms = 1"),
    (
        "foxglove.Log",
        "google.protobuf.Timestamp timestamp = 1; enum foxglove.LogLevel level = 2; string message = 3; string name = 4; \
         string file = 5; fixed32 line = 6",
    ),
    ("foxglove.Vector2", "double x = 1; double y = 2"),
    ("foxglove.Color", "double r = 1; double g = 2; double b = 3; double a = 4"),
    ("foxglove.CubePrimitive", "foxglove.Pose pose = 1; foxglove.Vector3 size = 2; foxglove.Color color = 3"),
    (
        "foxglove.TextPrimitive",
        "foxglove.Pose pose = 1; bool billboard = 2; double font_size = 3; bool scale_invariant = 4; foxglove.Color color = 5; \
         string text = 6",
    ),
    (
        "foxglove.SceneEntityDeletion",
        "google.protobuf.Timestamp timestamp = 1; enum foxglove.SceneEntityDeletion.Type type = 2; string id = 3",
    ),
    // Of the primitives of an entity, those that are written.
    (
        "foxglove.SceneEntity",
        "google.protobuf.Timestamp timestamp = 1; string frame_id = 2; string id = 3; bool frame_locked = 5; \
         repeated foxglove.CubePrimitive cubes = 8; repeated foxglove.TextPrimitive texts = 13",
    ),
    (
        "foxglove.SceneUpdate",
        "repeated foxglove.SceneEntityDeletion deletions = 1; repeated foxglove.SceneEntity entities = 2",
    ),
    (
        "foxglove.Grid",
        "google.protobuf.Timestamp timestamp = 1; string frame_id = 2; foxglove.Pose pose = 3; fixed32 column_count = 4; \
         foxglove.Vector2 cell_size = 5; fixed32 row_stride = 6; fixed32 cell_stride = 7; \
         repeated foxglove.PackedElementField fields = 8; bytes data = 9",
    ),
    (
        "foxglove.CameraCalibration",
        "google.protobuf.Timestamp timestamp = 1; string frame_id = 9; fixed32 width = 2; fixed32 height = 3; \
         string distortion_model = 4; repeated double D = 5; repeated double K = 6; repeated double R = 7; repeated double P = 8",
    ),
    ("descry.Blob", "google.protobuf.Timestamp timestamp = 1; string name = 2; bytes data = 3"),
];

const NUMERIC_TYPES: [&str; 9] =
    ["UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"];
const DELETIONS: [&str; 2] = ["MATCHING_ID", "ALL"];
const LOG_LEVELS: [&str; 6] = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];

/// Scalar types by their numbers in `descriptor.proto`.
const SCALARS: [(&str, u64); 7] =
    [("bool", 8), ("double", 1), ("int64", 3), ("int32", 5), ("fixed32", 7), ("string", 9), ("bytes", 12)];
const MESSAGE: u64 = 11;
const ENUM: u64 = 14;

/// A field of a message.
pub struct Field {
    number: u64,
    name: &'static str,
    kind: u64,
    repeated: bool,
    /// Name of the field's message or enumeration type; `None` for scalars.
    of: Option<&'static str>,
}

pub fn fields(message: &str) -> Vec<Field> {
    let listed = MESSAGES.iter().find(|(name, _)| *name == message).map_or("", |(_, fields)| fields);
    listed.split(';').filter_map(field).collect()
}

/// Parses a field `repeated TYPE NAME = NUMBER`, with `enum` before an enumeration type; `None` if malformed.
pub fn field(text: &'static str) -> Option<Field> {
    let (before, number) = text.split_once('=')?;
    let words: Vec<&'static str> = before.split_whitespace().collect();
    let [.., of, name] = words[..] else { return None };
    let scalar = SCALARS.iter().find(|(scalar, _)| *scalar == of).map(|(_, kind)| *kind);
    let kind = scalar.unwrap_or(if words.contains(&"enum") { ENUM } else { MESSAGE });
    Some(Field {
        number: number.trim().parse().ok()?,
        name,
        kind,
        repeated: words.contains(&"repeated"),
        of: scalar.is_none().then_some(of),
    })
}

/// Names of the message types of a message's fields.
fn needs(message: &str) -> Vec<&'static str> {
    fields(message).into_iter().filter(|f| f.kind == MESSAGE).filter_map(|f| f.of).collect()
}

fn file_name(message: &str) -> String {
    match message {
        "google.protobuf.Timestamp" => "google/protobuf/timestamp.proto".into(),
        other => format!("{}.proto", other.replace('.', "/")),
    }
}

/// Encodes the `FileDescriptorSet` of a message and its dependencies, dependencies first.
pub fn set(message: &'static str) -> Vec<u8> {
    fn visit(message: &'static str, done: &mut Vec<&'static str>) {
        for needed in needs(message) {
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

/// Writes a `FileDescriptorProto` with one message.
fn write_file(file: &mut Wire, name: &str) {
    let (package, short) = name.rsplit_once('.').unwrap_or(("", name));
    file.text(1, &file_name(name));
    file.text(2, package);
    for needed in needs(name) {
        file.text(3, &file_name(needed));
    }
    file.message(4, |m| {
        m.text(1, short);
        for field in fields(name) {
            m.message(2, |f| write_field(f, &field));
        }
        if name == "foxglove.PackedElementField" {
            m.message(4, |e| write_enum(e, "NumericType", &NUMERIC_TYPES));
        }
        if name == "foxglove.SceneEntityDeletion" {
            m.message(4, |e| write_enum(e, "Type", &DELETIONS));
        }
    });
    if name == "foxglove.Log" {
        file.message(5, |e| write_enum(e, "LogLevel", &LOG_LEVELS));
    }
    file.text(12, "proto3");
}

/// Writes a `FieldDescriptorProto`.
fn write_field(out: &mut Wire, field: &Field) {
    const OPTIONAL: u64 = 1;
    const REPEATED: u64 = 3;
    out.text(1, field.name);
    out.varint(3, field.number);
    out.varint(4, if field.repeated { REPEATED } else { OPTIONAL });
    out.varint(5, field.kind);
    if let Some(of) = field.of {
        out.text(6, &format!(".{of}"));
    }
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
