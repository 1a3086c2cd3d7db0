//! From views to percepts, models and maps.

pub mod camera;
pub mod cloud;
pub mod merge;
pub mod recognise;
pub mod segment;
pub mod surface;
pub mod view;
pub mod visibility;

pub use camera::{CameraError, Intrinsics};
pub use cloud::{Cloud, CloudError, Grid};
pub use merge::{MergeError, MergeOptions, Merged, ViewFit};
pub use nalgebra;
pub use recognise::{Evidence, ObjectModel, Percept, Recogniser, Sighting, Stance};
pub use segment::{Scene, Segment};
pub use surface::Surface;
pub use view::View;
pub use visibility::Visibility;
