//! From views to percepts, models and maps.

pub mod camera;
pub mod cloud;
pub mod cluster;
pub mod cylinder;
mod draw;
pub mod files;
pub mod hull;
pub mod merge;
pub mod neighbours;
pub mod noise;
pub mod normals;
pub mod outliers;
mod outline;
pub mod plane;
pub mod recognise;
pub mod register;
mod round;
pub mod segment;
mod spread;
pub mod surface;
pub mod view;
pub mod visibility;
pub mod voxel;

pub use camera::{CameraError, Intrinsics};
pub use cloud::{Cloud, CloudError, Grid};
pub use hull::Hull;
pub use merge::{MergeError, MergeOptions, Merged, ViewFit};
pub use nalgebra;
pub use neighbours::{Neighbour, Neighbours};
pub use plane::Plane;
pub use recognise::{Evidence, ObjectModel, Percept, Recogniser, Sighting, Stance};
pub use segment::{Scene, Segment};
pub use surface::Surface;
pub use view::View;
pub use visibility::Visibility;
