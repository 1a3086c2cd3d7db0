//! Possibilities that a look can settle.

use descry_perception::nalgebra::{Point3, Vector3};

/// A possibility that a look can settle.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Probability of the hypothesis.
    pub weight: f64,
    /// The surface on which it stands.
    pub on: usize,
    /// Its position.
    pub centre: Point3<f64>,
    /// Points that must be seen to settle it.
    pub points: Vec<Point3<f64>>,
    /// The side from which it must be seen, as a unit vector away from it; none if any will do.
    pub facing: Option<Vector3<f64>>,
    /// The reason it is possible.
    pub ground: Basis,
}

/// The reason a hypothesis is possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// Nothing is known of the place.
    NotSeen,
    /// Something was measured there that no object explains.
    Measured,
    /// An object that was seen and may be the requested one.
    Object,
}
