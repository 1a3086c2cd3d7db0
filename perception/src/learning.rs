//! Unsupervised learning of object models (Fäulhammer et al., *Autonomous Learning of Object Models
//! on a Mobile Robot*).
//!
//! The pipeline, a file a step: what differs from the static structure of a place ([`MetaRoom`], Eq. 1, 2); where to stand around it
//! ([`stands`], [`trajectories`]); the looks that are far enough apart ([`keyframes`]) brought together ([`register`]); in each look the object is
//! cleaned of its edge, supervoxels and planes (Eq. 3, 4), carried over from the looks before and grown ([`learn`]); all are fused by their noise
//! ([`LearnedModel`]); and known again, with a pose and a confidence ([`Library`]). What a later meeting shows is added ([`united`]).

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
