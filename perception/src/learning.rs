//! Unsupervised learning of object models (Fäulhammer et al., *Autonomous Learning of Object Models
//! on a Mobile Robot*).
//!
//! The steps, in order:
//! - [`MetaRoom`]: what differs from the static structure of a place (Eq. 1, 2).
//! - [`stands`], [`trajectories`]: positions around the object from which to view it.
//! - [`keyframes`], [`register`]: the views that differ enough, and their alignment.
//! - [`learn`]: the object in each view, without edges, supervoxels and planes that are not its own (Eq. 3, 4),
//!   propagated from view to view and grown; [`LearnedModel`]: the views fused by their noise.
//! - [`Library`]: recognition of learned models, with a pose and a confidence.
//! - [`united`]: a model extended by what a later encounter shows.

mod around;
mod change_detection;
mod error;
mod frame;
mod fuse;
mod grow;
#[doc(hidden)]
pub mod mask;
mod model;
mod photometric;
mod planes;
#[doc(hidden)]
pub mod recognition;
mod register;
mod supervoxel;
mod unite;

pub use around::{AroundOptions, nearest, stands, trajectories};
pub use change_detection::{Appeared, MetaRoom, NoticeOptions, Visit};
pub use error::LearningError;
pub use model::{LearnOptions, LearnedModel, Used, learn};
pub use recognition::evidence::{Judge, PoseEvidence, WEIGHTS};
pub use recognition::several::{Glance, Guess, Judged};
pub use recognition::{Hypothesis, KnowError, KnowOptions, Library, Recognised, choose, outward};
pub use register::{Keyframe, keyframes, register};
pub use unite::{United, united};
