//! Tasks of instantaneous actions over finite-domain variables and numbers, in flat arrays.

pub(crate) mod compiled;
mod measure;
pub(crate) mod numbers;
pub(crate) mod successor;
