//! Policies: choices among looks.

use descry_robots::Place;

use crate::situation::Situation;

/// A look that could be taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// The candidate to look from.
    pub from: usize,
    /// The surface to look at.
    pub on: usize,
    /// Seconds of driving until then.
    pub travel_s: f64,
    /// The share of what is in doubt that it is expected to settle, 0 to 1.
    pub gain: f64,
}

/// A way to choose where to look next.
pub trait Policy: Send {
    /// The next of the looks (there is at least one), or none to give up. Looks that have been taken, that cannot be reached
    /// or that do not show the surface are not offered; of the others those that promise nothing only if
    /// [`Policy::looks_at_all`].
    fn choose(&mut self, situation: &Situation, looks: &[Look]) -> Option<Look>;

    /// True if it also takes looks with no expected gain.
    fn looks_at_all(&self) -> bool {
        false
    }
}

/// True visibility of the requested object in a look from a place at a named surface, 0 to 1; in experiments
/// in simulation only.
pub type Foresight = Box<dyn Fn(&Place, &str) -> f64 + Send>;

/// The look of the greatest value; among equals the nearest, then the first.
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
