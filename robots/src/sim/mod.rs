//! Simulated rooms with tables, shelves and doors: scenes, the depth camera, driving, the hand, faults. The
//! only module that reads the ground truth.

pub mod arrange;
pub mod body;
pub mod composed;
pub mod drive;
pub mod faults;
pub mod frame;
mod hand;
mod handling;
pub mod laser;
pub mod light;
pub mod noise;
pub mod outline;
pub mod push;
pub mod render;
mod robot;
mod routes;
pub mod scene;
pub mod shape;
mod state;
pub mod stereo;
mod truth;
pub mod walls;
pub mod world;

pub use arrange::arrange;
pub use faults::{Fault, FaultKind, FaultPlan};
pub use noise::DepthNoise;
pub use robot::{SimOptions, SimRobot};
pub use scene::SceneSpec;
pub use stereo::Stereo;
pub use world::{HungDoor, Object, Scene, Stand};
