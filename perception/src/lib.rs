//! From views to percepts, models and maps.

pub mod camera;
pub mod cloud;
pub mod view;

pub use camera::{CameraError, Intrinsics};
pub use cloud::{Cloud, CloudError, Grid};
pub use nalgebra;
pub use view::View;
