//! From what an action means to motion and looking: one file per skill.

mod align;
mod circle;
mod r#move;
mod observe;
mod open_door;
mod pick_up;
mod program;
mod push_aside;
mod put_down;
mod scan;
mod skill;

pub use align::Align;
pub use circle::Circle;
pub use descry_robots;
pub use r#move::Move;
pub use observe::Observe;
pub use open_door::OpenDoor;
pub use pick_up::PickUp;
pub use program::{Asked, Program};
pub use push_aside::PushAside;
pub use put_down::PutDown;
pub use scan::Scan;
pub use skill::{Call, Context, Outcome, Skill, SkillFailure};
