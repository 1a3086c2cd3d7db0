//! Recognition of the objects on a surface as percepts (paper 004, section V, "Tabletop Scene Perception").

#[doc(hidden)]
pub mod asker;
#[doc(hidden)]
pub mod body;
pub mod colour;
mod descry;
#[doc(hidden)]
pub mod ends;
mod evidence;
mod likelihood;
mod model;
mod necked;
mod painted;
mod parting;
mod percept;
mod published;
#[doc(hidden)]
pub mod rays;
mod resting;
mod settle;
mod stranger;
mod toppled;
#[doc(hidden)]
pub mod upper;
mod verify;

use crate::segment::Scene;
use crate::visibility::Visibility;

pub use colour::Colour;
pub use descry::Descry;
pub use model::{Handle, ModelError, ObjectModel, Range, Shape, Top, check_models};
pub use percept::{Evidence, Percept, Sighting, Stance, probability_of};
pub use published::Published;

/// Method that assigns known objects to the segments of a scene.
pub trait Recogniser: Send + Sync {
    /// Name for selection on the command line and in files.
    fn name(&self) -> &'static str;

    /// Percepts of all segments, in segment order; where a segment is two objects, the one on or in
    /// the other comes first. The models are mutually exclusive hypotheses.
    fn recognise(&self, scene: &Scene, seen: &Visibility, models: &[ObjectModel]) -> Vec<Percept>;
}
