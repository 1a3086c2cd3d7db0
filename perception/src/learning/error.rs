//! Errors of learning.

use crate::cloud::CloudError;
use crate::cluster::ClusterError;
use crate::merge::MergeError;
use crate::register::RegisterError;
use crate::voxel::VoxelError;

/// Reason why nothing can be learned from views, masks or options.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LearningError {
    /// The list of views is empty.
    #[error("no view to learn from: give at least one")]
    NoViews,
    /// A view is no depth image.
    #[error("view {view} is no depth image: give an organised cloud, or one with its camera's intrinsics")]
    NotOrganised {
        /// Index of the view.
        view: usize,
    },
    /// The mask does not have one entry per pixel of the first view.
    #[error("the mask has {found} pixels where the first view has {expected}: give one entry a pixel")]
    Mask {
        /// Number of entries in the mask.
        found: usize,
        /// Number of pixels of the first view.
        expected: usize,
    },
    /// The first view, which has the mask, does not fit the others.
    #[error(
        "the first view was left out ({why}): what it shows of the object cannot be carried over to the others"
    )]
    FirstLeftOut {
        /// Reason for leaving the view out.
        why: String,
    },
    /// Filtering left too few points of the object.
    #[error(
        "{points} points of the object are left in the first view after its edge, outliers and planes were removed: go nearer"
    )]
    NothingLeft {
        /// Number of points that are left.
        points: usize,
    },
    /// Two models do not match as one object.
    #[error(
        "both lie on each other in {:.0} % only, {:.1} mm off, after one was moved by {:.0} mm: they are not one surface",
        1e2 * shared, 1e3 * off_m, 1e3 * moved_m
    )]
    Disagree {
        /// Overlapping share of the smaller model.
        shared: f64,
        /// Root mean square distance in the overlap, metres.
        off_m: f64,
        /// Shift by which registration moved one of the models, metres.
        moved_m: f64,
    },
    /// An option is out of range.
    #[error("learning option `{field}` is {value}: expected {expected}")]
    Option {
        /// Name of the option.
        field: &'static str,
        /// Given value.
        value: f64,
        /// Description of permitted values.
        expected: &'static str,
    },
    /// Registration of the views failed.
    #[error(transparent)]
    Merge(#[from] MergeError),
    /// Registration of a cloud failed.
    #[error(transparent)]
    Register(#[from] RegisterError),
    /// There are too many points to index.
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
