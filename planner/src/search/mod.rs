//! Search for plans of instantaneous actions over finite-domain variables and numbers.

mod abreast;
pub(crate) mod classical;
mod horizon;
mod improve;
pub(crate) mod lazy;
mod lookahead;
mod novelty;
mod open;
pub(crate) mod run;
mod steer;
pub(crate) mod store;
