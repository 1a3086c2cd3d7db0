//! Perception context.

use descry_memory::{Draft, Meta, Record, RecordId};
use descry_perception::View;
use descry_perception::merge::Merged;
use descry_perception::recognise::{ObjectModel, Percept, Recogniser};
use descry_robots::Robot;
use serde::Serialize;

use crate::config::Thresholds;
use crate::error::WorldError;
use crate::mind::Mind;

/// Perception context: all that perceiving needs besides the world model.
#[derive(Clone, Copy)]
pub struct Eyes<'a> {
    /// Record of everything that is sensed and believed.
    pub record: &'a Record,
    /// Recogniser of segments.
    pub recogniser: &'a dyn Recogniser,
    /// Models of the known objects.
    pub objects: &'a [ObjectModel],
    /// Body, which perception asks for its description, time and poses but does not move.
    pub robot: &'a dyn Robot,
    /// Thresholds of confidence.
    pub thresholds: Thresholds,
    /// Functions that recognise learned objects.
    pub again: &'a [KnowsAgain],
}

/// Function that adds learned objects to the percepts on a surface (index), from the surface's views and
/// their merged cloud.
pub type KnowsAgain = fn(&mut Mind, usize, (&[View], &Merged), Vec<Percept>) -> Vec<Percept>;

/// Records a document; returns its id.
pub(crate) fn put(
    record: &Record,
    kind: &str,
    stamp_ns: i64,
    body: &impl Serialize,
) -> Result<RecordId, WorldError> {
    Ok(record.put(draft(kind, stamp_ns, body)?)?)
}

/// Document to be recorded.
pub(crate) fn draft(kind: &str, stamp_ns: i64, body: &impl Serialize) -> Result<Draft<'static>, WorldError> {
    let body = serde_json::to_value(body).map_err(|e| WorldError::Bug(e.to_string()))?;
    let meta = Meta { body, ..Meta::default() };
    Ok(Draft { meta, ..Draft::new(kind, stamp_ns) })
}
