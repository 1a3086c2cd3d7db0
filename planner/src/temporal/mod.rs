//! Search for timed plans.

mod advance;
mod envelope;
mod improve;
mod order;
mod relaxed;
mod search;
mod store;
mod touch;
mod world;

pub(crate) use improve::{Limits, Progress, Reason, Timed, search_plans};
pub(crate) use search::{Counts, Measure};
pub(crate) use world::World;
