//! Search for plans of instantaneous actions over finite-domain variables.

pub(crate) mod classical;
pub(crate) mod compiled;
pub(crate) mod lazy;
mod lookahead;
mod open;
pub(crate) mod run;
pub(crate) mod store;
pub(crate) mod successor;
