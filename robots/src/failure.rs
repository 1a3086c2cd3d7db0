//! Failures of a body. What the agent believes afterwards depends on the kind.

use crate::body::Stamp;
use serde::{Deserialize, Serialize};

/// Failure of a request. `because` is one plain sentence for people and logs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum Failure {
    /// No route on the map: a retry is useless until the map changes.
    #[error("unreachable: {because}")]
    Unreachable {
        /// Obstacle, or missing destination.
        because: String,
    },
    /// An unmapped obstacle blocked the route; another route or a later try may work.
    #[error("blocked: {because}")]
    Blocked {
        /// Place and obstacle, as far as the body knows.
        because: String,
        /// Name of the door or mapped object in the way, if the body knows it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        by: Option<String>,
    },
    /// The time limit passed. The body stands still where it is.
    #[error("timed out: {because}")]
    TimedOut {
        /// Request and elapsed time.
        because: String,
    },
    /// The request was cancelled.
    #[error("cancelled: {because}")]
    Cancelled {
        /// Stopped request.
        because: String,
    },
    /// A frame or sweep failed to arrive.
    #[error("no frame: {because}")]
    SensorDropped {
        /// Missing frame or sweep.
        because: String,
        /// Time at which the frame or sweep was due, nanoseconds on the body's clock.
        stamp_ns: Stamp,
    },
    /// The body does not know where it is.
    #[error("lost: {because}")]
    Lost {
        /// Evidence that localisation is lost.
        because: String,
    },
    /// The hand failed; the scene may have changed nevertheless.
    #[error("slipped: {because}")]
    Slipped {
        /// Description of the event, as felt by the body.
        because: String,
        /// Distance that the hand moved in contact with the object, metres.
        moved_m: f64,
    },
    /// The body cannot do this: a part is missing (see [`Description`](crate::Description)), or the hand is
    /// full or empty.
    #[error("not able to: {because}")]
    Unable {
        /// Missing part or ability, or the state of the hand.
        because: String,
    },
    /// The body has failed permanently; no further request is possible.
    #[error("broken: {because}")]
    Broken {
        /// Cause of the failure.
        because: String,
    },
}

impl Failure {
    /// Reason for the failure, one plain sentence.
    pub fn because(&self) -> &str {
        match self {
            Failure::Unreachable { because }
            | Failure::Blocked { because, .. }
            | Failure::TimedOut { because }
            | Failure::Cancelled { because }
            | Failure::SensorDropped { because, .. }
            | Failure::Lost { because }
            | Failure::Slipped { because, .. }
            | Failure::Unable { because }
            | Failure::Broken { because } => because,
        }
    }

    /// Kind of the failure in one word, for records and counts: `unreachable`, `blocked`, `timed_out`, …
    pub fn kind(&self) -> &'static str {
        match self {
            Failure::Unreachable { .. } => "unreachable",
            Failure::Blocked { .. } => "blocked",
            Failure::TimedOut { .. } => "timed_out",
            Failure::Cancelled { .. } => "cancelled",
            Failure::SensorDropped { .. } => "sensor_dropped",
            Failure::Lost { .. } => "lost",
            Failure::Slipped { .. } => "slipped",
            Failure::Unable { .. } => "unable",
            Failure::Broken { .. } => "broken",
        }
    }

    /// True for failures that may pass by themselves, so that a retry may succeed.
    pub fn is_passing(&self) -> bool {
        matches!(
            self,
            Failure::Blocked { .. }
                | Failure::TimedOut { .. }
                | Failure::SensorDropped { .. }
                | Failure::Lost { .. }
                | Failure::Slipped { .. }
        )
    }
}
