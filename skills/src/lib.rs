#![doc = include_str!("../README.md")]

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
