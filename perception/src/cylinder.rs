//! The cylinder that most points lie on.

mod search;

use nalgebra::{Point3, Unit, Vector3};
use std::ops::RangeInclusive;

pub use search::find;

/// An endless cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// A point of the axis: the one beside the middle of the inliers.
    pub at: Point3<f64>,
    /// Direction of the axis.
    pub axis: Unit<Vector3<f64>>,
    /// Radius, metres.
    pub radius_m: f64,
}

impl Cylinder {
    /// Distance from the axis, metres.
    pub fn from_axis_m(&self, p: &Point3<f64>) -> f64 {
        self.radial(p).norm()
    }

    /// The part of a point's place across the axis, metres.
    pub fn radial(&self, p: &Point3<f64>) -> Vector3<f64> {
        let d = p - self.at;
        d - self.axis.into_inner() * d.dot(&self.axis)
    }
}

/// What cylinder to look for, and how hard.
#[derive(Clone, Debug)]
pub struct CylinderOptions {
    /// Points no farther from the surface belong to it, metres …
    pub tolerance_m: f64,
    /// … if besides their normals lie within this angle of the radius through them, radians.
    pub normal_rad: f64,
    /// Radii looked for, metres.
    pub radius_m: RangeInclusive<f64>,
    /// Only axes within this angle (radians) of a direction, either way. An angle of 0 fixes the axis.
    pub axis: Option<(Unit<Vector3<f64>>, f64)>,
    /// Rounds of random sampling.
    pub rounds: usize,
    /// Fixes the sampling.
    pub seed: u64,
}

impl Default for CylinderOptions {
    fn default() -> Self {
        CylinderOptions {
            tolerance_m: 0.005,
            normal_rad: 0.5,
            radius_m: 0.01..=0.2,
            axis: None,
            rounds: 500,
            seed: 0,
        }
    }
}

/// A cylinder, and how well it is borne out.
#[derive(Clone, Debug, PartialEq)]
pub struct CylinderFit {
    /// The cylinder.
    pub cylinder: Cylinder,
    /// Indices of its points, ascending.
    pub inliers: Vec<u32>,
    /// Points with a finite position and normal that were looked at.
    pub of: usize,
    /// Root mean square distance of the inliers from the surface, metres.
    pub rms_m: f64,
    /// Where along the axis, from `at`, the inliers begin and end, metres.
    pub extent_m: (f64, f64),
    /// How much of the circle the inliers cover, in sixths of a right angle (24 parts), radians.
    pub arc_rad: f64,
    /// Sampling rounds that gave a cylinder that was asked for.
    pub rounds_used: usize,
}

/// Why there is no cylinder.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CylinderError {
    /// Normals and points differ in number.
    #[error("{normals} normals for {points} points: give one a point")]
    Normals {
        /// Points given.
        points: usize,
        /// Normals given.
        normals: usize,
    },
    /// Fewer than five usable points.
    #[error("{found} points with a normal: a cylinder needs five")]
    TooFew {
        /// How many there are.
        found: usize,
    },
    /// Not one sample gave a cylinder that was asked for.
    #[error("none of {rounds} samples gave a cylinder of the asked radius and axis")]
    None {
        /// Samples taken.
        rounds: usize,
    },
    /// The tolerance is no positive length.
    #[error("a tolerance of {tolerance_m} m: give a positive length, such as 0.005")]
    Tolerance {
        /// What was asked for.
        tolerance_m: f64,
    },
}
