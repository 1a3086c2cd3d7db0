//! From a PDDL action to motion and looking: one file per action, named like it.

mod r#move;
mod observe;
mod push_aside;
mod skill;

pub use descry_robots;
pub use r#move::Move;
pub use observe::Observe;
pub use push_aside::PushAside;
pub use skill::{ALL, Call, Context, Outcome, Skill, SkillFailure, Symbols, named};
