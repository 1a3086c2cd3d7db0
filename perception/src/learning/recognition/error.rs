//! Errors of recognising learned models.

use crate::cloud::CloudError;
use crate::register::RegisterError;
use crate::voxel::VoxelError;

/// Models or views that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KnowError {
    /// A model without normals or with next to no points.
    #[error("the model has {points} points with a normal: learn it, or estimate normals that point outwards")]
    Model {
        /// Number of points.
        points: usize,
    },
    /// A view whose pixels are not known.
    #[error(
        "the view shows no pixels in front of a camera: give an organised cloud in the optical frame (z forward), or intrinsics"
    )]
    NoCamera,
    /// Too many points.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// Points too far out.
    #[error(transparent)]
    Voxel(#[from] VoxelError),
    /// A pose could not be refined.
    #[error(transparent)]
    Register(#[from] RegisterError),
}
