//! Dominant plane of a cloud.

mod search;

use nalgebra::{Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

pub use search::{find, refit};

/// All points `p` with `normal · p = offset_m`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// Distance from the origin along the normal, metres.
    pub offset_m: f64,
}

impl Plane {
    /// Plane through `at` with a unit `normal`.
    pub fn through(at: &Point3<f64>, normal: Vector3<f64>) -> Plane {
        Plane { normal, offset_m: normal.dot(&at.coords) }
    }

    /// Signed distance, metres; positive on the normal's side.
    pub fn height_m(&self, p: &Point3<f64>) -> f64 {
        self.normal.dot(&p.coords) - self.offset_m
    }

    /// Plane with its normal flipped.
    pub fn flipped(&self) -> Plane {
        Plane { normal: -self.normal, offset_m: -self.offset_m }
    }

    /// Plane with its normal towards `p`.
    pub fn facing(&self, p: &Point3<f64>) -> Plane {
        if self.height_m(p) < 0.0 { self.flipped() } else { *self }
    }
}

/// Plane to look for, and the effort of the search.
#[derive(Clone, Debug)]
pub struct PlaneOptions {
    /// Maximum distance of an inlier from the plane, metres.
    pub tolerance_m: f32,
    /// Rounds of random sampling.
    pub rounds: usize,
    /// Fixes the sampling.
    pub seed: u64,
    /// Direction and maximum angle (radians) of the normal; the result's normal points along the
    /// direction.
    pub tilt: Option<(Unit<Vector3<f64>>, f64)>,
    /// With `tilt`: range of the plane's offset along its normal, metres, such as the height of a
    /// table for an up direction and a frame on the floor.
    pub offset_m: Option<RangeInclusive<f64>>,
}

impl Default for PlaneOptions {
    fn default() -> Self {
        PlaneOptions { tolerance_m: 0.01, rounds: 1000, seed: 0, tilt: None, offset_m: None }
    }
}

/// Plane with its support.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneFit {
    /// Plane with its normal along the requested direction, or else towards the origin (the
    /// sensor).
    pub plane: Plane,
    /// Indices of the points within the tolerance, ascending.
    pub inliers: Vec<u32>,
    /// Finite points that were looked at.
    pub of: usize,
    /// Root mean square distance of the inliers, metres.
    pub rms_m: f64,
    /// Number of sampling iterations that gave a plane as requested.
    pub rounds_used: usize,
}

/// Reason why no plane was found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlaneError {
    /// Fewer than three points are finite.
    #[error("{found} finite points: a plane needs three")]
    TooFew {
        /// Number that was found.
        found: usize,
    },
    /// No sample gave a plane as requested.
    #[error(
        "none of {rounds} samples gave a plane of the asked tilt and height: do the points lie on one line? widen the band, or sample more"
    )]
    None {
        /// Number of samples taken.
        rounds: usize,
    },
    /// Tolerance that is not positive.
    #[error("a tolerance of {tolerance_m} m: give a positive length, such as 0.01")]
    Tolerance {
        /// Value that was given.
        tolerance_m: f32,
    },
}
