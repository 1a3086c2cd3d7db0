//! Persistent belief of earlier runs.

use std::sync::Arc;

use descry_memory::remember::Remembered;
use serde::{Deserialize, Serialize};

/// Persistent belief from earlier runs, and the time at which this run began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Past {
    /// Last sightings of objects.
    pub remembered: Arc<Remembered>,
    /// Seconds since 1970.
    pub now_unix_s: f64,
}
