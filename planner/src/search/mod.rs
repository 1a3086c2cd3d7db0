//! Search for plans of instantaneous actions over finite-domain variables.

pub(crate) mod classical;
pub(crate) mod compiled;
mod improve;
pub(crate) mod lazy;
mod lookahead;
mod novelty;
mod open;
pub(crate) mod run;
pub(crate) mod store;
pub(crate) mod successor;
