//! Viewpoints: poses and stations to look from.

use descry_robots::Place;

/// Somewhere to stand and look from.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// PDDL symbol.
    pub symbol: String,
    /// Pose or station.
    pub place: Place,
}
