//! Merging and alignment of several views (paper 004, section V, "Point Cloud Merging and
//! Alignment").
//!
//! The paper chains pairwise ICP. Here all views are aligned together, against each other and
//! against their localised poses, so that nothing drifts and the merged frame stays the average of
//! the localised poses. A view that cannot be placed is left out, with the reason.

mod align;
mod check;
mod depth_samples;
mod error;
mod fuse;
mod incremental;
mod joint;
mod merged;
mod options;
mod parts;
mod prepare;
mod search;
mod settle;
mod voxel_blocks;

use crate::pool;
use crate::view::View;
use align::{fits, place, visibility};
pub use error::MergeError;
pub use incremental::Merger;
pub use merged::{Merged, Step, ViewFit};
pub use options::MergeOptions;
use prepare::{Ready, filter_and_thin};

/// Merges views into one cloud in the world frame; a single view is only filtered and fused.
///
/// # Errors
/// If there is no view, no usable point, a pose that is not finite, or an invalid option.
pub fn merge(views: &[View], options: &MergeOptions) -> Result<Merged, MergeError> {
    pool::within(tracing::debug_span!("merge", views = views.len()), || {
        options.check(views)?;
        let Ready { prepared, maps } = Ready::of(views, options);
        let mut steps = filter_and_thin(views, &prepared, options)?;
        let mut aligned = place(&prepared, &maps, options, &mut steps);
        let seen = visibility(maps, &aligned.used, &aligned.poses);
        let gathered = fuse::gather(views, &prepared, &aligned, &seen, options, None);
        Ok(settle::merged(&gathered, seen, fits(&prepared, &mut aligned), steps))
    })
}

/// Aligns the views without merging (steps 1 to 4); one fit per view, in order.
///
/// # Errors
/// As [`merge`].
pub fn align_views(views: &[View], options: &MergeOptions) -> Result<Vec<ViewFit>, MergeError> {
    pool::within(tracing::debug_span!("align views", views = views.len()), || {
        options.check(views)?;
        let Ready { prepared, maps } = Ready::of(views, options);
        let mut steps = filter_and_thin(views, &prepared, options)?;
        let mut aligned = place(&prepared, &maps, options, &mut steps);
        Ok(fits(&prepared, &mut aligned))
    })
}
