//! Documents: the JSON part of a record, which also describes the blobs (byte arrays) stored with it.

use crate::error::Error;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::borrow::Cow;

/// Number of a record, unique in its store; never reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct RecordId(pub u64);

impl std::fmt::Display for RecordId {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// An axis-aligned box, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Minimum corner, metres.
    pub min_m: [f64; 3],
    /// Maximum corner, metres.
    pub max_m: [f64; 3],
}

impl Bounds {
    /// Distance from a point to the box, metres; 0 inside.
    pub fn distance_m(&self, p: [f64; 3]) -> f64 {
        (0..3).map(|i| (self.min_m[i] - p[i]).max(p[i] - self.max_m[i]).max(0.0).powi(2)).sum::<f64>().sqrt()
    }
}

/// An object mentioned by a record, with the confidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sighting {
    /// The object's name.
    pub object: String,
    /// Confidence in the sighting: a probability or a score, 0 to 1.
    pub confidence: f64,
}

/// Content of a record, with the metadata by which queries find the record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Meta {
    /// Position of the sensor, world frame, metres.
    pub seen_from_m: Option<[f64; 3]>,
    /// Extent of the world that the record shows or mentions, metres.
    pub covers_m: Option<Bounds>,
    /// Objects that the record mentions.
    pub objects: Vec<Sighting>,
    /// Further content, as JSON.
    pub body: Value,
}

/// Form of a blob's content, which determines its schema for viewers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// Points, in the byte layout that [`BlobInfo::layout`] describes (`foxglove.PointCloud`).
    PointCloud,
    /// A sweep of a laser in a plane (`foxglove.LaserScan`).
    LaserScan,
    /// A PNG or JPEG (`foxglove.CompressedImage`).
    CompressedImage,
    /// Plain pixels (`foxglove.RawImage`).
    RawImage,
    /// Transforms from one child frame to its parent (`foxglove.FrameTransforms`).
    FrameTransforms,
    /// One line of the log (`foxglove.Log`).
    Log,
    /// Boxes with labels (`foxglove.SceneUpdate`).
    SceneUpdate,
    /// Cells of a map (`foxglove.Grid`).
    Grid,
    /// Projection of a camera (`foxglove.CameraCalibration`).
    CameraCalibration,
    /// Bytes in a format that no viewer knows (`descry.Blob`).
    Bytes,
}

/// Description of a blob, without its bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BlobInfo {
    /// Name of the blob, unique within the record.
    pub name: String,
    /// Form of the content.
    pub form: Form,
    /// Length, bytes.
    pub bytes: u64,
    /// Layout of the content: fields and stride of a cloud, size and encoding of an image.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub layout: Value,
}

/// A record as stored, without the bytes of its blobs.
///
/// Fields that a newer format adds are ignored by older readers, fields that an older format lacked take their default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// Number of the record.
    pub id: RecordId,
    /// Kind: `cloud`, `scan`, `image`, `transforms`, `log`, or any word.
    pub kind: String,
    /// Time stamp, nanoseconds in the clock of the recording.
    pub stamp_ns: i64,
    /// End of the time span, for records of a span, nanoseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub end_ns: Option<i64>,
    /// Coordinate frame of the content; the child frame for transforms.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub frame: String,
    /// Name of the recording robot, in a store shared by several.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub robot: String,
    /// Position of the sensor, world frame, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen_from_m: Option<[f64; 3]>,
    /// Extent of the world that the record shows or mentions, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covers_m: Option<Bounds>,
    /// Objects that the record mentions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<Sighting>,
    /// True if the record is never pruned, because the recording cannot be understood without it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub kept: bool,
    /// Content, as JSON.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub body: Value,
    /// Descriptions of the record's blobs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blobs: Vec<BlobInfo>,
}

/// A blob to be recorded.
#[derive(Clone, Debug)]
pub struct Blob<'a> {
    /// Name of the blob, unique within the record.
    pub name: String,
    /// Form of the content.
    pub form: Form,
    /// Layout of the content, as [`BlobInfo::layout`].
    pub layout: Value,
    /// Bytes of the content.
    pub data: Cow<'a, [u8]>,
}

/// A record to be stored.
#[derive(Clone, Debug)]
pub struct Draft<'a> {
    /// Kind: `cloud`, `scan`, `image`, `transforms`, `log`, or any word.
    pub kind: String,
    /// Time stamp, nanoseconds; not negative.
    pub stamp_ns: i64,
    /// End of the time span, for records of a span, nanoseconds.
    pub end_ns: Option<i64>,
    /// Coordinate frame of the content, or "".
    pub frame: String,
    /// True if the record is never pruned.
    pub kept: bool,
    /// Content, and the metadata by which queries find the record.
    pub meta: Meta,
    /// Blobs of the record, whose names differ.
    pub blobs: Vec<Blob<'a>>,
}

