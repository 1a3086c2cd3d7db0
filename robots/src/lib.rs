#![doc = include_str!("../README.md")]

pub mod body;
pub mod conformance;
pub mod failure;
pub mod grid;
pub mod head;
pub mod input;
pub mod parts;
pub mod program;
pub mod recorded;
pub mod request;
pub mod route;
pub mod sim;
pub mod truth;

pub use async_trait::async_trait;
pub use body::{
    CancellationToken, Colour, Door, Driven, Grasp, Grasped, Hand, Looked, Opened, Place, Placed, Placing,
    Pose2, PoseEstimate, Poured, Pouring, Progress, Push, Pushed, Reading, Robot, Room, Scanned, Sensed,
    Stamp, StampedTransform, Station, SurfaceHint, Travel, Watch,
};
pub use descry_perception as perception;
pub use failure::Failure;
pub use grid::OccupancyGrid;
pub use image;
pub use nalgebra;
pub use parts::{
    Arm, Base, Camera, Description, Footprint, Frames, Gripper, Head, Laser, Part, Sense, Speeds,
};
pub use request::{Answer, Exposure, Pixels, Request};
