//! First line of a journal.

use serde::{Deserialize, Serialize};

/// First line of a journal, which identifies the experiment.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// The experiment's name.
    pub experiment: String,
    /// Hash of the experiment file and of every file that it names.
    pub hash: String,
    /// Version of descry.
    pub version: String,
    /// Number of jobs in all shards.
    pub jobs: usize,
}
