//! Possibilities that a look can settle.

use descry_perception::nalgebra::{Point3, Vector3};

/// A possibility that a look can settle.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Probability of the hypothesis.
    pub weight: f64,
    /// Surface of the hypothesis.
    pub on: usize,
    /// Position of the hypothesised object.
    pub centre: Point3<f64>,
    /// Points that must be seen to settle the hypothesis.
    pub points: Vec<Point3<f64>>,
    /// Side that must be seen, as an outward unit vector; `None`: any side.
    pub facing: Option<Vector3<f64>>,
    /// Reason for the hypothesis.
    pub ground: Basis,
}

/// Reason a hypothesis is possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// Unobserved place.
    NotSeen,
    /// Measurement that no object explains.
    Measured,
    /// Seen object that may be the requested one.
    Object,
}
