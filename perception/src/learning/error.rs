//! Errors of learning.

use crate::cloud::CloudError;
use crate::cluster::ClusterError;
use crate::merge::MergeError;
use crate::register::RegisterError;
use crate::voxel::VoxelError;

/// Views, masks or options that cannot be learned from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LearningError {
    /// The list of views is empty.
    #[error("no view to learn from: give at least one")]
    NoViews,
    /// A view whose pixels are not known.
    #[error("view {view} is no depth image: give an organised cloud, or one with its camera's intrinsics")]
    NotOrganised {
        /// Index of the view.
        view: usize,
    },
    /// Mask size and first view differ.
    #[error("the mask has {found} pixels where the first view has {expected}: give one entry a pixel")]
    Mask {
        /// Number of entries given.
        found: usize,
        /// Pixels of the view.
        expected: usize,
    },
    /// The view with the mask does not fit the others.
    #[error(
        "the first view was left out ({why}): what it shows of the object cannot be carried over to the others"
    )]
    FirstLeftOut {
        /// Reason.
        why: String,
    },
    /// Cleaning left no points of the object.
    #[error(
        "{points} points of the object are left in the first view after its edge, outliers and planes were removed: go nearer"
    )]
    NothingLeft {
        /// Number of points.
        points: usize,
    },
    /// The models do not match as one object.
    #[error(
        "both lie on each other in {:.0} % only, {:.1} mm off, after one was moved by {:.0} mm: they are not one surface",
        1e2 * shared, 1e3 * off_m, 1e3 * moved_m
    )]
    Disagree {
        /// Overlapping share of the smaller model.
        shared: f64,
        /// Root mean square distance in the overlap, metres.
        off_m: f64,
        /// Motion that was needed to fit, metres.
        moved_m: f64,
    },
    /// Invalid options.
    #[error("learning option `{field}` is {value}: expected {expected}")]
    Option {
        /// The option.
        field: &'static str,
        /// Given value.
        value: f64,
        /// Expected values.
        expected: &'static str,
    },
    /// Registration of the views failed.
    #[error(transparent)]
    Merge(#[from] MergeError),
    /// Registration of a cloud failed.
    #[error(transparent)]
    Register(#[from] RegisterError),
    /// Too many points.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// Downsampling failed.
    #[error(transparent)]
    Voxel(#[from] VoxelError),
    /// Clustering failed.
    #[error(transparent)]
    Cluster(#[from] ClusterError),
}

impl LearningError {
    /// Checks that a number is positive.
    pub(super) fn positive(field: &'static str, value: f64) -> Result<(), LearningError> {
        if value.is_finite() && value > 0.0 {
            return Ok(());
        }
        Err(LearningError::Option { field, value, expected: "a positive number" })
    }
}
