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
    /// Everything that is sensed and believed.
    pub record: &'a Record,
    /// Recogniser of segments.
    pub recogniser: &'a dyn Recogniser,
    /// The known objects.
    pub objects: &'a [ObjectModel],
    /// The body, which is only asked.
    pub robot: &'a dyn Robot,
    /// Thresholds of confidence.
    pub thresholds: Thresholds,
    /// Recognisers of learned objects.
    pub again: &'a [KnowsAgain],
}

/// Adds learned objects to the percepts on a surface, from the surface's views and their merged
/// cloud.
pub type KnowsAgain = fn(&mut Mind, usize, (&[View], &Merged), Vec<Percept>) -> Vec<Percept>;

/// Records a document.
pub(crate) fn put(
    record: &Record,
    kind: &str,
    stamp_ns: i64,
    body: &impl Serialize,
) -> Result<RecordId, WorldError> {
    Ok(record.put(draft(kind, stamp_ns, body)?)?)
}

/// A document to be recorded.
pub(crate) fn draft(kind: &str, stamp_ns: i64, body: &impl Serialize) -> Result<Draft<'static>, WorldError> {
    let body = serde_json::to_value(body).map_err(|e| WorldError::Bug(e.to_string()))?;
    let meta = Meta { body, ..Meta::default() };
    Ok(Draft { meta, ..Draft::new(kind, stamp_ns) })
}
