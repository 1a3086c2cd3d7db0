//! Bodies: the `Robot` trait and its implementations.
//!
//! ```
//! use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};
//! use descry_robots::{Place, Pose2, Robot, Watch, nalgebra::Point3};
//!
//! let text = "
//! [[surface]]
//! name = 'table'
//! size_m = [1.2, 0.8]
//! height_m = 0.72
//! [start]
//! position_m = [-2.0, 0.3]
//! [[object]]
//! name = 'cup'
//! shape.cup = { diameter_m = 0.07, height_m = 0.1 }
//! ";
//! let scene = arrange(&SceneSpec::parse("table.toml", text)?, 1)?;
//! let robot = SimRobot::new(scene, SimOptions { seed: 1, ..SimOptions::default() });
//! # let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
//! # runtime.block_on(async {
//! let watch = Watch::default(); // it may take five minutes of the body's own time
//! let to = Place::Pose(Pose2 { x_m: -1.4, y_m: 0.0, yaw_rad: 0.0 });
//! let driven = robot.drive_to(&to, &watch).await?;
//! assert!(driven.distance_m > 0.0);
//! robot.look_at(&Point3::new(0.0, 0.0, 0.75), &watch).await?;
//! let seen = robot.sense(&watch).await?;
//! assert_eq!(seen.cloud.points.len(), seen.depth_m.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! # })?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
    Pose2, PoseEstimate, Progress, Push, Pushed, Reading, Robot, Room, Scanned, Sensed, Stamp,
    StampedTransform, Station, SurfaceHint, Travel, Watch,
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
