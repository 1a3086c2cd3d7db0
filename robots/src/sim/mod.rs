//! A simulated room with a table: scenes, the depth camera, driving, faults. The only place that reads the truth.

pub mod arrange;
pub mod body;
pub mod drive;
pub mod faults;
pub mod noise;
pub mod push;
pub mod render;
mod robot;
pub mod scene;
pub mod shape;
mod state;
pub mod truth;
pub mod world;

pub use arrange::arrange;
pub use faults::{Fault, FaultKind, FaultPlan};
pub use noise::DepthNoise;
pub use robot::{SimOptions, SimRobot};
pub use scene::SceneSpec;
pub use truth::{Event, TrueObject, Truth};
pub use world::{Object, Scene};
