//! Temporal planning: search for plans with times.

#[doc(hidden)]
pub mod advance;
#[doc(hidden)]
pub mod compress;
mod destroy;
#[doc(hidden)]
pub mod direction;
#[doc(hidden)]
pub mod envelope;
mod estimate;
mod improve;
mod independence;
#[doc(hidden)]
pub mod joined;
mod linear;
mod manner;
#[doc(hidden)]
pub mod mentions;
#[doc(hidden)]
pub mod order;
mod overlap;
mod program;
#[doc(hidden)]
pub mod relaxed;
mod remaining;
#[doc(hidden)]
pub mod schedule;
mod search;
#[doc(hidden)]
pub mod space;
mod store;
mod timed;
mod together;
mod touch;
#[doc(hidden)]
pub mod tours;
#[doc(hidden)]
pub mod world;

pub(crate) use improve::{Limits, Progress, Reason, search_plans};
pub(crate) use manner::Counts;
pub(crate) use space::Measure;
pub(crate) use timed::{Timed, to_plan};
pub use world::World;
