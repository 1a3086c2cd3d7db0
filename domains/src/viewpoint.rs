//! Viewpoints: poses and stations to look from.

use descry_robots::Place;

/// Place from which the body can look.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// PDDL symbol.
    pub symbol: String,
    /// Pose or station.
    pub place: Place,
}
