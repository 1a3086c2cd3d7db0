//! Planes, and the dominant plane of a cloud.

mod search;

use nalgebra::{Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

pub use search::{find, refit};

/// Plane: all points `p` with `normal · p = offset_m`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// Signed distance of the plane from the origin along the normal, metres.
    pub offset_m: f64,
}

impl Plane {
    /// Creates the plane through `at` with a unit `normal`.
    pub fn through(at: &Point3<f64>, normal: Vector3<f64>) -> Plane {
        Plane { normal, offset_m: normal.dot(&at.coords) }
    }

    /// Signed distance of a point from the plane, metres; positive on the normal's side.
    pub fn height_m(&self, p: &Point3<f64>) -> f64 {
        self.normal.dot(&p.coords) - self.offset_m
    }

    /// Plane with its normal flipped.
    pub fn flipped(&self) -> Plane {
        Plane { normal: -self.normal, offset_m: -self.offset_m }
    }

    /// Same plane with its normal pointing to the side of `p`.
    pub fn facing(&self, p: &Point3<f64>) -> Plane {
        if self.height_m(p) < 0.0 { self.flipped() } else { *self }
    }
}

/// Requirements on the plane to find, and effort of the search.
#[derive(Clone, Debug)]
pub struct PlaneOptions {
    /// Maximum distance of an inlier from the plane, metres.
    pub tolerance_m: f32,
    /// Number of random samples.
    pub rounds: usize,
    /// Seed of the random sampling.
    pub seed: u64,
    /// Required direction of the normal and maximum angle from it, radians; the result's normal points along the
    /// direction. `None`: any normal.
    pub tilt: Option<(Unit<Vector3<f64>>, f64)>,
    /// Required offset of the plane along its normal, metres, such as the height of a table for an up direction and a
    /// frame on the floor; used only with `tilt`. `None`: any offset.
    pub offset_m: Option<RangeInclusive<f64>>,
}

impl Default for PlaneOptions {
    fn default() -> Self {
        PlaneOptions { tolerance_m: 0.01, rounds: 1000, seed: 0, tilt: None, offset_m: None }
    }
}

/// Plane with the points that support it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneFit {
    /// Plane with its normal along the requested direction, or else towards the origin (the
    /// sensor).
    pub plane: Plane,
    /// Indices of the points within the tolerance, ascending.
    pub inliers: Vec<u32>,
    /// Number of finite points among those given.
    pub of: usize,
    /// Root mean square distance of the inliers, metres.
    pub rms_m: f64,
    /// Number of samples that gave a plane as required.
    pub rounds_used: usize,
}

/// Reason why no plane was found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlaneError {
    /// There are fewer than three finite points.
    #[error("{found} finite points: a plane needs three")]
    TooFew {
        /// Number of finite points.
        found: usize,
    },
    /// No sample gave a plane as required.
    #[error(
        "none of {rounds} samples gave a plane of the asked tilt and height: do the points lie on one line? widen the band, or sample more"
    )]
    None {
        /// Number of samples taken.
        rounds: usize,
    },
    /// The tolerance is not positive.
    #[error("a tolerance of {tolerance_m} m: give a positive length, such as 0.01")]
    Tolerance {
        /// Given tolerance, metres.
        tolerance_m: f32,
    },
}
