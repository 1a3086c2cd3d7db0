//! Search for plans of instantaneous actions over finite-domain variables and numbers.

#[doc(hidden)]
pub mod abreast;
pub(crate) mod astar;
pub(crate) mod classical;
#[doc(hidden)]
pub mod horizon;
#[doc(hidden)]
pub mod improve;
#[doc(hidden)]
pub mod lazy;
#[doc(hidden)]
pub mod lookahead;
#[doc(hidden)]
pub mod novelty;
mod open;
pub mod portfolio;
#[doc(hidden)]
pub mod run;
mod steer;
pub(crate) mod store;
