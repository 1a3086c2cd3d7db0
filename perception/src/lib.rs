#![doc = include_str!("../README.md")]

pub mod calibration;
pub mod camera;
pub mod cloud;
pub mod cluster;
pub mod consistency;
#[doc(hidden)]
pub mod draw;
pub mod files;
pub mod hull;
pub mod laser;
#[doc(hidden)]
pub mod lattice;
pub mod learning;
pub mod locate;
pub mod mapping;
pub mod merge;
pub mod neighbours;
pub mod noise;
pub mod normals;
pub mod occupancy;
pub mod outliers;
#[doc(hidden)]
pub mod outline;
pub mod picture;
pub mod plane;
#[doc(hidden)]
pub mod polygon;
#[doc(hidden)]
pub mod pool;
#[doc(hidden)]
pub mod quantile;
pub mod recognise;
pub mod register;
#[doc(hidden)]
pub mod round;
#[doc(hidden)]
pub mod scale;
pub mod segment;
#[doc(hidden)]
pub mod spread;
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
