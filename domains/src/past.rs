//! Persistent belief of earlier runs.

use std::sync::Arc;

use descry_memory::remember::Remembered;
use serde::{Deserialize, Serialize};

/// Persistent belief from earlier runs, and the time at which this run began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Past {
    /// Belief that earlier runs left.
    pub remembered: Arc<Remembered>,
    /// Unix time at which this run began, seconds.
    pub now_unix_s: f64,
}
