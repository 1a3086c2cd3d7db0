//! Search for plans of instantaneous actions over finite-domain variables and numbers.

pub(crate) mod classical;
pub(crate) mod compiled;
mod improve;
pub(crate) mod lazy;
mod lookahead;
mod measure;
mod novelty;
pub(crate) mod numbers;
mod open;
pub(crate) mod run;
mod steer;
pub(crate) mod store;
pub(crate) mod successor;
