//! Answers and description of a body, stored in the record of its run.

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
/// Name of the blob with the map.
const MAP: &str = "map";

/// Storage for a body's answers, from which the pixels of earlier frames are read again.
pub struct RecordTape {
    /// Record to which new answers are written.
    pub into: Arc<Record>,
    /// Record from which earlier frames are read.
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

/// Points of a recorded cloud as camera pixels, with the colour image of the same time if there is
/// one.
///
/// # Errors
/// Message, if the cloud cannot be read.
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

/// Colour image in a document; `None` if it holds none.
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
/// [`CommandError::Broken`] if the record cannot be written.
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

/// Description of the body in a record; `None` if there is none.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
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

/// Recorded answers in order, up to the first frame whose pixels are not in the record.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
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
