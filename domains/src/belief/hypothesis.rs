//! Hypotheses about objects that a view can settle.

use descry_perception::nalgebra::{Point3, Vector3};

/// Possibility that a view can confirm or rule out: an object at a hidden place, or another identity or
/// position of a seen one.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Probability that depends on the hypothesis.
    pub weight: f64,
    /// Index of the surface.
    pub on: usize,
    /// Centre of the object, or of the edge that would locate it; map frame.
    pub centre: Point3<f64>,
    /// Points of which a view must show most to settle the hypothesis, map frame.
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
    /// Seen object that may be the requested one, or edge that would locate a seen object.
    Object,
}
