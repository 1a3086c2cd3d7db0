//! Registration of clouds: three variants of ICP with diagnosable results.

mod align;
mod equations;
mod pairs;

use crate::cloud::CloudError;
use crate::neighbours::Neighbours;
use crate::normals;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3};

pub use align::align;
pub(crate) use equations::Sums;
pub(crate) use equations::rigid;
pub(crate) use pairs::Partner;
pub use pairs::{Pair, pairs};

/// Cloud prepared for registration: finite points, search tree and, if requested, normals.
pub struct Prepared {
    pub(crate) points: Vec<Point3<f32>>,
    pub(crate) normals: Option<Vec<Vector3<f32>>>,
    /// Normal of the point in each slot of the tree; empty if not requested.
    by_slot: Vec<[f64; 3]>,
    pub(crate) tree: Neighbours,
}

impl Prepared {
    /// Makes points ready for [`Method::PointToPoint`]. Points without a return are left out.
    ///
    /// # Errors
    /// If there are more points than 32-bit indices can name.
    pub fn new(points: &[Point3<f32>]) -> Result<Prepared, CloudError> {
        let points: Vec<Point3<f32>> = points.iter().copied().filter(crate::cloud::is_finite).collect();
        let tree = Neighbours::new(&points)?;
        Ok(Prepared { points, normals: None, by_slot: Vec::new(), tree })
    }

    /// Makes points ready for every method, with normals from the `k` nearest points.
    ///
    /// # Errors
    /// As [`Prepared::new`].
    pub fn with_normals(points: &[Point3<f32>], k: usize) -> Result<Prepared, CloudError> {
        let mut prepared = Prepared::new(points)?;
        let normals = normals::estimate(&prepared.tree, k, &Point3::origin()).normals;
        let by_slot = prepared.tree.indices().iter().map(|&i| normals[i as usize].cast::<f64>().into());
        prepared.by_slot = by_slot.collect();
        prepared.normals = Some(normals);
        Ok(prepared)
    }

    /// The finite points, metres.
    pub fn points(&self) -> &[Point3<f32>] {
        &self.points
    }

    /// Normals, if requested; NaN where there is no surface.
    pub fn normals(&self) -> Option<&[Vector3<f32>]> {
        self.normals.as_deref()
    }

    /// Search tree of the points.
    pub fn tree(&self) -> &Neighbours {
        &self.tree
    }
}

/// Quantity that a registration minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Distances between corresponding points (Besl and McKay 1992).
    PointToPoint,
    /// Distances of the source's points from the target's tangent planes (Chen and Medioni 1992).
    PointToPlane,
    /// Distances weighted by the local surface shape at both points (Segal, Haehnel, Thrun 2009).
    Generalised,
}

/// The options of a registration.
#[derive(Clone, Debug, PartialEq)]
pub struct RegisterOptions {
    /// Quantity that is minimised.
    pub method: Method,
    /// Initial pose of the source in the target's frame.
    pub start_target_from_source: Isometry3<f64>,
    /// Maximum correspondence distance, metres.
    pub within_m: f32,
    /// Maximum number of iterations of matching and moving.
    pub rounds: usize,
    /// Shift of the source's centre in one iteration below which the registration has converged, if
    /// the rotation is below `settle_rad` too, metres.
    pub settle_m: f64,
    /// Rotation in one iteration below which the registration has converged, if the shift is below
    /// `settle_m` too, radians.
    pub settle_rad: f64,
    /// Residual length (metres) beyond which the weight falls as `1 / (1 + (r/s)²)` (Cauchy), so
    /// that points without a true partner have little influence; `None`: unit weights.
    pub robust_m: Option<f64>,
    /// Minimum number of correspondences; with fewer, the registration ends.
    pub least: usize,
}

impl Default for RegisterOptions {
    fn default() -> Self {
        RegisterOptions {
            method: Method::Generalised,
            start_target_from_source: Isometry3::identity(),
            within_m: 0.05,
            rounds: 50,
            settle_m: 1e-5,
            settle_rad: 1e-5,
            robust_m: None,
            least: 10,
        }
    }
}

/// Reason registration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    /// Converged: the last iteration moved less than the threshold.
    Settled,
    /// All iterations were used while the source still moved.
    OutOfRounds,
    /// Too few correspondences: the clouds do not overlap at the initial pose.
    TooFewPartners,
}

impl std::fmt::Display for Termination {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Termination::Settled => "settled",
            Termination::OutOfRounds => "out of rounds while still moving",
            Termination::TooFewPartners => "too few partners: the clouds do not overlap there",
        })
    }
}

/// Pose of the source, with quality measures.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Pose of the source in the target's frame.
    pub target_from_source: Isometry3<f64>,
    /// Number of source points with a correspondence at that pose.
    pub matched: usize,
    /// Number of source points.
    pub of: usize,
    /// Root mean square of the minimised residuals over the correspondences, metres: point to
    /// point, or point to tangent plane.
    pub residual_m: f64,
    /// Number of iterations.
    pub rounds: usize,
    /// Reason registration ended.
    pub ending: Termination,
    /// Displacement of the source's centroid from the initial pose, metres.
    pub moved_m: f64,
    /// Rotation from the initial pose, radians.
    pub moved_rad: f64,
    /// Number of unconstrained directions of motion (of six): 3 for two planes, 1 for two infinite
    /// cylinders; the source is not moved along them.
    pub free: usize,
    /// Normal matrix of the last iteration (small rotation, then shift, about `centre` in the
    /// target's frame), for weighting this fit among others.
    pub information: Matrix6<f64>,
    /// Point of the target's frame about which `information` describes motions.
    pub centre: Point3<f64>,
}

impl Fit {
    /// True if the iteration converged and every direction of motion is constrained.
    pub fn converged(&self) -> bool {
        self.ending == Termination::Settled && self.free == 0
    }
}

/// Reason clouds cannot be registered.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RegisterError {
    /// A cloud without a finite point.
    #[error("the {which} cloud has no finite point")]
    Empty {
        /// `source` or `target`.
        which: &'static str,
    },
    /// The method needs normals.
    #[error("{method:?} needs normals of the {which} cloud: prepare it with `with_normals`")]
    NoNormals {
        /// `source` or `target`.
        which: &'static str,
        /// The method.
        method: Method,
    },
    /// Length option that is not positive.
    #[error("{name} is {value_m} m: give a positive length")]
    Length {
        /// Name of the option.
        name: &'static str,
        /// Value that was given.
        value_m: f64,
    },
    /// Non-finite initial pose.
    #[error("the start pose is not finite: mend the transform it came from")]
    Start,
}
