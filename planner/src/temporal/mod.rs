//! Search for timed plans.

mod advance;
mod compress;
mod destroy;
mod direction;
mod envelope;
mod estimate;
mod improve;
mod joined;
mod manner;
mod mentions;
mod order;
mod overlap;
mod relaxed;
mod remaining;
mod schedule;
mod search;
mod space;
mod store;
mod timed;
mod together;
mod touch;
mod tours;
mod world;

pub(crate) use improve::{Limits, Progress, Reason, search_plans};
pub(crate) use manner::Counts;
pub(crate) use space::Measure;
pub(crate) use timed::{Timed, to_plan};
pub(crate) use world::World;