impl Draft<'_> {
    /// Creates an empty draft of a kind and a time stamp in nanoseconds.
    pub fn new(kind: &str, stamp_ns: i64) -> Self {
        Draft {
            kind: kind.into(),
            stamp_ns,
            end_ns: None,
            frame: String::new(),
            kept: false,
            meta: Meta::default(),
            blobs: Vec::new(),
        }
    }

    /// End of the time span, or the stamp of a record without a time span, nanoseconds.
    pub(crate) fn until_ns(&self) -> i64 {
        self.end_ns.unwrap_or(self.stamp_ns)
    }

    /// True if the record adds or removes pins, which protect records from pruning. It is written even
    /// without room, since it may free some.
    pub(crate) fn is_of_pins(&self) -> bool {
        [crate::stores::PIN, crate::stores::UNPIN].contains(&self.kind.as_str())
    }

    /// Converts the draft to the document that will be stored.
    ///
    /// # Errors
    /// [`Error::Input`] if a part of the draft could not be found or read again.
    pub(crate) fn document(&self, id: RecordId, robot: &str) -> Result<Document, Error> {
        self.check()?;
        let blobs = self.blobs.iter().map(|b| BlobInfo {
            name: b.name.clone(),
            form: b.form,
            bytes: b.data.len() as u64,
            layout: b.layout.clone(),
        });
        Ok(Document {
            id,
            kind: self.kind.clone(),
            stamp_ns: self.stamp_ns,
            end_ns: self.end_ns,
            frame: self.frame.clone(),
            robot: robot.into(),
            seen_from_m: self.meta.seen_from_m,
            covers_m: self.meta.covers_m,
            objects: self.meta.objects.clone(),
            kept: self.kept,
            body: self.meta.body.clone(),
            blobs: blobs.collect(),
        })
    }

    fn check(&self) -> Result<(), Error> {
        let fail = |what: String, mend: &str| Err(Error::Input { what, mend: mend.into() });
        if self.kind.is_empty() || self.kind.contains(char::is_control) {
            return fail(format!("the kind {:?} is no word", self.kind), "name what is recorded, as `cloud`");
        }
        if self.stamp_ns < 0 {
            return fail(
                format!("the stamp {} ns is negative", self.stamp_ns),
                "count from the start of the recording",
            );
        }
        if self.end_ns.is_some_and(|e| e < self.stamp_ns) {
            return fail(
                format!("it ends at {:?} ns, before its start {}", self.end_ns, self.stamp_ns),
                "swap them",
            );
        }
        let places =
            self.meta.seen_from_m.iter().chain(self.meta.covers_m.iter().flat_map(|b| [&b.min_m, &b.max_m]));
        if places.flatten().any(|v| !v.is_finite()) {
            return fail("a place is not finite".into(), "leave out places that are not known");
        }
        if let Some(s) = self.meta.objects.iter().find(|s| !(0.0..=1.0).contains(&s.confidence)) {
            return fail(
                format!("the confidence {} of {} is not within 0 to 1", s.confidence, s.object),
                "give a probability",
            );
        }
        for (i, blob) in self.blobs.iter().enumerate() {
            if self.blobs[..i].iter().any(|b| b.name == blob.name) {
                return fail(format!("two blobs are called {:?}", blob.name), "give each a name of its own");
            }
        }
        Ok(())
    }
}

/// A ball in the world, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Centre, world frame, metres.
    pub place_m: [f64; 3],
    /// Radius, metres.
    pub radius_m: f64,
}

/// Order of results; records with equal stamps are ordered by number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Oldest first.
    #[default]
    Oldest,
    /// Newest first.
    Newest,
}

/// Conditions of a query; all that are given must hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Query {
    /// Kind of the records; `None` for any.
    pub kind: Option<String>,
    /// Coordinate frame of the records; `None` for any.
    pub frame: Option<String>,
    /// Name of the recording robot; `None` for any, or for the robot of a store that serves one alone.
    pub robot: Option<String>,
    /// Earliest stamp, nanoseconds; a record of a time span matches if the span ends later.
    pub from_ns: Option<i64>,
    /// Latest stamp, nanoseconds.
    pub to_ns: Option<i64>,
    /// Ball that contains the position of the sensor.
    pub seen_from: Option<Near>,
    /// Ball that meets the extent covered by the record.
    pub covers: Option<Near>,
    /// Name of an object that the records mention.
    pub object: Option<String>,
    /// Minimum confidence in `object`, or in any object if none is given.
    pub min_confidence: Option<f64>,
    /// Order of the results.
    pub order: Order,
    /// Maximum number of results.
    pub limit: Option<usize>,
    /// Stamp, nanoseconds, and number of the record after which results begin, in the query's order: for
    /// reading in pages.
    pub after: Option<(i64, RecordId)>,
}

impl Query {
    /// Query for all records of a kind.
    pub fn of_kind(kind: &str) -> Self {
        Query { kind: Some(kind.into()), ..Query::default() }
    }
}
