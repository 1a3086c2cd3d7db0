//! From what an action means to motion and looking: one file per skill.
//!
//! ```
//! use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};
//! use descry_robots::{CancellationToken, nalgebra::Point3};
//! use descry_skills::{Context, Observe, Outcome, Skill};
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
//! let robot = SimRobot::new(scene, SimOptions::default());
//! let context =
//!     Context { robot: &robot, cancel: CancellationToken::new(), time_limit_s: 10.0, progress: &|_| {} };
//! let look = Observe { at: Some(Point3::new(0.0, 0.0, 0.75)) };
//! # let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
//! let outcome = runtime.block_on(look.perform(&context))?;
//! let Outcome::Seen(sensed) = outcome else { panic!("{outcome:?}") };
//! assert!(sensed.cloud.points.iter().any(|point| point.z.is_finite()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod align;
mod circle;
mod model;
mod r#move;
mod observe;
mod open_door;
mod pick_up;
mod program;
mod push_aside;
mod put_down;
mod read;
mod scan;
mod skill;

pub use align::Align;
pub use circle::Circle;
pub use descry_robots;
pub use model::{Model, Modelled};
pub use r#move::Move;
pub use observe::Observe;
pub use open_door::OpenDoor;
pub use pick_up::PickUp;
pub use program::{Asked, Program};
pub use push_aside::PushAside;
pub use put_down::PutDown;
pub use read::Read;
pub use scan::Scan;
pub use skill::{Call, Context, Outcome, Skill, SkillFailure};
