//! Contradictions between views and the map.

use descry_perception::consistency::Fault;
use serde::{Deserialize, Serialize};

/// Reason why the views of a surface prove nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Contradiction {
    /// Fault of the camera or of the poses.
    Fault(Fault),
    /// As many views are inconsistent with their stated poses as are consistent.
    Apart,
}

impl Contradiction {
    /// Sentence on the contradiction, with the surface by name.
    pub fn told(&self, surface: &str) -> String {
        match self {
            Contradiction::Fault(fault) => {
                format!("what the looks show of the {surface} contradicts the map: {fault}")
            }
            Contradiction::Apart => format!("too few views of the {surface} can be laid on each other"),
        }
    }
}
