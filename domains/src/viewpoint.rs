//! Viewpoints: poses and stations to look from.

use descry_robots::Place;

/// Somewhere to stand and look from.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its PDDL symbol.
    pub symbol: String,
    /// Its pose or station.
    pub place: Place,
}
