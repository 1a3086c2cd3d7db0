//! Tape of a body, stored in the record of its run.

use std::sync::Arc;

use descry_memory::{Blob, Draft, Error, Form, Query, Record, kind, viewer};
use descry_robots::image::RgbImage;
use descry_robots::recorded::{Entry, Known, Tape};
use descry_robots::{Answer, Pixels};
use descry_robots::{Colour, OccupancyGrid, Stamp};
use serde_json::Value;

use crate::exit::CommandError;

/// Record kind of a body's answers.
pub const ANSWER: &str = "answer";
/// Record kind of a body's description.
pub const BODY: &str = "body";
/// The blob that holds the map of the room.
const MAP: &str = "map";

/// Tape that records a body's answers and returns the frames of recorded ones.
pub struct RecordTape {
    /// Record that new answers go to.
    pub into: Arc<Record>,
    /// Record that holds the frames of earlier answers.
    pub from: Arc<Record>,
}

impl Tape for RecordTape {
    fn keep(&self, entry: &Entry) -> Result<(), String> {
        let body = serde_json::to_value(entry).map_err(|e| e.to_string())?;
        let mut draft = Draft { kept: true, ..Draft::new(ANSWER, entry.now_ns) };
        draft.meta.body = body;
        // A frame counts as taken once its pixels are in the record: they come next, and the answer is kept with them.
        let kept = match entry.done {
            Some((_, Answer::Sensed(_))) => self.into.put_soon(draft),
            _ => self.into.put(draft).map(|_| ()),
        };
        kept.map_err(|e| e.to_string())
    }

    fn pixels(&self, stamp_ns: Stamp) -> Result<Pixels, String> {
        let document = self.from.nearest(kind::CLOUD, stamp_ns, 0).map_err(|e| match e {
            Error::NotNear { .. } => format!(
                "the cloud of {:.3} s is no longer in the record: it was pruned, since nothing rested on it",
                stamp_ns as f64 * 1e-9
            ),
            other => other.to_string(),
        })?;
        pixels(&self.from, &document)
    }
}

/// Pixels of a recorded cloud's camera, with the colours of the same time.
///
/// # Errors
/// Why it cannot be read.
pub fn pixels(record: &Record, cloud: &descry_memory::Document) -> Result<Pixels, String> {
    let (points, _) = record.cloud(cloud).map_err(|e| e.to_string())?;
    let at = Query {
        robot: (!cloud.robot.is_empty()).then(|| cloud.robot.clone()),
        frame: Some(cloud.frame.clone()),
        from_ns: Some(cloud.stamp_ns),
        to_ns: Some(cloud.stamp_ns),
        ..Query::of_kind(kind::IMAGE)
    };
    let image = record.find(&at).map_err(|e| e.to_string())?.pop();
    let colour = image.map(|image| colour(record, &image)).transpose()?.flatten();
    Ok(Pixels { cloud: points, colour })
}

/// Colour image recorded with a view; `None` for other images.
fn colour(record: &Record, document: &descry_memory::Document) -> Result<Option<Colour>, String> {
    let Some(info) = document.blobs.iter().find(|b| b.form == Form::RawImage) else { return Ok(None) };
    let number = |key: &str| info.layout.get(key).and_then(Value::as_u64).and_then(|n| u32::try_from(n).ok());
    let (Some(width), Some(height)) = (number("width"), number("height")) else { return Ok(None) };
    let data = record.store().blob(document.id, &info.name).map_err(|e| e.to_string())?;
    let registered = document.body.get("registered").and_then(Value::as_bool).unwrap_or(false);
    Ok(RgbImage::from_raw(width, height, data).map(|image| Colour { image, registered }))
}

/// Records the description of a body.
///
/// # Errors
/// [`CommandError::Broken`] if it cannot be kept.
pub fn put_known(record: &Record, known: &Known) -> Result<(), CommandError> {
    let text = |e: serde_json::Error| CommandError::Bug(e.to_string());
    let map = known.map.as_ref().map(serde_json::to_vec).transpose().map_err(text)?;
    let body = serde_json::to_value(Known { map: None, ..known.clone() }).map_err(text)?;
    let blob =
        |data: Vec<u8>| Blob { name: MAP.into(), form: Form::Bytes, layout: Value::Null, data: data.into() };
    let shown = known.map.as_ref().map(|map| {
        let cells: Vec<u8> = map.occupied.iter().map(|&occupied| u8::from(occupied)).collect();
        let origin_m = [map.origin_m.x, map.origin_m.y];
        let frame = &known.description.frames.map;
        viewer::grid(known.now_ns.max(0), frame, origin_m, map.resolution_m, map.width, &cells)
    });
    let blobs = map.map(blob).into_iter().chain(shown).collect();
    let mut draft = Draft { blobs, kept: true, ..Draft::new(BODY, known.now_ns.max(0)) };
    draft.meta.body = body;
    record.put(draft).map(|_| ()).map_err(CommandError::broken)
}

/// Recorded description of a body, if any.
///
/// # Errors
/// [`CommandError::Broken`] if it cannot be read.
pub fn known(record: &Record) -> Result<Option<Known>, CommandError> {
    let document =
        record.find(&Query { limit: Some(1), ..record.own(BODY) }).map_err(CommandError::broken)?.pop();
    let Some(document) = document else { return Ok(None) };
    let damaged = |e: serde_json::Error| CommandError::broken(format!("record {}: {e}", document.id));
    let mut known: Known = serde_json::from_value(document.body.clone()).map_err(damaged)?;
    if document.blobs.iter().any(|b| b.name == MAP) {
        let bytes = record.store().blob(document.id, MAP).map_err(CommandError::broken)?;
        known.map = Some(serde_json::from_slice::<OccupancyGrid>(&bytes).map_err(damaged)?);
    }
    Ok(Some(known))
}

/// Recorded answers in order, without a last frame whose pixels did not reach the disk.
///
/// # Errors
/// [`CommandError::Broken`] if they cannot be read.
pub fn entries(record: &Record) -> Result<Vec<Entry>, CommandError> {
    let last_ns = record.newest(kind::CLOUD).map_err(CommandError::broken)?.map(|d| d.stamp_ns);
    let mut entries = Vec::new();
    for document in record.find(&record.own(ANSWER)).map_err(CommandError::broken)? {
        let entry: Entry = serde_json::from_value(document.body)
            .map_err(|e| CommandError::broken(format!("record {}: no answer of a body: {e}", document.id)))?;
        if let Some((_, Answer::Sensed(exposure))) = &entry.done
            && last_ns.is_none_or(|last_ns| exposure.stamp_ns > last_ns)
        {
            break;
        }
        entries.push(entry);
    }
    Ok(entries)
}
