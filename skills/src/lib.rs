#![doc = include_str!("../README.md")]

mod align;
mod ask;
mod circle;
mod model;
mod r#move;
mod observe;
mod pick_up;
mod program;
mod put_down;
mod skill;

pub use align::Align;
pub use ask::Ask;
pub use circle::Circle;
pub use descry_robots;
pub use model::{Model, Modelled};
pub use r#move::Move;
pub use observe::Observe;
pub use pick_up::PickUp;
pub use program::{Asked, Program};
pub use put_down::PutDown;
pub use skill::{Call, Context, Outcome, Skill, SkillFailure};
