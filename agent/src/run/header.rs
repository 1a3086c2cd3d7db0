//! Settings of a run, in its folder and its record.

use serde::{Deserialize, Serialize};

use crate::keeping::Keeping;

/// Settings of a run, sufficient to start it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The body, as on the command line.
    pub robot: String,
    /// The scene, if one was named.
    pub scene: Option<String>,
    /// The seed.
    pub seed: u64,
    /// The domain, as on the command line.
    pub domain: String,
    /// Name of the policy that chooses where to look next.
    pub policy: String,
    /// Storage options of the record.
    #[serde(default)]
    pub keeping: Keeping,
    /// Store of the persistent belief; `None`: nothing is remembered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remember: Option<String>,
}

/// `run.json` in a run's folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Version of descry.
    pub version: String,
    /// Goal in words.
    pub goal: String,
    /// Goal in PDDL.
    pub pddl_goal: String,
    /// Start time, seconds since 1970.
    pub started_unix_s: u64,
    /// The interruptions after which the run was resumed, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resumed: Vec<Resumed>,
    /// Settings that it was started with.
    #[serde(flatten)]
    pub settings: Settings,
}

/// Note that a run was interrupted and resumed. It is kept outside the record, which equals that of
/// an uninterrupted run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resumed {
    /// When, seconds since 1970.
    pub unix_s: u64,
    /// Number of the last event before the interruption; `None` without events.
    pub after: Option<u64>,
}
