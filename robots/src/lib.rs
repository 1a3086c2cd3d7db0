//! Bodies: the `Robot` trait and its implementations.

pub mod body;
pub mod conformance;
pub mod failure;
pub mod grid;
pub mod head;
pub mod input;
pub mod program;
pub mod recorded;
pub mod route;
pub mod sim;
pub mod truth;

pub use async_trait::async_trait;
pub use body::{
    CancellationToken, Colour, Description, Door, Driven, Footprint, Frames, Grasp, Grasped, Hand, Head,
    Laser, Looked, Opened, Place, Placed, Placing, Pose2, PoseEstimate, Progress, Push, Pushed, Robot, Room,
    Scanned, Sensed, Speeds, Stamp, StampedTransform, Station, SurfaceHint, Travel, Watch,
};
pub use descry_perception as perception;
pub use failure::Failure;
pub use grid::OccupancyGrid;
pub use image;
pub use nalgebra;
