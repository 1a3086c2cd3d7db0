//! Errors of recognising learned models.

use crate::cloud::CloudError;
use crate::register::RegisterError;
use crate::voxel::VoxelError;

/// Reason why a model or a view cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KnowError {
    /// A model has too few points with normals.
    #[error("the model has {points} points with a normal: learn it, or estimate normals that point outwards")]
    Model {
        /// Number of points with normals.
        points: usize,
    },
    /// A view is no depth image, and its camera is unknown.
    #[error(
        "the view shows no pixels in front of a camera: give an organised cloud in the optical frame (z forward), or intrinsics"
    )]
    NoCamera,
    /// There are too many points to index.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// Points are too far out for voxels.
    #[error(transparent)]
    Voxel(#[from] VoxelError),
    /// A pose could not be refined.
    #[error(transparent)]
    Register(#[from] RegisterError),
}
