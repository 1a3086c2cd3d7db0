//! Policies: choices among views.

use descry_robots::Place;

use crate::situation::Situation;

/// Possible look: a view of a surface from a candidate pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Index of the candidate pose.
    pub from: usize,
    /// Index of the surface.
    pub on: usize,
    /// Driving time to the candidate, seconds.
    pub travel_s: f64,
    /// Expected share of the doubt that the view settles, 0 to 1.
    pub gain: f64,
}

/// Policy that chooses the next view.
pub trait Policy: Send {
    /// Next view among `looks` (not empty); `None` to give up. Offered are feasible views not yet
    /// taken that show the surface; those without expected gain only if [`Policy::looks_at_all`].
    fn choose(&mut self, situation: &Situation, looks: &[Look]) -> Option<Look>;

    /// True if the policy also takes views without expected gain.
    fn looks_at_all(&self) -> bool {
        false
    }
}

/// True visibility of the requested object in a view of a named surface from a place, 0 to 1; known in
/// simulated experiments only.
pub type Foresight = Box<dyn Fn(&Place, &str) -> f64 + Send>;

/// View with the greatest value; among equals the one with the shortest drive, then the lowest indices.
/// `None` without views.
pub fn best(looks: &[Look], value: impl Fn(&Look) -> f64) -> Option<Look> {
    let valued = looks.iter().map(|look| (value(look), look));
    let better = |a: &(f64, &Look), b: &(f64, &Look)| {
        a.0.total_cmp(&b.0)
            .then(b.1.travel_s.total_cmp(&a.1.travel_s))
            .then(b.1.from.cmp(&a.1.from))
            .then(b.1.on.cmp(&a.1.on))
    };
    valued.max_by(better).map(|(_, look)| *look)
}
