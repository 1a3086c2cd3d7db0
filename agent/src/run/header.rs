//! Settings of a run, kept in its folder and its record.

use serde::{Deserialize, Serialize};

use crate::keeping::Keeping;

/// Settings with which a run can be started again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Body, as on the command line.
    pub robot: String,
    /// Scene, if one was named.
    pub scene: Option<String>,
    /// Seed of all random choices.
    pub seed: u64,
    /// Domain, as on the command line.
    pub domain: String,
    /// Name of the policy that chooses viewpoints.
    pub policy: String,
    /// Storage options of the record.
    #[serde(default)]
    pub keeping: Keeping,
    /// Store of the belief that persists between runs; `None`: nothing is remembered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remember: Option<String>,
}

/// Content of `run.json` in a run's folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Version of descry that started the run.
    pub version: String,
    /// Goal in words.
    pub goal: String,
    /// Goal in PDDL.
    pub pddl_goal: String,
    /// Start time, seconds since 1970.
    pub started_unix_s: u64,
    /// Interruptions after which the run was resumed, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resumed: Vec<Resumed>,
    /// Settings with which the run was started.
    #[serde(flatten)]
    pub settings: Settings,
}

/// Note that a run was interrupted and resumed. It is not part of the record, which equals that of
/// an uninterrupted run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resumed {
    /// Time of resumption, seconds since 1970.
    pub unix_s: u64,
    /// Record number of the last event before the interruption; `None` if there was none.
    pub after: Option<u64>,
}
